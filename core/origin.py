# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes far from the origin, as those with geographic coordinates are, brought to it.

A room of 6 m that stands 50 km away has its coordinates, differences of which light is computed from, with four digits
less; what is asked in single precision loses more.
"""

from dataclasses import replace

import numpy as np

from .arrays import FloatArray
from .lighting.kinds import Lamp
from .lighting.round_lamps import SunLamp
from .lighting.sky import SkyLamp
from .meshing import Patches
from .scene import Scene

# Times its size that most of a scene is away before it is moved.
_FAR = 1000.0
# Percentiles between which most of a scene is.
_MOST = (5, 50, 95)


def middle(scene: Scene) -> FloatArray:
    """Return where a scene that is far from the origin is, and the origin for all others, shape (3,) [m]."""
    if not len(scene.corner_vertex):
        return np.zeros(3)
    low, mean, high = np.percentile(scene.vertices[scene.corner_vertex], _MOST, axis=0)
    far = np.max(np.abs(mean)) > _FAR * np.max(high - low)
    return np.round(mean) if far else np.zeros(3)


def moved_scene(scene: Scene, way: FloatArray) -> Scene:
    """Return a scene somewhere else.

    Parameters
    ----------
    scene : Scene
    way : ndarray of shape (3,)
        How far it is moved [m].

    Returns
    -------
    Scene
    """
    paint = scene.paint
    if paint is not None:
        paint = paint.moved(np.eye(3), way, np.arange(len(scene.corner_vertex)))
    lamps = tuple(_moved_lamp(lamp, way) for lamp in scene.lamps)
    return replace(scene, vertices=scene.vertices + way, lamps=lamps, paint=paint)


def _moved_lamp(lamp: Lamp, way: FloatArray) -> Lamp:
    return lamp if isinstance(lamp, SunLamp | SkyLamp) else replace(lamp, centre=lamp.centre + way)


def moved_patches(patches: Patches, way: FloatArray) -> Patches:
    """Return patches somewhere else, `way` from where they were [m]."""
    corners, centre = patches.corners + way, patches.centre + way
    paint = patches.paint
    if paint is not None:
        paint = paint.moved(np.eye(3), way, np.arange(len(paint.corner_reflectance)))
    return replace(patches, corners=corners, centre=centre, paint=paint)
