# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks against Cycles and against the thesis's program; run them with ``python -m tests.benchmarks``."""
