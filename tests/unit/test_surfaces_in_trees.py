# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces in trees, as streams of segments find them: nothing is lost or torn on the way."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from core.meshing import mesh
from core.occlusion import stream_tree, streams
from core.occlusion.box_tree import box_tree
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.streams import StreamOccluders
from core.occlusion.surfaces import occluder_polygons
from core.scene import Scene
from tests.unit.blockers import halves, soup, sphere


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
