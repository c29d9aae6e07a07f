# SPDX-License-Identifier: GPL-3.0-or-later
"""Who blocks whom: the brute force, the streams and, where Blender is, its tree have to say the same."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.meshing import mesh
from core.occlusion.blender_tree import BVHOccluders
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.streams import StreamOccluders
from core.occlusion.surfaces import MARGIN
from core.scene import Scene
from core.visibility import SurfaceOccluders, scene_occluders
from tests.unit.blockers import TURN, box, everything, grid, halves, joined, runs_along, soup


def test_one_triangle(occluders):
    wall = occluders(soup([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]))
    one = np.array([[0.2, 0.2, 1], [0.2, 0.2, 1], [0.8, 0.8, 1], [-0.1, 0.2, 1], [0.2, 0.2, 1], [0.2, 0.2, 1]])
    two = np.array([[0.2, 0.2, -1], [0.3, 0.1, -2], [0.8, 0.8, -1], [-0.1, 0.2, -1], [0.2, 0.2, 0.1], [0.2, 0.2, 0]])
    np.testing.assert_array_equal(wall.blocked(one, two), [True, True, False, False, False, False])
    np.testing.assert_array_equal(wall.blocked(two, one), [True, True, False, False, False, False])


def test_nothing_blocks_nothing(occluders):
    nothing = occluders(soup(np.zeros((0, 3, 3))))
    assert not nothing.blocked(np.zeros((3, 3)), np.ones((3, 3))).any()
    assert nothing.blocked(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    something = occluders(halves(box([0, 0, 0], [1, 1, 1])))
    assert something.blocked(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    # A segment without length.
    assert not something.blocked(np.full((2, 3), 0.5), np.full((2, 3), 0.5)).any()


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.booleans(), st.sampled_from([0, 4, 8]))
def test_all_agree_on_soups(seed, count, pairs, lattice):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(0, 1, (count, 3, 3))
    ends = rng.uniform(0, 1, (2, 400, 3))
    if lattice:
        # Corners, edges and planes in common, and ends on them.
        corners, ends = np.round(lattice * corners) / lattice, np.round(lattice * ends) / lattice
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners = corners[np.linalg.norm(normal, axis=1) > 1e-3]
    scene = soup(corners)
    if pairs:
        scene = halves(np.concatenate([corners, (corners[:, :1] + corners[:, 2:] - corners[:, 1:2])], axis=1))
    # Where it matters how near is on the plane or over the edge, there are two right answers.
    surely = BruteForceOccluders(scene, margin=2 * MARGIN, growth=-1e-6).blocked(*ends)
    maybe = BruteForceOccluders(scene, margin=0.5 * MARGIN, growth=3e-6).blocked(*ends)
    assert np.all(surely <= maybe)
    along = runs_along(corners, *ends)
    for found in everything(scene):
        # What runs along a surface may slip past Blender's tree.
        counts = ~along | (not isinstance(found, BVHOccluders))
        assert np.all(surely <= found.blocked(*ends), where=counts)
        assert np.all(found.blocked(*ends) <= maybe)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_symmetric_in_the_ends(seed):
    rng = np.random.default_rng(seed)
    scene = soup(np.round(4 * rng.uniform(0, 1, (40, 1, 3)) + rng.uniform(-1, 1, (40, 3, 3)), 2))
    ends = rng.uniform(0, 4, (2, 300, 3))
    for found in (BruteForceOccluders(scene), StreamOccluders(scene)):
        np.testing.assert_array_equal(found.blocked(*ends), found.blocked(*ends[::-1]))


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["level", "turned"])
@pytest.mark.parametrize(
    ("size", "origin"), [(1, 0), (1, 1e6), (1e-3, 0), (1e5, -3e7)], ids=["plain", "far", "tiny", "huge"]
)
def test_closed_box_blocks_in_and_out(occluders, turn, size, origin):
    walls = occluders(halves(size * (box([0, 0, 0], [3, 2, 1]) @ turn.T) + origin))
    rng = np.random.default_rng(0)
    inside = rng.uniform(0.001, 0.999, (2, 500, 3)) * [3, 2, 1]
    way = rng.normal(size=(500, 3))
    outside = np.array([1.5, 1, 0.5]) + 5 * way / np.linalg.norm(way, axis=1, keepdims=True)
    inside, outside = (size * (points @ turn.T) + origin for points in (inside, outside))
    assert walls.blocked(inside[0], outside).all()
    assert walls.blocked(outside, inside[1]).all()
    assert not walls.blocked(inside[0], inside[1]).any()


def test_points_on_the_walls_of_a_room_see_each_other(occluders):
    room = box([0, 0, 0], [3, 2, 1])[:, ::-1]
    walls = occluders(joined(room))
    rng = np.random.default_rng(1)
    u, v = rng.uniform(0, 1, (2, 2, 2000, 1))
    a, b, _, d = np.moveaxis(room[rng.integers(0, 6, (2, 2000))], 2, 0)
    points = a + u * (b - a) + v * (d - a)
    assert not walls.blocked(points[0], points[1]).any()
    # The same from corner to corner, edges included.
    ends = room.reshape(-1, 3)
    assert not walls.blocked(np.repeat(ends, 24, axis=0), np.tile(ends, (24, 1))).any()


def test_wall_does_not_block_what_runs_along_it(occluders):
    wall = occluders(halves([*grid(np.ones((4, 4))), *grid(np.ones((1, 1)), 3.0)]))
    rng = np.random.default_rng(2)
    ends = np.concatenate([rng.uniform(-1, 5, (2, 1000, 2)), np.zeros((2, 1000, 1))], axis=2)
    assert not wall.blocked(ends[0], ends[1]).any()
    # Nor what leaves it, however shallow.
    for shallow in (1e-1, 1e-3, 1e-5, 1e-7, 1e-9):
        assert not wall.blocked(ends[0], ends[1] + [0, 0, shallow]).any()


@pytest.mark.parametrize("join", [joined, halves], ids=["joined", "apart"])
def test_box_on_a_floor(occluders, join):
    floor, block = 2.0 * grid(np.ones((5, 5))), box([4, 4, 0], [6, 6, 2])
    scene = occluders(join([*floor, *block]))
    light = np.array([[5.0, 5.0, 9.0]])
    # Just outside its base on every side, and as far under it.
    for gap in (1e-3, 1e-2, 0.1):
        side = np.array([[4 - gap, 5, 0], [6 + gap, 5, 0], [5, 4 - gap, 0], [5, 6 + gap, 0]])
        lamp = light + 6 * (side - [5, 5, 0])
        assert not scene.blocked(side, lamp).any()
        under = np.array([[4 + gap, 5, 0], [6 - gap, 5, 0], [5, 4 + gap, 0], [5, 6 - gap, 0], [5, 5, 0]])
        assert scene.blocked(under, np.repeat(light, 5, axis=0)).all()
        # And across the block's foot.
        assert scene.blocked(side[[0, 2]] + [0, 0, gap], side[[1, 3]] + [0, 0, gap]).all()


def test_wall_that_stands_a_millimetre_in_the_floor(occluders):
    floor, wall = 10 * box([0, 0, 0], [1, 1, 1])[4:5], box([5, 0, -0.001], [5.2, 10, 3])
    scene = occluders(halves([*floor, *wall]))
    height = np.array([-0.0009, -0.0005, -0.0002, 0.0002, 0.0005, 0.01, 1.0])
    points = np.stack([np.full(7, 5.0), np.full(7, 4.0), height], axis=1)
    np.testing.assert_array_equal(scene.blocked(points, np.tile([1.0, 4, 2.5], (7, 1))), height < 0)


def test_rays_pass_through_holes_only(occluders):
    mask = np.ones((20, 20), dtype=bool)
    mask[5:9, 7:13] = False
    mask[12:15, 3:4] = False
    wall = occluders(joined(grid(mask)))
    cell = np.random.default_rng(3).uniform(0, 20, (3000, 2))
    away = np.abs(cell - np.round(cell)).min(axis=1) > 1e-3
    start = np.column_stack([cell, np.full(3000, 1.5)])[away]
    blocked = wall.blocked(start, start * [1, 1, -1])
    index = start[:, :2].astype(int)
    np.testing.assert_array_equal(blocked, mask[index[:, 0], index[:, 1]])


@pytest.mark.parametrize("way", [BruteForceOccluders, BVHOccluders, SurfaceOccluders])
def test_nearest(way):
    if way is BVHOccluders:
        pytest.importorskip("bpy")
    size, origin = 20.0, np.array([1e4, 0, -300.0])
    quads = np.array([*box([0, 0, 0], [1, 1, 1])[:, ::-1], *box([0.4, 0.4, 0], [0.6, 0.6, 0.5])])
    room = way(halves(size * quads + origin))
    start = np.array([[5, 5, 10], [2, 2, 0], [2, 5, 2.5], [5, 5, 2], [5, 5, 30], [50, 50, 50], [0, 5, 5]]) / 10
    along = np.array([[0, 0, -1], [0, 0, 5], [2, 0, 0], [0, 1, 0], [0, 0, -1], [1, 0, 0], [0, 1, 0]], float)
    face, distance, front = room.nearest(size * start + origin, along)
    np.testing.assert_array_equal(face, [11, 5, 6, 9, 5, -1, 3])
    np.testing.assert_allclose(distance / size, [0.5, 1, 0.2, 0.1, 2, np.inf, 0.5], atol=1e-5)
    np.testing.assert_array_equal(front, [True, True, True, False, False, False, True])
    face, distance, front = way(soup(np.zeros((0, 3, 3)))).nearest(start, along)
    assert np.all(face == -1)
    assert np.all(np.isinf(distance))
    assert not front.any()


@pytest.mark.parametrize("way", [BruteForceOccluders, BVHOccluders, SurfaceOccluders])
def test_what_a_ray_leaves_is_nearer_than_what_it_enters_there(way):
    """A beam ends at a wall, and is as wide as it: from inside the beam its own end is seen, not the wall's side."""
    if way is BVHOccluders:
        pytest.importorskip("bpy")
    beam, wall = box([0, 0, 0], [5, 1, 1]), box([5, 0, 0], [5.2, 1, 1])
    start = np.random.default_rng(5).uniform((0, 0.1, 0.1), (4, 0.9, 0.9), (200, 3))
    along = np.array([(1.0, 0, 0)] * 200)
    for things in ((beam, wall), (wall, beam)):
        room = way(halves(np.concatenate(things)))
        face, distance, front = room.nearest(start, along)
        of = np.flatnonzero(np.concatenate([[thing is beam] * 6 for thing in things]))
        assert np.isin(face, of).all() and not front.any()
        np.testing.assert_allclose(distance, 5 - start[:, 0], atol=1e-4)
        _, _, front = room.nearest(start + (0, 2, 0), (0, -1, 0) + 0 * along)
        assert front.all()


def test_scene_occluders_are_over_surfaces():
    floor = grid(np.ones((30, 30)))
    scene = Scene.from_polygons([*floor, *box([10, 10, 1], [12, 12, 3])])
    found = scene_occluders(scene, mesh(scene))
    x, y = np.random.default_rng(11).uniform(0.01, 29.99, (2, 4000))
    start, end = np.stack([x, y, 0 * x], axis=1), np.stack([x, y, 0 * x + 5], axis=1)
    np.testing.assert_array_equal(found.blocked(start, end), (np.abs(x - 11) < 1) & (np.abs(y - 11) < 1))
    assert not found.blocked(start, start[::-1]).any()


def test_without_blender(monkeypatch):
    monkeypatch.setitem(sys.modules, "mathutils", None)
    found = SurfaceOccluders(halves(box([0, 0, 0], [1, 1, 1])))
    start, end = np.array([[0.5, 0.5, 0.5]]), np.array([[0.5, 0.5, 2.0]])
    assert found.blocked(start, end).all()
    assert found.nearest(start, end - start)[0] == [5]
