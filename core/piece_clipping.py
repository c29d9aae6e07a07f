# SPDX-License-Identifier: GPL-3.0-or-later
"""Convex pieces of polygons in their own planes, very many of them at once, cut by half-planes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Pieces:
    """Convex polygons of up to k corners in a plane; those with fewer repeat their last one.

    Attributes
    ----------
    owner : ndarray of shape (m,)
        What each piece belongs to.
    u, v : ndarray of shape (k, m)
        Corners, counter-clockwise [m].
    """

    owner: IntArray
    u: FloatArray
    v: FloatArray

    def of(self, columns: IntArray | BoolArray) -> "Pieces":
        """Return some of the pieces."""
        return Pieces(self.owner[columns], self.u[:, columns], self.v[:, columns])


def together(blocks: Sequence[Pieces]) -> Pieces:
    """Return all pieces of several sets."""
    return Pieces(
        np.concatenate([block.owner for block in blocks]),
        _side_by_side([block.u for block in blocks]),
        _side_by_side([block.v for block in blocks]),
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
    u, v = pieces.u[:, column], pieces.v[:, column]
    cut_off: list[tuple[FloatArray, FloatArray, IntArray]] = []
    for a, b, c in planes:
        distance = a[column] * u + b[column] * v + c[column]
        some = np.flatnonzero(wanted[column])
        cut_off.append(_clipped(u[:, some], v[:, some], -distance[:, some], column[some], clearance))
        u, v, column = _clipped(u, v, distance, column, clearance)
    touched = np.zeros(len(pieces.owner), dtype=bool)
    touched[column] = True
    outside: list[Pieces] = []
    for u_off, v_off, column_off in cut_off:
        # Until the last cut it is not known whether a piece is touched at all.
        some = np.flatnonzero(touched[column_off])
        outside.append(Pieces(pieces.owner[column_off[some]], u_off[:, some], v_off[:, some]))
    return Pieces(pieces.owner[column], u, v), column, outside


def _clipped(
    u: FloatArray, v: FloatArray, distance: FloatArray, column: IntArray, clearance: FloatArray
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return what is left of convex polygons where the distance is positive, and their columns."""
    none = clearance[column]
    above, below = distance > none, distance < -none
    left = above.any(axis=0)
    crossed = left & below.any(axis=0)
    whole, some = np.flatnonzero(left & ~crossed), np.flatnonzero(crossed)
    u_cut, v_cut = _crossed(u[:, some], v[:, some], distance[:, some], above[:, some], below[:, some])
    columns = np.concatenate((column[whole], column[some]))
    return _side_by_side((u[:, whole], u_cut)), _side_by_side((v[:, whole], v_cut)), columns


def _crossed(
    u: FloatArray, v: FloatArray, distance: FloatArray, above: BoolArray, below: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return what is left of polygons that all have corners above and corners below."""
    following = np.roll(np.arange(len(u)), -1)
    crossing = (above & below[following]) | (below & above[following])
    # Repeated corners are left out, or their number would grow with every cut.
    kept = ~below & ((u != np.roll(u, 1, axis=0)) | (v != np.roll(v, 1, axis=0)))
    share = distance / np.where(crossing, distance - distance[following], 1)
    # Each corner gives itself, the point where the edge after it crosses, both or none.
    given = kept.astype(np.int64) + crossing
    count = given.sum(axis=0)
    place = np.cumsum(given, axis=0) - given
    corner, column = np.nonzero(kept)
    edge, edge_column = np.nonzero(crossing)
    most = int(count.max(initial=0))
    last = np.minimum(np.arange(most)[:, None], count - 1)
    results: list[FloatArray] = []
    for w in (u, v):
        packed = np.zeros((most, u.shape[1]))
        packed[place[corner, column], column] = w[corner, column]
        between = w + share * (w[following] - w)
        packed[(place + kept)[edge, edge_column], edge_column] = between[edge, edge_column]
        results.append(np.take_along_axis(packed, last, axis=0))
    return results[0], results[1]


def _side_by_side(blocks: Sequence[FloatArray]) -> FloatArray:
    """Join arrays of corners in columns, repeating the last corners of the shorter ones."""
    most = max(len(block) for block in blocks)
    tall = [block[np.minimum(np.arange(most), len(block) - 1)] for block in blocks if block.shape[1]]
    return np.concatenate(tall, axis=1) if tall else np.zeros((most, 0))
