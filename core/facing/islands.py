# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands: the faces of an object that hang together by their vertices, or close a surface at the same places."""

import numpy as np

from ..arrays import IntArray
from ..scene import Scene
from .connected import connected
from .seams import sewn_vertices


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
    key = scene.face_object[face] * max(1, len(scene.vertices)) + sewn_vertices(scene)
    vertex = np.unique(key, return_inverse=True)[1].reshape(-1)
    first = vertex[scene.face_start[:-1]]
    label = connected(vertex, first[face], int(np.max(vertex, initial=-1)) + 1)
    return np.asarray(np.unique(label[first], return_inverse=True)[1]).reshape(-1)
