# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that nothing can be behind are not asked whether they block."""

import numpy as np

from core.meshing import mesh
from core.occlusion.surfaces import never_block, occluder_polygons
from core.scene import Scene


def box(low, high):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return (np.array(low) + (np.array(high) - low) * corners)[faces].astype(float)


def test_walls_of_a_room_never_block():
    scene = Scene.from_polygons([*box([0, 0, 0], [4, 3, 2]), *box([1, 1, 0], [2, 2, 1])])
    found = occluder_polygons(scene, mesh(scene))
    never = never_block(found.vertices, found.triangles, 1e-6)
    # The bottom of the block stands on the floor: it is of the floor's plane.
    assert set(found.triangle_face[never]) == {0, 1, 2, 3, 4, 5, 10}
    assert set(found.triangle_face[~never]) == {6, 7, 8, 9, 11}


def test_of_many_triangles_the_largest_are_looked_at():
    vertices = np.random.default_rng(3).normal(size=(30_000, 3))
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    wall = np.array([[-9, -9, -2], [9, -9, -2], [0, 18, -2]])
    small = np.stack([np.arange(3000), np.arange(3000) + 3000, np.arange(3000) + 6000], axis=1)
    triangles = np.concatenate([small, [[30_000, 30_001, 30_002]]])
    never = never_block(np.concatenate([vertices, wall]), triangles, 1e-6)
    assert never[-1]
    assert not never[:-1].any()
    assert len(never_block(np.zeros((0, 3)), np.zeros((0, 3), int), 1e-6)) == 0
