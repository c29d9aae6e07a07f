# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sides of the surfaces have light: decided island by island, by where light can reach."""
