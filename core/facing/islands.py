# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands: the faces of an object that hang together by their vertices."""

import numpy as np

from ..arrays import IntArray
from ..scene import Scene


def islands(scene: Scene) -> IntArray:
    """Return which island each face belongs to.

    Parameters
    ----------
    scene : Scene
        Faces of different objects do not hang together, wherever they are.

    Returns
    -------
    ndarray of shape (f,)
        From 0 up, without gaps.
    """
    face = scene.corner_face
    key = scene.face_object[face] * max(1, len(scene.vertices)) + scene.corner_vertex
    vertex = np.unique(key, return_inverse=True)[1].reshape(-1)
    first = vertex[scene.face_start[:-1]]
    label = connected(vertex, first[face], int(np.max(vertex, initial=-1)) + 1)
    return np.asarray(np.unique(label[first], return_inverse=True)[1]).reshape(-1)


def connected(one: IntArray, other: IntArray, count: int) -> IntArray:
    """Return for each of so many nodes the least one that it is connected to by edges.

    Trees that know only their root hook on to the least neighbour of any of their nodes, until none has neighbours:
    a few rounds, whatever the shape (Shiloach, Vishkin 1982).
    """
    root = np.arange(count)
    while True:
        one, other = root[one], root[other]
        apart = one != other
        if not apart.any():
            return root
        one, other = one[apart], other[apart]
        low, high = np.minimum(one, other), np.maximum(one, other)
        order = np.lexsort((low, high))
        low, high = low[order], high[order]
        least = np.append(True, high[1:] != high[:-1])
        root[high[least]] = low[least]
        while True:
            above = root[root]
            if np.array_equal(above, root):
                break
            root = above
