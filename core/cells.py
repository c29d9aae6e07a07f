# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells in rows and columns, as those of a lamp or the pixels of a picture."""

from .arrays import BoolArray


def widened(cells: BoolArray) -> BoolArray:
    """Return chosen cells and those beside them, shape (..., rows, columns)."""
    wide = cells.copy()
    wide[..., 1:, :] |= cells[..., :-1, :]
    wide[..., :-1, :] |= cells[..., 1:, :]
    wide[..., 1:] |= cells[..., :-1]
    wide[..., :-1] |= cells[..., 1:]
    return wide
