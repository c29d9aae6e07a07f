# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera for scenes that have none: it looks into rooms through their open side, or through a wall."""

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ..core.scene import Scene

ANGLE = np.radians(40.0)  # of view, along the longer side of the picture
MARGIN = 1.05  # picture over subject
TILT = np.radians(30.0)  # how steeply a flat subject is looked down upon
ALIKE = 0.99  # a side whose share of the faces is this close to the best is as good


def fit_camera(
    scene: bpy.types.Scene, surfaces: Scene, up: tuple[float, float, float] = (0.0, 0.0, 1.0)
) -> bpy.types.Object:
    """Make a camera that has all surfaces in view, and make it the scene's.

    It looks along an axis, against the most faces, and what lies nearest to it is clipped: so it sees the inside of a
    closed room. Only a subject that is much flatter than wide is looked at from above.

    Parameters
    ----------
    scene : bpy.types.Scene
        Gets the camera; its picture's proportions and unit scale count.
    surfaces : core.scene.Scene
        What is to be seen [m].
    up : tuple of float
        Axis that is upwards in the picture: y or z.

    Returns
    -------
    bpy.types.Object
        The camera.
    """
    metres = 1.0 if scene.unit_settings.system == 'NONE' else scene.unit_settings.scale_length
    points = surfaces.vertices[np.unique(surfaces.corner_vertex)] / metres
    vertical = np.array(up)
    forward = _best_view(surfaces.area_vector, vertical)
    low, high = points.min(axis=0), points.max(axis=0)
    half, centre = (high - low) / 2.0, (low + high) / 2.0
    right = np.cross(forward, vertical)
    width, height, depth = (float(half @ np.abs(axis)) for axis in (right, vertical, forward))

    data = bpy.data.cameras.new("Camera")
    data.angle = ANGLE
    render = scene.render
    across = render.resolution_x * render.pixel_aspect_x
    down = render.resolution_y * render.pixel_aspect_y
    slope = np.tan(ANGLE / 2.0) / max(across, down)
    if height >= 0.5 * min(width, depth):
        # The front of the box around the subject fills the picture, and a wall there is clipped.
        distance = depth + MARGIN * max(width / (slope * across), height / (slope * down))
        data.clip_start = max(distance - 0.99 * depth, 1e-4)
    else:
        radius = float(np.linalg.norm(half))
        forward, vertical = (
            np.cos(TILT) * forward - np.sin(TILT) * vertical,
            np.cos(TILT) * vertical + np.sin(TILT) * forward,
        )
        distance = MARGIN * radius / np.sin(np.arctan(slope * min(across, down)))
        data.clip_start = max((distance - radius) / 2.0, 1e-4)
    data.clip_end = 2.0 * (distance + depth + width)

    camera = bpy.data.objects.new("Camera", data)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, vertical, -forward], axis=1)  # a camera looks along its own -z
    matrix[:3, 3] = centre - distance * forward
    camera.matrix_world = Matrix(matrix.tolist())
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def _best_view(area_vector: NDArray[np.float64], vertical: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the horizontal axis along which one sees the most area of faces from their front."""
    ahead = np.array([0.0, 1.0, 0.0]) if vertical[2] else np.array([0.0, 0.0, -1.0])
    aside = np.cross(ahead, vertical)
    directions = (ahead, -ahead, aside, -aside)
    seen = [float(np.maximum(-area_vector @ direction, 0.0).sum()) for direction in directions]
    return next(axis for axis, area in zip(directions, seen, strict=True) if area >= ALIKE * max(seen))
