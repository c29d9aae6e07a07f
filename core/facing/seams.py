# SPDX-License-Identifier: GPL-3.0-or-later
"""Seams: edges that one surface has twice at the same place, as text, split edges and imports do."""

import numpy as np

from ..arrays import IntArray
from ..scene import Scene
from .connected import connected

_MIXERS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)


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
    place = _places(scene)
    if place is None:
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


def _places(scene: Scene) -> IntArray | None:
    """Return the first vertex at the place of each vertex, shape (v,), or None where no two share one."""
    bits = (scene.vertices + 0.0).view(np.uint64).reshape(-1, 3)
    x, y, z = (bits * _MIXERS).T
    mixed = x ^ y ^ z
    mixed ^= mixed >> np.uint64(29)
    order = np.argsort(mixed, kind="stable")
    same = mixed[order][1:] == mixed[order][:-1]
    if not same.any():
        return None
    place = np.arange(len(order))
    begin = np.append(True, ~same)
    leader = order[np.flatnonzero(begin)][np.cumsum(begin) - 1]
    # Places that only seem to be the same stay apart.
    equal = (scene.vertices[order] == scene.vertices[leader]).all(axis=1)
    place[order[equal]] = leader[equal]
    return place
