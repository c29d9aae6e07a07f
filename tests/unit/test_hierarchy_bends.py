# SPDX-License-Identifier: GPL-3.0-or-later
"""Bends: what arrives at the vertices of coarse meshes that are shaded smooth."""

from dataclasses import replace

import numpy as np
import pytest

from core.bake import bake
from core.hierarchy.bends import find_bends
from core.hierarchy.vantages import corner_receivers
from core.lighting.lamps import SkyLamp
from core.progress import exhaust
from core.refined_scene import refined_scene
from core.refinement import refine
from core.scene import Scene
from core.settings import Settings
from tests.at_once import AtOnce

# Of what comes from everywhere alike, this arrives at the corner of a cube: each face looks at a half space but a lune.
CORNER = 0.5 * (1 + 1 / np.sqrt(3))


def smooth_cube(others, emission, box, bright=0.0):
    """Return a scene of some quads and a grey cube shaded smooth, whose corners are the last 24; or all are bright."""
    low, size = 0.4, 0.2
    polygons = [*others, *box((size, size, size), (low, low, low), inward=False)]
    flat = Scene.from_polygons(polygons, 0.5, np.zeros(3))
    normals = np.array(flat.corner_normals)
    away = flat.vertices[flat.corner_vertex[-24:]] - (low + size / 2)
    normals[-24:] = away / np.linalg.norm(away, axis=1, keepdims=True)
    glowing = np.zeros((len(polygons), 3))
    glowing[: len(others)] = emission
    rho = np.zeros((len(polygons), 3))
    rho[-6:] = 0.5
    if bright:
        rho[:], glowing[:] = bright, emission
    return Scene(flat.vertices, flat.corner_vertex, flat.face_start, rho, glowing, corner_normals=normals)


def corners(scene):
    result = exhaust(bake(scene, Settings(quality="medium"), executor=AtOnce()))
    return (result.corner_radiance[-24:, 0] * np.pi - scene.emission[-1, 0]) / scene.reflectance[-1, 0]


def test_flat_faces_are_not_bent_and_corners_of_a_smooth_cube_are(box):
    scene = smooth_cube(box(), 1.0, box)
    receivers = corner_receivers(scene)
    bends = find_bends(scene, receivers.normal, receivers.group)
    assert np.array_equal(bends.bent[receivers.group], np.arange(48) >= 24)
    some = np.array([receivers.group[-1], receivers.group[0]])
    assert (np.diff(bends.pick(some).first) == np.diff(bends.first)[some]).all()
    assert bends.pick(some).normal[-1] == pytest.approx(bends.normal[bends.first[some[1]]])


def test_corners_of_a_smooth_cube_look_over_the_horizons_of_their_faces(box):
    """In a furnace, where a tenth of all light is emitted and the rest has bounced."""
    found = corners(smooth_cube(box(), 1.0, box, bright=0.9))
    assert found == pytest.approx(np.full(24, 1 + 9 * CORNER), rel=0.03)


def test_a_lamp_is_seen_from_all_above_the_normal_of_a_corner(box):
    """It stands below the horizons of two of the three faces there, and nothing hides it from the vertex."""
    corner, at = np.full(3, 0.6), np.array([2.1, 0.4, 0.4])
    side = 0.05 * np.array([(0, -1, -1), (0, -1, 1), (0, 1, 1), (0, 1, -1)])
    scene = smooth_cube([at + side], 1000.0, box)
    to = at - corner
    squared = to @ to
    expected = 1000 * 0.01 * (to.sum() / np.sqrt(3)) * to[0] / (np.pi * squared**2)
    there = np.abs(scene.vertices[scene.corner_vertex[-24:]] - corner).max(axis=1) < 1e-9
    assert corners(scene)[there] == pytest.approx(np.full(3, expected), rel=0.03)


@pytest.mark.parametrize("slant", [0.0, 0.9])
def test_a_smooth_cube_in_the_open_has_the_sky_above_its_faces_and_nothing_else(box, slant):
    """Brighter upwards or the same all over; what the cube's own faces send meets none of them."""
    rows = 64
    height = np.sin(np.pi * ((np.arange(rows) + 0.5) / rows - 0.5))
    sky = SkyLamp("World", np.broadcast_to(1 + slant * height[:, None, None], (rows, 2 * rows, 3)).copy())
    coarse = replace(smooth_cube([], 0.0, box), lamps=(sky,))
    scene = refined_scene(coarse, refine(coarse, subdivide=4))
    result = exhaust(bake(scene, Settings(quality="medium"), executor=AtOnce()))
    at, normal = scene.vertices[scene.corner_vertex], scene.corner_normals
    way = np.random.default_rng(0).normal(size=(100_000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    faces = coarse.face_normal
    expected = []
    for place, up in zip(at, normal, strict=True):
        mine = faces[np.abs(faces @ (place - 0.5) - 0.1) < 1e-9]
        open_to = (way @ mine.T > 0).mean(axis=1)
        expected.append(4 * np.pi * np.mean((1 + slant * way[:, 2]) * np.maximum(way @ up, 0) * open_to))
    found = result.corner_irradiance[:, 0]
    assert np.sqrt(np.mean((found / expected - 1) ** 2)) < 0.02
    np.testing.assert_allclose(found, expected, rtol=0.06)
