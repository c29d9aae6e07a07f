# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners of faces that run on into something else: the part outside is what is looked at."""

from dataclasses import replace
from itertools import pairwise

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
    group = np.arange(len(scene.corner_vertex))
    shown = Shown(exposed, nothing, nothing, nothing, np.ones(len(elements)))
    share = exposed_corners(shown, elements, patches, group)
    np.testing.assert_allclose(share[:8], np.repeat((0.5, 1.0), 4))
    # Where one face of a smooth edge looks out of the scene, the other one tells.
    group[4:8] = group[:4]
    shown = replace(shown, sees=np.where(exposed, 0.0, 0.5))
    np.testing.assert_allclose(exposed_corners(shown, elements, patches, group)[:8], np.repeat((0.5, 0.0), 4))


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


def column(radius, height, slabs):
    """Return a prism of 8 sides that stands on the ground, its lid and bottom, as polygons."""
    turn = np.arange(9) * np.pi / 4
    ring = np.round(np.stack((radius * np.cos(turn), radius * np.sin(turn), 0 * turn), axis=1), 9)
    level = [ring + (0, 0, height * k / slabs) for k in range(slabs + 1)]
    sides = [np.stack((low[k], low[k + 1], high[k + 1], high[k])) for low, high in pairwise(level) for k in range(8)]
    return [*sides, ring[:8][::-1], level[-1][:8]]


@pytest.mark.parametrize("ground", ["sheet", "slab"])
def test_the_foot_of_a_smooth_column(light, ground):
    """Its bottom lies on the ground and shares the normals of the sides, which look into the ground there."""
    floor = [8.0 * UP - (4, 4, 0)] if ground == "sheet" else box((-4, -4, -0.3), (4, 4, 0))
    things = [*floor, *column(0.3, 0.8, 4), 6.0 * UP[::-1] + (-3, -3, 3)]
    owner = [0] * len(floor) + [1] * 34 + [2]
    what = {"face_object": owner, "object_names": ["ground", "column", "lamp"]}
    emission = 10.0 * (np.array(owner) == 2)[:, None] * np.ones(3)
    flat = Scene.from_polygons(things, 0.5, emission, **what)
    place, own = flat.vertices[flat.corner_vertex], np.array(owner)[flat.corner_face] == 1
    ends = np.where(place[:, 2] == 0.0, -1.0, np.where(place[:, 2] == 0.8, 1.0, 0.0))
    out = np.column_stack((place[:, :2] / 0.3, ends))
    normals = np.where(own[:, None], out / np.linalg.norm(out, axis=1)[:, None], flat.corner_normals)
    scene = Scene.from_polygons(things, 0.5, emission, corner_normals=normals, **what)
    shown = light(scene, "hierarchical", quality="preview").corner_radiance.mean(axis=1)
    foot, above = (shown[own & (np.abs(place[:, 2] - high) < 1e-9)] for high in (0.0, 0.2))
    assert foot.min() > 0.6 * above.mean() > 0
