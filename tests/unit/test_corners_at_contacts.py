# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners of faces that run on into something else: the part outside is what is looked at."""

import numpy as np
import pytest

from core.hierarchy.elements import split_patches
from core.hierarchy.exposed import Shown, exposed_corners
from core.hierarchy.vantages import corner_receivers
from core.meshing import mesh
from core.refined_scene import refined_scene
from core.refinement import refine
from core.scene import Scene
from core.visibility import scene_occluders
from tests.unit.blockers import box, scene_of

UP = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


def corners(light, things, longest, quality="preview"):
    """Light closed boxes and one sheet at the end, all cut finer; return places and light at the corners of each."""
    coarse = scene_of(things, 40.0)
    scene = refined_scene(coarse, refine(coarse, longest))
    result = light(scene, "hierarchical", quality=quality)
    owner = scene.face_object[scene.corner_face]
    place, normal = scene.vertices[scene.corner_vertex], scene.face_normal[scene.corner_face]
    shown = result.corner_radiance.mean(axis=1)
    return [(place[owner == k], normal[owner == k], shown[owner == k]) for k in range(len(things))]


def test_a_wall_that_runs_past_the_end_of_another(light):
    """Two thick walls in a corner between floor and ceiling: the one ends at the side of the other, which goes on."""
    slabs = [box((-0.2, -0.2, -0.2), (2, 2, 0)), box((-0.2, -0.2, 1), (2, 2, 1.2))]
    walls = [box((-0.2, -0.2, 0), (0, 2, 1)), box((0, -0.2, 0), (2, 0, 1)), box((2, -0.2, 0), (2.2, 2, 1))]
    lamp = [0.3 * UP[::-1] + (0.9, 0.9, 0.95)]
    place, normal, shown = corners(light, [*slabs, *walls, lamp], 0.075)[2]
    there = (normal[:, 0] > 0.9) & (place[:, 2] > 0.1) & (place[:, 2] < 0.9)
    y = np.unique(np.round(place[there, 1], 6))
    sunk, beside = y[y < 0][-1], y[y > 0][0]
    assert -0.075 < sunk < 0 < beside < 0.075
    for z in np.unique(np.round(place[there, 2], 6)):
        at = there & (np.abs(place[:, 2] - z) < 1e-5)
        inside, outside = (shown[at & (np.abs(place[:, 1] - where) < 1e-5)].mean() for where in (sunk, beside))
        assert inside == pytest.approx(outside, rel=0.25)


def test_receivers_move_to_what_shows():
    """A shelf's lid is in line with the edge of two faces of a wall, of which the lower one is behind the shelf."""
    scene = Scene.from_polygons([UP, UP + (0, 1, 0)])
    line = np.flatnonzero(np.abs(scene.vertices[scene.corner_vertex, 1] - 1) < 1e-9)
    for shows, way in (((1, 0), -1), ((0, 1), 1), ((1, 1), 0), ((0, 0), 0)):
        found = corner_receivers(scene, np.repeat(np.array(shows, float), 4))
        moved = found.point[found.group[line], 1] - 1
        np.testing.assert_array_equal(np.sign(np.round(moved, 9)), way)


def test_exposed_corners():
    """Of the two faces of a floor one is half under a box that stands on it, the other one is clear."""
    floor = [2.0 * UP, 2.0 * UP + (0, 2, 0)]
    scene = Scene.from_polygons([*floor, *box((0, 0, 0), (2, 1, 1))], 0.5, 1.0)
    patches = mesh(scene)
    elements = split_patches(patches, scene_occluders(scene, patches), tolerance=1e-3, size=1.0)
    exposed = elements.centre[:, 1] > 1.0
    nothing = np.zeros((len(elements), 3))
    share = exposed_corners(Shown(exposed, nothing, nothing, nothing), elements, patches, len(scene.corner_vertex))
    np.testing.assert_allclose(share[:8], np.repeat((0.5, 1.0), 4))


def test_the_ground_around_a_house_that_a_roof_is_pushed_into(light):
    """The ground under the house sees the roof's underside, which is lit at the eaves; so it is not told as covered."""
    ground = [12.0 * UP - (6, 6, 0)]
    house, roof = box((-2, -2, 0), (2, 2, 2)), box((-2.5, -2.5, 1.9), (2.5, 2.5, 2.2))
    lamp = [4.0 * UP[::-1] + (-2, -6, 5)]
    place, _, shown = corners(light, [ground, house, roof, lamp], 0.75)[0]
    row = np.abs(place[:, 0]) < 1.0
    y = np.unique(np.round(place[row, 1], 6))
    sunk, beside = y[y > -2][0], y[y < -2][-1]
    assert sunk < -1.2
    inside, outside = (shown[row & (np.abs(place[:, 1] - where) < 1e-5)] for where in (sunk, beside))
    assert inside.min() > 0.5 * outside.mean() > 0
    assert shown[row & (np.abs(place[:, 1]) < 0.5)].max() < 0.01 * outside.mean()
