# SPDX-License-Identifier: GPL-3.0-or-later
"""Convex pieces of polygons in their own planes, very many of them at once, cut by half-planes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Pieces:
    """Convex polygons of up to k corners in a plane.

    Attributes
    ----------
    owner : ndarray of shape (m,)
        What each piece belongs to.
    size : ndarray of shape (m,)
        Number of corners.
    u, v : ndarray of shape (k, m)
        Corners, counter-clockwise; beyond its size a piece repeats its last one [m].
    box : ndarray of shape (4, m)
        Around each piece: least u, least v, negated largest u, negated largest v [m].
    """

    owner: IntArray
    size: IntArray
    u: FloatArray
    v: FloatArray
    box: FloatArray

    def of(self, columns: IntArray) -> "Pieces":
        """Return some of the pieces."""
        return Pieces(
            self.owner[columns],
            self.size[columns],
            self.u.take(columns, axis=1),
            self.v.take(columns, axis=1),
            self.box.take(columns, axis=1),
        )


def boxed(owner: IntArray, size: IntArray, u: FloatArray, v: FloatArray) -> Pieces:
    """Return pieces with their boxes."""
    return Pieces(owner, size, u, v, np.stack((u.min(axis=0), v.min(axis=0), -u.max(axis=0), -v.max(axis=0))))


def together(blocks: Sequence[Pieces]) -> Pieces:
    """Return all pieces of several sets."""
    return Pieces(
        np.concatenate([block.owner for block in blocks]),
        np.concatenate([block.size for block in blocks]),
        _side_by_side([block.u for block in blocks]),
        _side_by_side([block.v for block in blocks]),
        np.concatenate([block.box for block in blocks], axis=1),
    )


def cut(
    pieces: Pieces, planes: FloatArray, clearance: FloatArray, wanted: BoolArray
) -> tuple[Pieces, IntArray, list[Pieces]]:
    """Cut each piece with the half-planes of a convex figure of its own.

    Parameters
    ----------
    pieces : Pieces
        m of them.
    planes : ndarray of shape (e, 3, m)
        a, b, c of the distance a u + b v + c from each of e edges, positive inside [m].
    clearance : ndarray of shape (m,)
        Distance that counts as none [m].
    wanted : ndarray of shape (m,)
        Whether what is outside the figure is wanted, too.

    Returns
    -------
    inside : Pieces
        What of the pieces is inside their figures.
    touched : ndarray of shape (len(inside.owner),)
        The pieces that these were cut from; the other ones are outside, whole.
    outside : list of Pieces
        What is left of the touched pieces that were wanted.
    """
    # Most pieces are outside one of the lines as a whole.
    near = np.ones(len(pieces.owner), dtype=bool)
    for a, b, c in planes:
        near &= (a * pieces.u + b * pieces.v + c).max(axis=0) > clearance
    column = np.flatnonzero(near)
    inside = pieces.of(column)
    cut_off: list[tuple[Pieces, IntArray]] = []
    for a, b, c in planes:
        distance = a[column] * inside.u + b[column] * inside.v + c[column]
        some = np.flatnonzero(wanted[column])
        off, kept = _clipped(inside.of(some), -distance[:, some], clearance[column[some]])
        cut_off.append((off, column[some][kept]))
        inside, kept = _clipped(inside, distance, clearance[column])
        column = column[kept]
    touched = np.zeros(len(pieces.owner), dtype=bool)
    touched[column] = True
    # Until the last cut it is not known whether a piece is touched at all.
    return inside, column, [off.of(np.flatnonzero(touched[column_off])) for off, column_off in cut_off]


def _clipped(pieces: Pieces, distance: FloatArray, none: FloatArray) -> tuple[Pieces, IntArray]:
    """Return what is left of pieces where the distance is positive, and which pieces that was cut from."""
    above = distance > none
    left = above.any(axis=0)
    crossed = left & (distance < -none).any(axis=0)
    whole, some = np.flatnonzero(left & ~crossed), np.flatnonzero(crossed)
    parts = _crossed(pieces.of(some), distance[:, some], above[:, some])
    return together((pieces.of(whole), parts)), np.concatenate((whole, some))


def _crossed(pieces: Pieces, distance: FloatArray, above: BoolArray) -> Pieces:
    """Return what is left of pieces that all have corners above and corners below.

    The corners above follow each other; the points where the border goes down and comes up again complete them.
    """
    row, column = np.arange(len(above))[:, None], np.arange(len(pieces.owner))
    above = above & (row < pieces.size)
    before = np.roll(above, 1, axis=0)
    before[0] = above[pieces.size - 1, column]
    first = np.argmax(above & ~before, axis=0)
    count = above.sum(axis=0)
    last = (first + count - 1) % pieces.size
    down = _zero(pieces, distance, last, (last + 1) % pieces.size)
    up = _zero(pieces, distance, first, (first - 1) % pieces.size)
    row = np.arange(int(np.max(count, initial=0)) + 2)[:, None]
    kept = (first + row) % np.maximum(pieces.size, 1)
    u, v = (
        np.where(row < count, np.take_along_axis(w, kept, axis=0), np.where(row == count, w_down, w_up))
        for w, w_down, w_up in zip((pieces.u, pieces.v), down, up, strict=True)
    )
    return boxed(pieces.owner, count + 2, u, v)


def _zero(pieces: Pieces, distance: FloatArray, high: IntArray, low: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return where the distance vanishes between a corner above and its neighbour that is not."""
    column = np.arange(len(pieces.owner))
    top, bottom = distance[high, column], np.minimum(distance[low, column], 0)
    share = top / (top - bottom)
    u, v = (w[high, column] + share * (w[low, column] - w[high, column]) for w in (pieces.u, pieces.v))
    return u, v


def _side_by_side(blocks: Sequence[FloatArray]) -> FloatArray:
    """Join arrays of corners in columns, repeating the last corners of the shorter ones."""
    most = max(len(block) for block in blocks)
    tall = [block[np.minimum(np.arange(most), len(block) - 1)] for block in blocks if block.shape[1]]
    return np.concatenate(tall, axis=1) if tall else np.zeros((most, 0))
