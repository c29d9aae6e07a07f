# SPDX-License-Identifier: GPL-3.0-or-later
"""The baked copy: every lit object and instance as an object of its own, its mesh as fine as the patches."""
