# SPDX-License-Identifier: GPL-3.0-or-later
"""What colours at corners cannot show, told in a line for each object.

A corner has one value: a wall that is a single sheet between a bright room and a dark one looks alike from both. And
between corners there is nothing: a patch of sun in the middle of a floor of one face does not show.
"""

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .meshing import Patches
from .scene import BOTH, Scene
from .shading import corner_angles
from .visibility import Surroundings

# Sides that differ less look like the same surface.
_APART = 3.0
# Less than this share of the light that is common in the scene is as good as none.
_DARK = 0.05
# The back of what stands before nothing but the sky, as of the ground, is not looked at.
_SEEN = 0.5
# Gaps behind a surface narrower than this share of its width are not looked into.
_ROOM = 0.25
# Share of an object's area, and of the light that objects have on the mean, below which it is not worth a line.
_WORTH = 0.1
# Share of an object's light that its corners may lose or add.
_MISSED = 0.3
# Small faces of no more patches have even light: what corners tell otherwise is finer than what patches share.
_EVEN = 2
# A face is small if it is less than this share of its object.
_SMALL = 1 / 16


def differing_sides(
    scene: Scene, patches: Patches, radiosity: FloatArray, row_sums: FloatArray, occluders: Surroundings
) -> list[str]:
    """Tell which objects are lit on both sides, and much more on one.

    Parameters
    ----------
    scene : Scene
        With sides that are decided.
    patches : Patches
    radiosity : ndarray of shape (p, 3)
        What each patch sends out [W/m^2].
    row_sums : ndarray of shape (p,)
        Share of each patch's view that surfaces fill; NaN where not known.
    occluders : Surroundings
        Tell how much room there is behind surfaces.

    Returns
    -------
    list of str
        A line for each object that such faces are a good part of.
    """
    both = (scene.sides == BOTH) & scene.live
    if not both.any():
        return []
    light, front, back = radiosity.mean(axis=1), patches.side > 0, patches.side < 0
    common = float(np.average(light, weights=patches.area))
    shown, hidden = (_face_means(scene, patches, light, side) for side in (front, back))
    enclosed = _face_means(scene, patches, np.nan_to_num(row_sums), back) > _SEEN
    darker = enclosed & (shown > _APART * hidden) & (hidden > _DARK * common)
    apart = both & ((hidden > _APART * np.maximum(shown, _DARK * common)) | darker)
    apart[apart] = _room_behind(scene, np.flatnonzero(apart), occluders)
    worth = _sums(scene, scene.face_area * apart) > _WORTH * _sums(scene, scene.face_area)
    what = (
        f"its sides differ in light by {_APART:g} times and more; the colors show the front only (give walls a "
        "thickness with Solidify, or choose Sides: Back)"
    )
    return _told(scene, worth, what)


def light_between_corners(
    scene: Scene, patches: Patches, irradiance: FloatArray, corner_irradiance: FloatArray
) -> list[str]:
    """Tell which objects have faces that are too large for the light on them.

    Parameters
    ----------
    scene : Scene
        With sides that are decided.
    patches : Patches
    irradiance : ndarray of shape (p, 3)
        What arrives at each patch [W/m^2].
    corner_irradiance : ndarray of shape (c, 3)
        What arrives at each corner [W/m^2].

    Returns
    -------
    list of str
        A line for each object whose corners show much more or much less light than there is, if it has a good part of
        what objects have on the mean: a house is little beside the land around it, and is what one looks at.
    """
    there, seen = light_on_faces(scene, patches, irradiance, corner_irradiance)
    # What lamps receive is little beside what they emit.
    reflected = scene.face_area * scene.reflectance.mean(axis=1)
    power = _sums(scene, reflected * there + scene.face_area * scene.emission.mean(axis=1))
    missed = _sums(scene, reflected * np.abs(seen - there) * _large(scene, patches))
    worth = (missed > _MISSED * power) & (power > _WORTH * power.mean())
    what = (
        "its faces are too large to show the light between their corners (subdivide it, or bake a copy with small "
        "patches)"
    )
    return _told(scene, worth, what)


def light_on_faces(
    scene: Scene, patches: Patches, irradiance: FloatArray, corner_irradiance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the light on the side that each face shows, and what of it its corners tell.

    Parameters
    ----------
    scene, patches, irradiance, corner_irradiance
        See `light_between_corners`.

    Returns
    -------
    there, seen : ndarray of shape (f,)
        Means over the patches, and over the corners by their angles [W/m^2]; the same for faces without patches, such
        as doubled ones.
    """
    count = len(scene.face_area)
    front = patches.side > 0
    shown = front | (np.bincount(patches.face[front], minlength=count) == 0)[patches.face]
    there = _face_means(scene, patches, irradiance.mean(axis=1), shown)
    angle = corner_angles(scene)
    weighted = np.bincount(scene.corner_face, angle * corner_irradiance.mean(axis=1), count)
    angles = np.bincount(scene.corner_face, angle, count)
    seen = np.divide(weighted, angles, out=there.copy(), where=angles > 0)
    return np.where(np.bincount(patches.face, minlength=count) > 0, there, seen), seen


def _large(scene: Scene, patches: Patches) -> BoolArray:
    """Tell which faces are a good part of their object, or had to be cut for the light on them."""
    count = len(scene.face_area)
    # A bent quad is two patches anyway.
    front, back = (np.bincount(patches.face[side], minlength=count) for side in (patches.side > 0, patches.side < 0))
    of_object = _sums(scene, scene.face_area)[scene.face_object]
    return np.asarray((np.maximum(front, back) > _EVEN) | (scene.face_area > _SMALL * of_object))


def _room_behind(scene: Scene, faces: IntArray, occluders: Surroundings) -> BoolArray:
    """Tell behind which faces somebody may stand: behind a picture on a wall it is dark, and nobody sees it."""
    corner, size = scene.vertices[scene.corner_vertex], np.diff(scene.face_start)
    middle = np.add.reduceat(corner, scene.face_start[:-1])[faces] / size[faces, None]
    _, distance, _ = occluders.nearest(middle, -scene.face_normal[faces])
    width = np.sqrt(_sums(scene, scene.face_area))[scene.face_object[faces]]
    return np.asarray(distance > _ROOM * width)


def _face_means(scene: Scene, patches: Patches, values: FloatArray, chosen: BoolArray) -> FloatArray:
    """Return the mean over the chosen patches of each face, shape (f,); 0 where there are none."""
    face, area, count = patches.face[chosen], patches.area[chosen], len(scene.face_area)
    weight = np.bincount(face, area, count)
    total = np.bincount(face, area * values[chosen], count)
    return np.asarray(np.divide(total, weight, out=np.zeros(count), where=weight > 0))


def _sums(scene: Scene, values: FloatArray) -> FloatArray:
    """Return the sum over the faces of each object."""
    return np.bincount(scene.face_object, values, len(scene.object_names))


def _told(scene: Scene, worth: BoolArray, what: str) -> list[str]:
    """Return a line for each object that is worth one."""
    return [f"Object '{scene.object_names[index]}': {what}" for index in np.flatnonzero(worth)]
