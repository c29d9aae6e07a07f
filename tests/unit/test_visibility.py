# SPDX-License-Identifier: GPL-3.0-or-later
"""Who blocks whom: the brute force, the streams and, where Blender is, its tree have to say the same."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core import visibility
from core.meshing import mesh
from core.occlusion import stream_tree, streams
from core.occlusion.blender_tree import BVHOccluders
from core.occlusion.box_tree import box_tree
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.streams import StreamOccluders
from core.occlusion.surfaces import MARGIN, Occluding, occluder_polygons
from core.scene import BOTH, Scene
from core.visibility import SurfaceOccluders, scene_occluders

TURN = np.array([[2, 1, 2], [-2, 2, 1], [-1, -2, 2]]) / 3


@pytest.fixture(params=["brute", "stream", "tree"])
def occluders(request):
    """Return a way to build occluders; the tree only where Blender is."""
    if request.param == "tree":
        pytest.importorskip("bpy")
    return {"brute": BruteForceOccluders, "stream": StreamOccluders, "tree": BVHOccluders}[request.param]


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


def test_surface_that_turns_a_corner(occluders):
    mask = np.array([[1, 1, 1], [1, 0, 0], [1, 0, 0]], dtype=bool)
    wall = occluders(joined(grid(mask)))
    middle = np.argwhere(np.ones((3, 3))) + 0.5
    start = np.column_stack([middle, np.ones(9)])
    np.testing.assert_array_equal(wall.blocked(start, start * [1, 1, -2]), mask.reshape(-1))


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["level", "turned"])
def test_nothing_slips_through_where_pieces_meet(occluders, turn):
    # A window makes pieces that meet in T-junctions; all of the lines along which faces met before, and the corners.
    mask = np.ones((9, 9), dtype=bool)
    mask[3:5, 2:6] = False
    wall = occluders(joined([*(grid(mask) @ turn.T), *(box([0, 0, -3], [9, 9, 3]) @ turn.T)]))
    rng = np.random.default_rng(4)
    line, along = rng.integers(1, 9, 6000), rng.uniform(0.001, 8.999, 6000)
    along[:1000] = np.round(along[:1000])
    on = np.where(rng.random(6000)[:, None] < 0.5, np.stack([line, along], axis=1), np.stack([along, line], axis=1))
    solid = ~((on >= [3, 2]) & (on <= [5, 6])).all(axis=1) & (on > 0).all(axis=1) & (on < 9).all(axis=1)
    on = np.column_stack([on[solid], np.zeros(solid.sum())])
    way = rng.normal(size=on.shape)
    way[: len(on) // 2] = [0, 0, 1]
    way[:, 2] = np.sign(way[:, 2]) * np.maximum(np.abs(way[:, 2]), 0.05)
    way /= 10 * np.linalg.norm(way, axis=1, keepdims=True)
    assert wall.blocked((on - way) @ turn.T, (on + 0.7 * way) @ turn.T).all()


def test_nothing_slips_through_between_triangles(occluders):
    rng = np.random.default_rng(12)
    # A wavy sheet of triangles, and rays through points of their edges and through their corners.
    quads = grid(np.ones((12, 12)))
    quads[..., 2] = 0.4 * np.sin(quads[..., 0]) * np.cos(quads[..., 1])
    corners = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    sheet = occluders(soup(corners))
    share = np.append(rng.uniform(0, 1, 20), [0.0, 0.5, 1.0])[:, None, None, None]
    on = (share * corners + (1 - share) * np.roll(corners, 1, axis=1)).reshape(-1, 3)
    on = on[(on[:, :2] > 0.01).all(axis=1) & (on[:, :2] < 11.99).all(axis=1)]
    way = rng.normal(size=on.shape) + [0, 0, 3]
    way[: len(on) // 2] = [0, 0, 1]
    way[:, 2] = np.maximum(way[:, 2], 1.0)
    assert sheet.blocked(on - 1e-3 * way, on + 2e-3 * way).all()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_joining_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    quads = [*grid(rng.random((6, 6)) < 0.7), *grid(rng.random((6, 6)) < 0.4, 3.0), *box([1, 1, 0], [3, 2, 2.5])]
    quads = np.array(quads) @ TURN.T
    one, other = joined(quads), halves(quads)
    ends = rng.uniform([-1, -1, -1], [7, 7, 4], (2, 1000, 3)) @ TURN.T
    # Both have the same diagonal, so only edges within the growth could differ.
    surely = BruteForceOccluders(other, growth=-1e-6).blocked(*ends)
    maybe = BruteForceOccluders(other, growth=3e-6).blocked(*ends)
    for found in everything(one):
        assert np.all(surely <= found.blocked(*ends))
        assert np.all(found.blocked(*ends) <= maybe)


@pytest.mark.parametrize("scale", [1.0, 0.01], ids=["alone", "in a large scene"])
def test_hollow_smooth_mesh_does_not_hide_its_neighbours(occluders, scale):
    ball = scale * sphere(20)
    around = halves([[[-5, -5, -5], [5, -5, -5], [5, 5, -5], [-5, 5, -5]]])
    scene = Scene.from_polygons([*ball[:, ::-1], *(around.vertices[None] if scale < 1 else ())])
    patches = mesh(scene)
    walls = occluders(occluder_polygons(scene, patches))
    rng = np.random.default_rng(5)
    i, j = rng.integers(0, len(ball), (2, 2000))
    j[:1000] = (i[:1000] + 1) % len(ball)
    seen = (patches.normal[i] * (patches.centre[j] - patches.centre[i])).sum(axis=1) > 0
    assert seen.mean() > 0.9
    assert not walls.blocked(patches.centre[i[seen]], patches.centre[j[seen]]).any()


def test_bent_wall_does_not_hide_its_own_points(occluders):
    bent = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0.6], [0, 4, 0]])
    lid = np.array([[0, 0, 3], [0, 4, 3], [4, 4, 3], [4, 0, 3]])
    scene = Scene.from_polygons([bent, lid], sides=[BOTH, BOTH])
    patches = mesh(scene, max_edge=1.0)
    walls = occluders(occluder_polygons(scene, patches))
    u, v = np.random.default_rng(6).uniform(0, 1, (2, 3000))
    on = np.stack([4 * u, 4 * v, 0.6 * u * v], axis=1)
    assert not walls.blocked(on, np.tile([2.0, 2, 3], (3000, 1))).any()
    assert not walls.blocked(on, np.tile([2.0, 2, -3], (3000, 1))).any()
    assert walls.blocked(on - [0, 0, 0.2], np.tile([2.0, 2, 3], (3000, 1))).all()


def test_answers_do_not_depend_on_company(occluders, monkeypatch):
    rng = np.random.default_rng(7)
    scene = soup(rng.uniform(0, 4, (300, 1, 3)) + rng.uniform(-0.5, 0.5, (300, 3, 3)))
    found = occluders(scene)
    ends = rng.uniform(0, 4, (2, 5000, 3))
    together = found.blocked(*ends)
    parts = np.array_split(np.arange(5000), 7)
    with ThreadPoolExecutor(4) as threads:
        apart = threads.map(lambda part: found.blocked(ends[0][part], ends[1][part]), parts)
        np.testing.assert_array_equal(np.concatenate(list(apart)), together)
    monkeypatch.setattr(streams, "STREAM", 1500)
    monkeypatch.setattr(streams, "CHUNK", 333)
    np.testing.assert_array_equal(found.blocked(*ends), together)
    # Whether segments go through the tree as a stream or each for itself.
    for fewest in (1, 10_000):
        monkeypatch.setattr(streams, "FEWEST", fewest)
        np.testing.assert_array_equal(found.blocked(*ends), together)


def test_deep_trees(monkeypatch):
    rng = np.random.default_rng(8)
    corners = rng.uniform(0, 4, (800, 1, 3)) + rng.uniform(-0.3, 0.3, (800, 3, 3))
    fourth = corners[:, :1] + corners[:, 2:] - corners[:, 1:2]
    ends = rng.uniform(0, 4, (2, 2000, 3))
    for scene in (soup(corners), halves(np.concatenate([corners, fourth], axis=1))):
        expected = BruteForceOccluders(scene).blocked(*ends)
        for leaf, children, twig, fewest in ((2, 2, 1, 1), (5, 3, 5, 50), (1000, 12, 4, 1), (16, 12, 2, 10_000)):
            monkeypatch.setattr(stream_tree, "LEAF", leaf)
            monkeypatch.setattr(stream_tree, "CHILDREN", children)
            monkeypatch.setattr(stream_tree, "TWIG", twig)
            monkeypatch.setattr(streams, "FEWEST", fewest)
            np.testing.assert_array_equal(StreamOccluders(scene).blocked(*ends), expected)


def test_a_box_tree_holds_every_box_once():
    rng = np.random.default_rng(12)
    for count, scatter in ((1, 1.0), (7, 1.0), (5000, 0.0), (9000, 1.0)):
        # Boxes that are all at one place are parted by number.
        low = (scatter * rng.random((count, 3))).astype(np.float32)
        high = low + 0.1 + (scatter * rng.random((count, 3)) ** 9).astype(np.float32)
        tree = box_tree(low, high, 3)
        assert np.array_equal(np.sort(tree.order), np.arange(count))
        inner = np.flatnonzero(tree.child >= 0)
        size, child = tree.stop - tree.start, tree.child[inner]
        assert size.min() >= 1 and size[tree.child < 0].max() <= 3
        np.testing.assert_array_equal(tree.start[child], tree.start[inner])
        np.testing.assert_array_equal(tree.stop[child], tree.start[child + 1])
        np.testing.assert_array_equal(tree.stop[child + 1], tree.stop[inner])
        for node in range(len(tree.child)):
            member = tree.order[tree.start[node] : tree.stop[node]]
            np.testing.assert_array_equal(tree.low[:, node], low[member].min(axis=0))
            np.testing.assert_array_equal(tree.high[:, node], high[member].max(axis=0))


def test_fans_are_not_torn_into_wrong_parallelograms():
    turn = np.linspace(0, 2 * np.pi, 6, endpoint=False)
    hexagon = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    # Three diamonds round the middle, as a fan of six triangles: every two that follow each other are one.
    spokes = np.stack([0 * hexagon, hexagon, np.roll(hexagon, -1, axis=0)], axis=1)
    start = np.column_stack([np.random.default_rng(9).uniform(-1, 1, (3000, 2)), np.ones(3000)])
    for scene in (soup(spokes), soup(spokes[1:]), soup(np.concatenate([spokes[:4], spokes[:1]]))):
        np.testing.assert_array_equal(
            StreamOccluders(scene).blocked(start, start * [1, 1, -1]),
            BruteForceOccluders(scene).blocked(start, start * [1, 1, -1]),
        )


def test_round_rooms_have_more_walls_than_are_looked_at():
    ball = sphere(12)[:, ::-1]
    scene = Scene.from_polygons(ball)
    occluding = occluder_polygons(scene, mesh(scene))
    way = np.random.default_rng(10).normal(size=(2, 3000, 3))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    for inner, outer in ((0.5, 0.9), (0.9, 1.5), (1.5, 1.6)):
        ends = inner * way[0], outer * way[1]
        expected = BruteForceOccluders(occluding).blocked(*ends)
        np.testing.assert_array_equal(StreamOccluders(occluding).blocked(*ends), expected)


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


def test_scene_occluders_are_over_surfaces():
    floor = grid(np.ones((30, 30)))
    scene = Scene.from_polygons([*floor, *box([10, 10, 1], [12, 12, 3])])
    found = scene_occluders(scene, mesh(scene))
    x, y = np.random.default_rng(11).uniform(0.01, 29.99, (2, 4000))
    start, end = np.stack([x, y, 0 * x], axis=1), np.stack([x, y, 0 * x + 5], axis=1)
    np.testing.assert_array_equal(found.blocked(start, end), (np.abs(x - 11) < 1) & (np.abs(y - 11) < 1))
    assert not found.blocked(start, start[::-1]).any()


def test_without_blender(monkeypatch):
    def missing(occluding):
        raise ModuleNotFoundError("No module named 'mathutils'")

    monkeypatch.setattr(visibility, "BVHOccluders", missing)
    found = SurfaceOccluders(halves(box([0, 0, 0], [1, 1, 1])))
    start, end = np.array([[0.5, 0.5, 0.5]]), np.array([[0.5, 0.5, 2.0]])
    assert found.blocked(start, end).all()
    assert found.nearest(start, end - start)[0] == [5]
