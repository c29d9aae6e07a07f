# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps and points that they light, with closed forms to compare with."""

import numpy as np

from core.lighting.lamps import AreaLamp, PointLamp, SunLamp, lamp_irradiance, scene_reach
from core.meshing import mesh
from core.scene import Scene
from core.visibility import scene_occluders

WHITE, UP = np.ones(3), np.array((0.0, 0.0, 1.0))
COLOUR = np.array((3.0, 2.0, 1.0))
DOWN = -UP
SQUARE = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)


class Nothing:
    """Occluders that block nothing."""

    def blocked(self, origins, targets):
        return np.zeros(len(origins), bool)


def lit(lamp, points, normals=None, polygons=(), rays=16):
    """Return the irradiance of points among polygons, red only."""
    points = np.atleast_2d(np.asarray(points, float))
    normals = np.broadcast_to(UP if normals is None else normals, points.shape).astype(float)
    occluders, reach = Nothing(), 1e3
    if len(polygons):
        scene = Scene.from_polygons(polygons)
        occluders, reach = scene_occluders(scene, mesh(scene)), scene_reach(scene)
    return lamp_irradiance([lamp], points, normals, occluders, rays=rays, reach=reach)[:, 0]


def disc(radius=0.5, height=2.0, **fields):
    u, v = np.array((radius, 0, 0)), np.array((0, radius, 0))
    return AreaLamp("disc", WHITE, height * UP, u, v, DOWN, ellipse=True, **fields)


def averaged(lamp, point, normal, side=400):
    """Return what the lamp's samples say, as their mean over a fine grid: directions, light, 1 for all that counts."""
    u, v = (grid.reshape(-1) for grid in (np.indices((side, side)) + 0.5) / side)
    point, normal = (np.broadcast_to(np.asarray(a, float), (len(u), 3)) for a in (point, normal))
    return lamp.sample(point, normal, u, v)


LAMPS = {
    "point": PointLamp("point", WHITE, 2 * UP),
    "ball": PointLamp("ball", WHITE, 2 * UP, radius=0.3),
    "turning disc": PointLamp("disc", WHITE, 2 * UP, radius=0.3, soft=True),
    "sun": SunLamp("sun", WHITE, UP, 0.3),
    "disc": disc(0.3),
    "softbox": disc(0.3, spread=2.0),
}
