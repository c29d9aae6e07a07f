# SPDX-License-Identifier: GPL-3.0-or-later
"""The pieces of faces cut into patches, as finely as their `Grid` says."""

from dataclasses import dataclass

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .grids import Grid
from .runs import counted


@dataclass(frozen=True, eq=False)
class Cut:
    """Patches on the fronts of all pieces, piece after piece.

    Attributes
    ----------
    base : ndarray of shape (p, 3)
        First corner of the piece [m].
    offset : ndarray of shape (p, 4, 3)
        Corners of the patch as seen from there [m]; a triangle repeats its last corner.
    face : ndarray of shape (p,)
        The face of the scene.
    touch : ndarray of shape (k, 3)
        Mesh corner, patch that has it as its own corner, and which of the four it is.
    """

    base: FloatArray
    offset: FloatArray
    face: IntArray
    touch: IntArray


def cut(pieces: Grid) -> Cut:
    """Cut the pieces into patches.

    Parameters
    ----------
    pieces : Grid
        Corners, rows and columns.

    Returns
    -------
    Cut
        Patches counter-clockwise as seen from the front.
    """
    counts = pieces.counts
    piece, local = counted(counts)
    rows, columns, similar, fan = pieces.rows[piece], pieces.columns[piece], pieces.similar[piece], pieces.fan[piece]
    # Everything relative to the piece's first corner: far from the origin that keeps the digits.
    arms = pieces.points[:, 1:] - pieces.points[:, :1]
    offset = np.zeros((len(piece), 4, 3))
    touch = []
    for slot, (i, j) in enumerate(zip(*lattice(local, columns, similar), strict=True)):
        u, v = i / rows, j / columns
        # Bilinear over four corners; over three, u and v are weights themselves.
        weights = np.stack([u * np.where(similar, 1, 1 - v), np.where(similar, v, u * v), (1 - u) * v], axis=1)
        weights[similar, 2] = 0.0
        offset[:, slot] = np.einsum("pa,pax->px", weights, arms[piece])
        # Which corner of the piece is met, if any; a fan's tip by the whole first row.
        met = np.where(np.any(weights == 1.0, axis=1), np.argmax(weights, axis=1) + 1, -1)
        met[np.all(weights == 0.0, axis=1) | (fan & (i == 0))] = 0
        hit = np.flatnonzero(met >= 0)
        touch.append(np.stack([pieces.corner[piece[hit], met[hit]], hit, np.full(len(hit), slot)], axis=1))
    tips = np.flatnonzero(fan & (local < columns))
    offset[tips, 3] = offset[tips, 2]
    return Cut(pieces.points[piece, 0], offset, pieces.face[piece], _distinct(np.concatenate(touch), len(piece)))


def lattice(local: IntArray, columns: IntArray, similar: BoolArray) -> tuple[list[IntArray], list[IntArray]]:
    """Return row and column of the four corners of every patch from its number inside the piece.

    Parameters
    ----------
    local : ndarray of shape (p,)
        Number of the patch, from 0 up.
    columns : ndarray of shape (p,)
        Of its piece.
    similar : ndarray of shape (p,)
        Whether that is cut into similar triangles; row and column then are steps along its edges 0-1 and 0-2.

    Returns
    -------
    rows, columns : list of ndarray of shape (p,)
        One for each corner, counter-clockwise; a triangle repeats its last one.
    """
    i, j = local // columns, local % columns
    # Row r of a triangle holds 2 r + 1 triangles, pointing towards the first corner and away from it in turn.
    r = np.sqrt(local.astype(np.float64)).astype(np.int64)
    k, away = np.divmod(local - r * r, 2)
    rows = zip([r - k, r + 1 - k - away, r - k - away, r - k - away], [i, i + 1, i + 1, i], strict=True)
    across = zip([k, k + away, k + 1, k + 1], [j, j, j + 1, j + 1], strict=True)
    return [np.where(similar, t, q) for t, q in rows], [np.where(similar, t, q) for t, q in across]


def _distinct(touch: IntArray, n_patches: int) -> IntArray:
    """Return the touches that meet a mesh corner, one for each pair of corner and patch."""
    touch = touch[touch[:, 0] >= 0]
    _, first = np.unique(touch[:, 0] * n_patches + touch[:, 1], return_index=True)
    return touch[first]
