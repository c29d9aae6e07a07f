# SPDX-License-Identifier: GPL-3.0-or-later
"""Seams: edges that one surface has twice at the same place, as text, split edges and imports do."""

import numpy as np

from ..arrays import IntArray
from ..places import places
from ..scene import Scene
from .connected import connected


def sewn_vertices(scene: Scene) -> IntArray:
    """Return the vertex of each corner, one for all at the same place where that closes a surface.

    Parameters
    ----------
    scene : Scene
        Vertices of different objects stay apart, and those of surfaces that stay open: what meets there may be walls
        that have light on other sides.

    Returns
    -------
    ndarray of shape (c,)
        Numbers as in `Scene.corner_vertex`.
    """
    place = places(scene.vertices)
    if np.array_equal(place, np.arange(len(place))):
        return scene.corner_vertex
    vertex = place[scene.corner_vertex]
    face = scene.corner_face
    # Which faces hang together by edges of places, and whether each of those has two sides to it.
    start, end = vertex, vertex[scene.following_corner]
    edge = np.flatnonzero(scene.live[face] & (start != end))
    low, high = np.minimum(start, end)[edge], np.maximum(start, end)[edge]
    of = scene.face_object[face[edge]]
    order = np.lexsort((high, low, of))
    edge, low, high, of = edge[order], low[order], high[order], of[order]
    fresh = np.append(True, (low[1:] != low[:-1]) | (high[1:] != high[:-1]) | (of[1:] != of[:-1]))[: len(edge)]
    run = np.cumsum(fresh) - 1
    first = np.flatnonzero(fresh)
    owner = face[edge]
    label = connected(owner, owner[first][run], len(scene.face_object))
    paired = np.bincount(run) == 2
    closed = np.ones(len(scene.face_object), dtype=np.bool_)
    closed[label[owner[~paired[run]]]] = False
    return np.where(closed[label][face], vertex, scene.corner_vertex)
