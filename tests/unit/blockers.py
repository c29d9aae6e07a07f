# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that block, for tests of who sees whom."""

import numpy as np

from core.meshing import mesh
from core.occlusion.blender_tree import BVHOccluders
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.streams import StreamOccluders
from core.occlusion.surfaces import Occluding, occluder_polygons
from core.scene import AUTO, Scene
from core.visibility import SurfaceOccluders

TURN = np.array([[2, 1, 2], [-2, 2, 1], [-1, -2, 2]]) / 3


def soup(corners):
    """Return loose triangles (t, 3, 3)."""
    corners = np.asarray(corners, dtype=float)
    return Occluding(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), np.arange(len(corners)))


def halves(quads):
    """Return quads (q, 4, 3) as pairs of triangles, not joined."""
    quads = np.asarray(quads, dtype=float)
    index = np.arange(4 * len(quads)).reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return Occluding(quads.reshape(-1, 3), index, np.repeat(np.arange(len(quads)), 2))


def joined(polygons, **options):
    scene = Scene.from_polygons(polygons)
    return occluder_polygons(scene, mesh(scene, **options))


def box(low, high):
    """Return six quads that face outwards."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return (np.array(low) + (np.array(high) - low) * corners)[faces].astype(float)


def grid(mask, height=0.0):
    """Return the unit squares of a mask as quads."""
    corner = np.argwhere(mask)[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    return np.concatenate([corner, np.full((*corner.shape[:2], 1), height)], axis=2)


def sphere(n):
    """Return the faces of a unit sphere as quads, those at the poles with a double corner left out, facing outwards."""
    theta, phi = np.linspace(0, np.pi, n + 1)[:, None], np.linspace(0, 2 * np.pi, 2 * n + 1)[None]
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=2)
    quads = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2)
    return quads[1:-1].reshape(-1, 4, 3)


def runs_along(corners, origins, targets):
    """Return which segments lie in the plane of a triangle."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    heights = [np.abs(((ends[:, None] - corners[:, 0]) * normal).sum(axis=2)) for ends in (origins, targets)]
    return (np.maximum(*heights) < 1e-4).any(axis=1)


def everything(scene):
    """Return all occluders that can be had here."""
    found = [BruteForceOccluders(scene), StreamOccluders(scene), SurfaceOccluders(scene)]
    try:
        import bpy  # noqa: F401
    except ModuleNotFoundError:
        return found
    return [*found, BVHOccluders(scene)]


def scene_of(things, emission):
    """Return things, lists of polygons each, as objects of a scene of reflectance 1/2; the last one shines."""
    polygons = [face for thing in things for face in thing]
    of = np.repeat(np.arange(len(things)), [len(thing) for thing in things])
    return Scene.from_polygons(
        polygons,
        0.5,
        np.where(of[:, None] == len(things) - 1, emission, 0.0) * np.ones(3),
        sides=np.full(len(of), AUTO),
        face_object=of,
        object_names=[f"Thing {index}" for index in range(len(things))],
    )
