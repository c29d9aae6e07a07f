# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene whose faces are cut finer, so that light is known at the corners of its patches, too."""

from dataclasses import replace

import numpy as np

from .arrays import FloatArray, IntArray
from .paint.paint import Paint, plain_paint
from .refinement import Refinement
from .scene import Scene


def refined_scene(scene: Scene, fine: Refinement) -> Scene:
    """Return a scene with the faces of a refinement of it.

    Parameters
    ----------
    scene : Scene
    fine : Refinement
        From `refine`.

    Returns
    -------
    Scene
        Every face does with light what the one does that it is a part of; nothing asks for further cuts.
    """
    face = fine.face
    # A normal that cancels out to nothing is left to the face.
    normals = np.einsum("ck,ckx->cx", fine.corner_weight, scene.corner_normals[fine.corner_source])
    plain = replace(
        scene,
        vertices=fine.vertices,
        corner_vertex=fine.corner_vertex,
        face_start=fine.face_start,
        reflectance=scene.reflectance[face],
        emission=scene.emission[face],
        transmittance=scene.transmittance[face],
        corner_normals=normals,
        face_object=scene.face_object[face],
        sides=scene.sides[face],
        divisions=np.ones(len(face), dtype=np.int64),
        max_edge=np.full(len(face), np.nan),
        occludes=scene.occludes[face],
        shades=scene.shades[face],
        tint=scene.tint[face],
        ior=scene.ior[face],
        reflects=scene.reflects[face],
        emits=scene.emits[face],
        paint=None,
    )
    return plain if scene.paint is None else _painted(scene.paint, plain, fine)


def _painted(paint: Paint, scene: Scene, fine: Refinement) -> Scene:
    """Give the finer faces of a scene, and their corners, what is on the coarse ones there."""
    position = scene.vertices[scene.corner_vertex]
    size = np.diff(scene.face_start)
    # Faces that were left whole keep their own mean and corners.
    parted = (np.bincount(fine.face)[fine.face] > 1) & (size <= 4)
    start = scene.face_start[:-1][parted]
    quad = position[start[:, None] + np.minimum(np.arange(4), size[parted, None] - 1)]
    reflectance, emission = scene.reflectance.copy(), scene.emission.copy()
    known, reflected, emitted = paint.means(quad, fine.face[parted])
    for values, seen in ((reflectance, reflected), (emission, emitted)):
        cut = np.flatnonzero(parted)[known]
        bright = values[cut].any(axis=1)
        values[cut[bright]] = seen[known][bright]

    corner = [
        np.einsum("ck,ckx->cx", fine.corner_weight, values[fine.corner_source])
        for values in (paint.corner_reflectance, paint.corner_emission)
    ]
    at = np.flatnonzero(parted[scene.corner_face])
    known, reflected, emitted = paint.means(_around(scene, position)[at], fine.face[scene.corner_face[at]])
    # The same for all corners at a point of a coarse face: that face does not end there.
    at, same = at[known], _shared(fine, scene.corner_face, at[known])
    for values, seen in zip(corner, (reflected[known], emitted[known]), strict=True):
        count = np.bincount(same)[:, None]
        mean = np.stack([np.bincount(same, channel) for channel in seen.T], axis=1) / np.maximum(count, 1)
        bright = values[at].any(axis=1)
        values[at[bright]] = mean[same][bright]
    around_reflectance, around_emission = (values.astype(np.float32) for values in corner)
    finer = plain_paint(reflectance, emission, scene.corner_face)
    finer = replace(finer, corner_reflectance=around_reflectance, corner_emission=around_emission)
    return replace(scene, reflectance=reflectance, emission=emission, paint=finer)


def _around(scene: Scene, position: FloatArray) -> FloatArray:
    """Return the quarter of its face that is nearest to each corner, shape (c, 4, 3) [m]."""
    first, last = scene.face_start[:-1], scene.face_start[1:] - 1
    following, before = (np.arange(len(position)) + step for step in (1, -1))
    following[last], before[first] = first, last
    middle = (np.add.reduceat(position, first, axis=0) / np.diff(scene.face_start)[:, None])[scene.corner_face]
    ahead, behind = (position + position[following]) / 2, (position + position[before]) / 2
    return np.stack([position, ahead, middle, behind], axis=1)


def _shared(fine: Refinement, corner_face: IntArray, corners: IntArray) -> IntArray:
    """Return a number for some corners that those at one vertex of one coarse face share."""
    key = fine.face[corner_face[corners]] * len(fine.vertices) + fine.corner_vertex[corners]
    return np.asarray(np.unique(key, return_inverse=True)[1]).reshape(-1)
