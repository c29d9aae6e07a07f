# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids in the pieces of faces that meet the cuts of their edges, however differently those are cut.

A piece gets the grid of its finest edges. Along coarser ones the points of the grid move to the nearest cut, ties to
the ends, so that two corners of a cell may become one: quads become triangles, and a cell whose corners are only two is
none. No cell is ever turned over or flat, since points keep their order along the edge and no two of a row's go to the
tip of a fan.
"""

from dataclasses import dataclass

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .cutting import lattice
from .runs import counted

INSIDE = -1


@dataclass(frozen=True, eq=False)
class Pattern:
    """Pieces and how they are cut.

    Attributes
    ----------
    corner : ndarray of shape (q, 4)
        Corners of the mesh, counter-clockwise; a triangle repeats its last one, a fan has its tip first and last.
    face : ndarray of shape (q,)
        The face that each is a part of.
    parts : ndarray of shape (q, 4)
        Into how many parts the edge from each corner to the next is cut; 0 from a corner to itself.
    rows, columns : ndarray of shape (q,)
        Of the grid, along the edges 0-1 and 1-2.
    similar : ndarray of shape (q,)
        Triangles that are cut into rows^2 similar ones.
    """

    corner: IntArray
    face: IntArray
    parts: IntArray
    rows: IntArray
    columns: IntArray
    similar: BoolArray

    @property
    def cells(self) -> IntArray:
        """Return the number of cells of each piece, some of which may be none, shape (q,)."""
        return self.rows * self.columns

    @property
    def inner(self) -> IntArray:
        """Return the number of points inside of each piece, shape (q,)."""
        triangular = (self.rows - 1) * (self.rows - 2) // 2
        return np.where(self.similar, triangular, (self.rows - 1) * (self.columns - 1))


@dataclass(frozen=True, eq=False)
class Cells:
    """The corners of the cells of some pieces.

    Attributes
    ----------
    piece : ndarray of shape (m,)
    side : ndarray of shape (m, 4)
        Edge of the piece that the corner is on, or INSIDE; a triangle repeats its last corner.
    step : ndarray of shape (m, 4)
        At which cut of that edge, from its own beginning; for a point inside its number within the piece.
    weight : ndarray of shape (m, 4, 4)
        How much each corner of the piece counts there; together 1.
    """

    piece: IntArray
    side: IntArray
    step: IntArray
    weight: FloatArray


def quad_pattern(corner: IntArray, face: IntArray, parts: IntArray) -> Pattern:
    """Cut quads in the rows and columns of their finer edges.

    Parameters
    ----------
    corner, face, parts
        See `Pattern`.

    Returns
    -------
    Pattern
    """
    rows, columns = np.maximum(parts[:, 0], parts[:, 2]), np.maximum(parts[:, 1], parts[:, 3])
    return Pattern(corner, face, parts, rows, columns, np.zeros(len(face), dtype=bool))


def triangle_patterns(corner: IntArray, face: IntArray, parts: IntArray) -> tuple[Pattern, Pattern]:
    """Cut long triangles in rows from their tips, and the others into similar ones.

    Parameters
    ----------
    corner, face, parts
        See `Pattern`; of triangles.

    Returns
    -------
    fans, similar : Pattern
    """
    corner, parts = corner[:, :3], parts[:, [0, 1, 3]]
    long = 2 * parts.min(axis=1) <= parts.max(axis=1)
    # The tip lies opposite the edge with the fewest cuts.
    order = (np.argmin(parts[long], axis=1)[:, None] + np.array([2, 0, 1])) % 3
    tip, turned = np.take_along_axis(corner[long], order, axis=1), np.take_along_axis(parts[long], order, axis=1)
    fans = quad_pattern(
        np.column_stack((tip, tip[:, 0])), face[long], np.column_stack((turned, np.zeros(len(turned), np.int64)))
    )
    order = (np.argmax(parts[~long], axis=1)[:, None] + np.array([0, 1, 2])) % 3
    corner, parts = np.take_along_axis(corner[~long], order, axis=1), np.take_along_axis(parts[~long], order, axis=1)
    whole, n = np.column_stack((corner, corner[:, 2])), parts[:, 0]
    parts = np.column_stack((parts[:, :2], np.zeros(len(parts), np.int64), parts[:, 2]))
    return fans, Pattern(whole, face[~long], parts, n, n, np.ones(len(n), dtype=bool))


def anchored(pattern: Pattern) -> Cells:
    """Lay the grids and bind them to the cuts of the edges.

    Parameters
    ----------
    pattern : Pattern

    Returns
    -------
    Cells
        Piece after piece.
    """
    counts = pattern.cells
    piece, local = counted(counts)
    rows, columns, similar = pattern.rows[piece], pattern.columns[piece], pattern.similar[piece]
    fan = ~similar & (pattern.parts[piece, 3] == 0)
    side, step = np.zeros((len(piece), 4), np.int64), np.zeros((len(piece), 4), np.int64)
    weight = np.zeros((len(piece), 4, 4))
    for slot, (i, j) in enumerate(zip(*lattice(local, columns, similar), strict=True)):
        # The steps along the edges, in their own directions, and where each begins.
        far = np.where(similar, i + j == rows, i == rows)
        on = [j == 0, far, ~similar & (j == columns), i == 0]
        along = np.select(on, [i, j, rows - i, columns - j])
        edge = np.select(on, [0, 1, 2, 3], INSIDE)
        bound = edge != INSIDE
        parts = pattern.parts[piece, np.where(bound, edge, 0)]
        grid = np.where(edge % 2 == 0, rows, columns)
        moved = _moved(along, grid, parts)
        # In a fan only the first of them may go to the tip: with a second one there were a cell along the other edge.
        off = fan & (i > 1)
        moved = np.where(off & (edge == 0), np.maximum(moved, 1), moved)
        moved = np.where(off & (edge == 2), np.minimum(moved, parts - 1), moved)
        # In a triangle with two cuts the middles of both other edges go to the corner between these.
        moved = np.where(similar & (grid == 2) & (edge == 1) & (along == 1) & (parts == 1), 1, moved)
        inner = np.where(similar, (i - 1) * (rows - 1) - (i - 1) * i // 2 + j - 1, (i - 1) * (columns - 1) + j - 1)
        side[:, slot], step[:, slot] = edge, np.where(bound, moved, inner)
        weight[:, slot] = _weights(i / rows, j / columns, similar, edge, moved / np.maximum(parts, 1))
    return Cells(piece, side, step, weight)


def _moved(along: IntArray, grid: IntArray, parts: IntArray) -> IntArray:
    """Return the cut of an edge that is nearest to a point of a finer grid on it; ties go to the ends."""
    near = np.minimum(along, grid - along)
    step = (2 * near * parts + grid - 1) // (2 * grid)
    return np.asarray(np.where(2 * along > grid, parts - step, step))


def _weights(u: FloatArray, v: FloatArray, similar: BoolArray, edge: IntArray, share: FloatArray) -> FloatArray:
    """Return how much each corner of a piece counts at a point inside or on an edge, shape (m, 4)."""
    bilinear = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
    flat = np.stack([1 - u - v, u, v, np.zeros_like(u)], axis=1)
    weight = np.where(similar[:, None], flat, bilinear)
    bound = np.flatnonzero(edge != INSIDE)
    weight[bound] = 0.0
    weight[bound, edge[bound]] = 1 - share[bound]
    weight[bound, (edge[bound] + 1) % 4] += share[bound]
    return weight
