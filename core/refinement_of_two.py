# SPDX-License-Identifier: GPL-3.0-or-later
"""A refinement of a refinement, told as one of the mesh that both come from."""

import numpy as np

from .arrays import FloatArray, IntArray
from .refinement import Refinement

# Corners of a coarse face that a point of it is told by.
_SOURCES = 4


def composed(first: Refinement, second: Refinement) -> Refinement:
    """Return two refinements as one.

    Parameters
    ----------
    first : Refinement
        Of a mesh.
    second : Refinement
        Of the mesh that `first` makes.

    Returns
    -------
    Refinement
        The mesh that `second` makes, and what of the first mesh it is made of.
    """
    corner_source, corner_weight = _through(
        second.corner_source, second.corner_weight, first.corner_source, first.corner_weight
    )
    vertex_source, vertex_weight = _through(
        second.vertex_source, second.vertex_weight, first.vertex_source, first.vertex_weight
    )
    edge, edge_source = _edges(first, second)
    return Refinement(
        second.vertices,
        second.corner_vertex,
        second.face_start,
        first.face[second.face],
        corner_source,
        corner_weight,
        vertex_source,
        vertex_weight,
        edge,
        edge_source,
    )


def _through(source: IntArray, weight: FloatArray, of: IntArray, share: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return what things are made of whose sources are made of something themselves, the greatest share first."""
    count = len(source)
    of, share = of[source].reshape(count, -1), (weight[:, :, None] * share[source]).reshape(count, -1)
    order = np.argsort(of, axis=1, kind="stable")
    of, share = np.take_along_axis(of, order, axis=1), np.take_along_axis(share, order, axis=1)
    # Each source once, with all that it counts.
    begins = np.ones(of.shape, dtype=bool)
    begins[:, 1:] = of[:, 1:] != of[:, :-1]
    row, column = np.nonzero(begins)
    total = np.zeros(of.shape)
    total[row, column] = np.add.reduceat(share.ravel(), row * of.shape[1] + column) if count else 0.0
    # A part of a face is made of no more than its corners; all others count nothing.
    best = np.argsort(-np.abs(total), axis=1, kind="stable")[:, :_SOURCES]
    return np.take_along_axis(of, best, axis=1), np.take_along_axis(total, best, axis=1)


def _edges(first: Refinement, second: Refinement) -> tuple[IntArray, IntArray]:
    """Return the parts of the edges of the first mesh, in the order of these, and those edges."""
    base = max(len(first.vertices), 1)
    low, high = np.sort(first.edge, axis=1).T
    known = np.argsort(low * base + high)
    key = (low * base + high)[known]
    low, high = np.sort(second.edge_source, axis=1).T
    place = np.minimum(np.searchsorted(key, low * base + high), max(len(key) - 1, 0))
    within = np.flatnonzero(key[place] == low * base + high) if len(key) else np.zeros(0, np.int64)
    source = first.edge_source[known[place[within]]]
    order = np.lexsort((source.max(axis=1), source.min(axis=1)))
    return second.edge[within][order], source[order]
