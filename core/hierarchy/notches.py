# SPDX-License-Identifier: GPL-3.0-or-later
"""Notches: where a flat stretch runs round the edge of what stands on it, as the floor round the corner of a wall.

Right there the light depends on the side that one comes from, since the wall hides other things on each. So there is a
receiver on every face, which is what those beside it look at; the vertex shows the mean.
"""

import numpy as np

from ..scene import Scene
from ..shading import corner_angles, shown_face_normals, shown_normals
from .glances import Corners
from .tree import Float, Int
from .vectors import dots

# Angles of the faces at a vertex between which they are no half plane, as at an edge, and no whole one [rad].
_LEAST, _MOST = np.radians(200.0), np.radians(340.0)
# Least cosine between the normals of flat faces and of the corner.
_FLAT = 0.999


def parted(scene: Scene, group: Int) -> Int:
    """Part the groups of corners at notches face by face.

    Parameters
    ----------
    scene : Scene
    group : ndarray of shape (c,)
        What is to look alike, from 0 up without gaps.

    Returns
    -------
    ndarray of shape (c,)
        From 0 up without gaps; the same where there is no notch.
    """
    if not len(group):
        return group
    around = np.bincount(group, corner_angles(scene))
    notch = (around > _LEAST) & (around < _MOST)
    corner = np.flatnonzero(notch[group])
    bent = dots(shown_face_normals(scene)[scene.corner_face[corner]], shown_normals(scene)[corner]) < _FLAT
    notch[group[corner[bent]]] = False
    notched = notch[group]
    if not notched.any():
        return group
    finer = group.copy()
    finer[notched] = len(around) + np.arange(np.count_nonzero(notched))
    return np.asarray(np.unique(finer, return_inverse=True)[1]).reshape(-1)


def at_corners(scene: Scene, corners: Corners, values: Float) -> Float:
    """Return what each corner of a scene shows of its receiver's values, at notches the mean by the faces' angles.

    Parameters
    ----------
    scene : Scene
    corners : Corners
        Its receivers.
    values : ndarray of shape (q, k)

    Returns
    -------
    ndarray of shape (c, k)
    """
    shown, whole = values[corners.group], corners.whole
    if whole is None:
        return shown
    angle = np.maximum(corner_angles(scene), 1e-6)
    total = np.bincount(whole, angle)
    means = np.stack([np.bincount(whole, angle * column) for column in shown.T], axis=1) / total[:, None]
    return np.asarray(means[whole])
