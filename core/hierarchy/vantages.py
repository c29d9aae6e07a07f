# SPDX-License-Identifier: GPL-3.0-or-later
"""Vantage points: where the receivers stand that look for the corners of a mesh."""

import numpy as np
from numpy.typing import NDArray

from ..scene import BOTH, Scene
from ..shading import corner_angles, shown_face_normals, shown_normals, smooth_groups
from ..visibility import Occluders
from .glances import Corners
from .notches import parted
from .tree import Float, Int
from .vectors import dots

# How far a corner's receiver moves into its faces, as a share of the way to their middle: off the edge, where the faces
# next door would be seen edge on.
_INSET = 0.01
# Receivers are raised above their own faces by so many times what it takes, reckoned with at least this cosine between
# the normals.
_CLEAR, _SLANTING = 1.05, 0.2
# Receivers are turned to what shows of their faces where the cosine to it is less: a column's foot, not a ball's.
_PAST = 0.85
# How far off a face it is asked whether a receiver is parted from it, as a share of the way to its middle.
_OFF = 1e-3
# Weight of hidden elements beside that of exposed ones.
LAST_RESORT = 1e-9


def corner_receivers(scene: Scene, exposed: Float | None = None) -> Corners:
    """Return one receiver for each vertex and smooth group of a scene, and for each face at notches.

    Parameters
    ----------
    scene : Scene
    exposed : ndarray of shape (c,), optional
        Share that shows of what is at each of its corners: receivers move there. Everything when not given.

    Returns
    -------
    Corners
    """
    face = scene.corner_face
    whole = smooth_groups(scene)
    group = parted(scene, whole)
    position = scene.vertices[scene.corner_vertex]
    inwards = _middles(scene)[face] - position
    weight = np.ones(len(group)) if exposed is None else exposed + LAST_RESORT
    total = np.bincount(group, weight)
    into = np.stack([np.bincount(group, weight * axis) for axis in inwards.T], axis=1) / total[:, None]
    leader = np.full(len(total), -1)
    leader[group[::-1]] = np.arange(len(group))[::-1]
    normal = shown_normals(scene)[leader]
    # Faces without area have no normal of their own; whatever light is there will do.
    normal[~normal.any(axis=1)] = (0, 0, 1)
    shows = weight > LAST_RESORT
    normal = _towards_shown(scene, normal, group, shows)
    # Along the surface, not below it: the middles of the faces round a convex corner lie inside.
    into -= (into * normal).sum(axis=1, keepdims=True) * normal
    point = position[leader] + _INSET * into
    raised = point + _lift(scene, point, normal, group, shows)[:, None] * normal
    return Corners(raised, normal, group, None if group is whole else whole)


def _middles(scene: Scene) -> Float:
    """Return the mean of each face's corners, shape (f, 3) [m]."""
    if not len(scene.face_normal):
        return np.zeros((0, 3))
    position = scene.vertices[scene.corner_vertex]
    sums: Float = np.add.reduceat(position, scene.face_start[:-1], axis=0)
    return sums / np.maximum(np.diff(scene.face_start), 1)[:, None]


def _towards_shown(scene: Scene, normal: Float, group: Int, shows: NDArray[np.bool_]) -> Float:
    """Turn receivers that look past what shows of their faces to it, as smooth ones round the foot of a column do."""
    mixed = (np.bincount(group, shows, len(normal)) > 0) & (np.bincount(group, ~shows, len(normal)) > 0)
    if not mixed.any():
        return normal
    corner = np.flatnonzero(mixed[group] & shows)
    own = corner_angles(scene)[corner, None] * shown_face_normals(scene)[scene.corner_face[corner]]
    sums = np.stack([np.bincount(group[corner], axis, len(normal)) for axis in own.T], axis=1)
    length = np.sqrt(dots(sums, sums))
    past = (length > 0) & (dots(sums, normal) < _PAST * length)
    return np.where(past[:, None], sums / np.maximum(length, 1e-300)[:, None], normal)


def _lift(scene: Scene, point: Float, normal: Float, group: Int, shows: NDArray[np.bool_]) -> Float:
    """Return how far to raise receivers along their normals to stand above all of their own faces, shape (q,) [m].

    Where a smooth surface is hollow and its faces differ in size, the plane across the normal runs behind some of them.
    Some corners of a bent face are behind it: where its back has light, too, they would look at that from inside.
    Above the bottom of what stands on a floor, it would be under the floor: hidden faces do not count beside others.
    """
    face = scene.corner_face
    own = shown_face_normals(scene)[face]
    behind = -((point[group] - scene.vertices[scene.corner_vertex]) * own).sum(axis=1)
    inside = -((point[group] - _middles(scene)[face]) * own).sum(axis=1)
    behind = np.where(scene.sides[face] == BOTH, np.maximum(behind, inside), behind)
    needed = behind / np.maximum((normal[group] * own).sum(axis=1), _SLANTING)
    needed[~shows & (np.bincount(group, shows, len(point)) > 0)[group]] = 0.0
    order = np.argsort(group, kind="stable")
    begin = np.searchsorted(group[order], np.arange(len(point)))
    return np.asarray(_CLEAR * np.maximum(np.maximum.reduceat(needed[order], begin), 0))


def cut_off(scene: Scene, corners: Corners, alone: NDArray[np.bool_], occluders: Occluders) -> NDArray[np.bool_]:
    """Return which of some receivers other geometry parts from a face of theirs, shape (q,).

    A corner that reaches out of a room through its floor sees nothing out there; what shows of its face is inside.
    """
    cut = np.zeros(len(alone), dtype=np.bool_)
    corner = np.flatnonzero(alone[corners.group])
    face, group = scene.corner_face[corner], corners.group[corner]
    # As high over the face there as the receiver is.
    shown, end = shown_face_normals(scene)[face], _middles(scene)[face]
    end = end + ((corners.point[group] - end) * shown).sum(axis=1)[:, None] * shown
    # Off the face: where that is bent, the receiver stands on it.
    start = corners.point[group]
    off = _OFF * np.sqrt(((end - start) ** 2).sum(axis=1))[:, None] * shown
    cut[group[occluders.blocked(start + off, end + off)]] = True
    return cut
