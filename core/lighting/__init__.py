# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that comes from no face: lamps, sun and sky, and their soft shadows."""
