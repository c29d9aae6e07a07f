# SPDX-License-Identifier: GPL-3.0-or-later
"""Receivers that might see thousands of things: rays tell them what they see."""

from dataclasses import replace

import numpy as np
import pytest

from core.hierarchy import links, thickets
from core.hierarchy.element_hits import ElementHits
from core.hierarchy.elements import Elements
from core.hierarchy.exchange import build_rows
from core.hierarchy.foresight import links_memory
from core.hierarchy.pieces import quarters
from core.hierarchy.quality import Detail
from core.hierarchy.receivers import group_receivers
from core.hierarchy.rows import gather, merged
from core.hierarchy.scenery import build_scenery, node_means
from core.hierarchy.sights import large_sights
from core.meshing import mesh
from core.scene import Scene
from core.visibility import scene_occluders
from tests.unit.source_trees import measured, random_polygons

DETAIL = Detail(0.8, 0.008, 0.04, 8)


@pytest.fixture
def thick(monkeypatch):
    """Take every receiver for one in a thicket that has more than a few links."""
    monkeypatch.setattr(links, "_DENSE", 0.0)
    monkeypatch.setattr("core.hierarchy.scenery.most_links", lambda detail: 3)


def lit(corners, radiosity, blocks=None):
    """Return elements of polygons, and what receivers see of them with that radiosity, shape (n,)."""
    centre, normal, area = measured(corners)
    count, grey = len(area), np.repeat(radiosity[:, None], 3, axis=1)
    elements = Elements(corners, centre, normal, area, np.arange(count), np.full((count, 3), 0.5), grey, np.ones(count))
    blocks = np.ones(count, bool) if blocks is None else blocks
    polygons = [[*map(tuple, polygon)] for polygon in corners]
    scene = replace(Scene.from_polygons(polygons, 0.5), occludes=blocks)
    occluders = scene_occluders(scene, mesh(scene))
    scenery = build_scenery(
        elements, grey, 1.0, occluders, hits=ElementHits(corners, np.arange(count), np.ones(count, int), blocks)
    )
    return elements, scenery


def light_at(point, normal, elements, scenery, detail=DETAIL, size=2):
    receivers = group_receivers(point, normal, size)
    rows = build_rows(receivers, np.arange(len(receivers)), scenery, detail)
    nodes = node_means(scenery.sources, elements.area, elements.emission)[:, :1]
    light = np.zeros(len(point))
    light[receivers.index] = gather(rows, receivers, nodes)[:, 0]
    return light, rows, receivers


def foliage(seed=3, count=6000):
    """Return small quads in a ball, each with its other side, and who is to look among them."""
    rng = np.random.default_rng(seed)
    leaves = random_polygons(rng, count, triangles=0)
    middle = leaves.mean(axis=1, keepdims=True)
    leaves = middle + 0.3 * (leaves - middle)
    corners = np.concatenate((leaves, leaves[:, ::-1]))
    centre, normal, _ = measured(corners)
    near = np.flatnonzero((np.abs(centre) < 1.2).all(axis=1))[::40]
    # Brighter to one side.
    return corners, 1 + 0.5 * centre[:, 0], centre[near], normal[near]


@pytest.fixture(scope="module")
def leaves():
    """Return elements, scenery, and points with normals among many leaves."""
    pytest.importorskip("bpy")
    corners, radiosity, point, normal = foliage()
    return *lit(corners, radiosity), point, normal


def test_foliage_has_the_light_that_links_to_all_of_it_bring(leaves):
    elements, scenery, point, normal = leaves
    seen, rows, _ = light_at(point, normal, elements, scenery)
    linked, more, _ = light_at(point, normal, elements, replace(scenery, thickets=None))
    # Most are hidden: a quarter of the rays tells as much.
    assert rows.rays < 0.25 * more.rays
    assert seen.mean() == pytest.approx(linked.mean(), rel=0.02)
    many, *_ = light_at(point, normal, elements, scenery, replace(DETAIL, ray=DETAIL.ray / 32))
    assert np.sqrt(((seen - many) ** 2).mean()) < 1.1 * np.sqrt(((linked - many) ** 2).mean())


def test_a_closed_room_is_seen_whole(box, thick):
    corners = np.array(box((3.0, 2.0, 1.0)), float)
    elements, scenery = lit(corners, np.ones(6))
    point, normal, _ = measured(corners)
    light, rows, _ = light_at(point, normal, elements, scenery, size=1)
    assert light == pytest.approx(np.ones(6), abs=1e-6)
    assert rows.sums.sum(axis=1) == pytest.approx(np.ones(6), abs=1e-6)


def test_backs_are_dark_and_both_sides_of_a_sheet_their_own(thick):
    sheet = np.array([[(-9, -9, 1), (-9, 9, 1), (9, 9, 1), (9, -9, 1)]], float)
    # What looks down is the front of the first and the back of the second.
    point, normal = np.array([(0.0, 0, 0), (0.1, 0, 0)]), np.array([(0.0, 0, 1), (0, 0, 1)])
    far = np.array([[(-9, -9, 2), (-9, 9, 2), (9, 9, 2), (9, -9, 2)]], float)
    aside = np.array([[(x, 30, 0), (x, 30, 1), (x + 1, 30, 1), (x + 1, 30, 0)] for x in range(-4, 4)], float)
    for above, expected in ((sheet, 3.0), (sheet[:, ::-1], 0.0), (np.concatenate((sheet[:, ::-1], sheet)), 3.0)):
        corners = np.concatenate((above, far, aside))
        down = measured(corners)[1][:, 2] < -0.5
        radiosity = np.where(down & (corners[:, 0, 2] == 1), 3.0, np.where(corners[:, 0, 2] == 2, 7.0, 0.0))
        elements, scenery = lit(corners, radiosity)
        light, *_ = light_at(point, normal, elements, scenery)
        assert light == pytest.approx(np.full(2, expected), rel=0.05, abs=0.02)


def test_sides_of_a_sheet_that_are_cut_differently_are_met_each_from_its_own():
    whole = np.array([[(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]], float)
    corners = np.concatenate((whole, quarters(whole[:, ::-1])))
    hits = ElementHits(corners, np.zeros(5, int), np.array([1, -1, -1, -1, -1]))
    origins = np.array([(0.3, 0.4, 1.0), (0.3, 0.4, -1), (1.3, 0.4, -1), (5, 5, 1)])
    element, distance = hits.met(origins, np.array([(0, 0, -1.0), (0, 0, 1), (0, 0, 1), (0, 0, 1)]))
    assert element[0] == 0 and element[3] == -1
    for ray in (1, 2):
        low, high = corners[element[ray]].min(axis=0), corners[element[ray]].max(axis=0)
        assert element[ray] > 0 and (low[:2] < origins[ray, :2]).all() and (origins[ray, :2] < high[:2]).all()
    assert distance == pytest.approx([1, 1, 1, np.inf])


def test_what_is_bright_or_blocks_nothing_stays_linked(thick):
    corners, radiosity, point, normal = foliage(count=600)
    radiosity[7] = 50.0
    blocks = np.ones(len(corners), bool)
    blocks[[9, 609]] = False
    elements, scenery = lit(corners, radiosity, blocks)
    linked = scenery.thickets.linked
    tree = scenery.sources.tree
    assert linked[scenery.thickets.leaf[[7, 9, 609]]].all() and linked.sum() < 100
    *_, rows, receivers = light_at(point, normal, elements, scenery)
    # Nobody sees anything twice.
    everything = []
    for index in range(len(receivers)):
        nodes = rows.node[rows.first[index] : rows.first[index + 1]]
        held = np.concatenate([tree.order[tree.start[node] : tree.stop[node]] for node in nodes])
        assert len(np.unique(held)) == len(held)
        everything.append(held)
    # What does not block is met by no ray, and yet it is seen.
    assert np.isin([9, 609], np.concatenate(everything)).any()


def test_merged_rows_bring_the_light_of_both(thick):
    corners, radiosity, point, normal = foliage(count=300)
    elements, scenery = lit(corners, radiosity)
    _, one, receivers = light_at(point, normal, elements, scenery)
    other = build_rows(receivers, one.group, replace(scenery, thickets=None), DETAIL)
    both = merged(one, other, receivers)
    nodes = node_means(scenery.sources, elements.area, elements.emission)
    parts = [gather(rows, receivers, nodes) for rows in (one, other)]
    assert gather(both, receivers, nodes) == pytest.approx(sum(parts), rel=1e-5)
    tree = scenery.sources.tree
    found = [large_sights(rows, receivers, tree) for rows in (one, other)]
    joined = large_sights(both, receivers, tree)
    keys = [sorted(zip(s.receiver, s.element, s.weight, *s.place.T, strict=True)) for s in (*found, joined)]
    assert sorted(keys[0] + keys[1]) == keys[2] and len(keys[0]) and len(keys[1])


def test_links_are_foreseen_as_they_are_kept(leaves):
    _, scenery, point, normal = leaves
    receivers = group_receivers(point, normal, 2)
    rows = build_rows(receivers, np.arange(len(receivers)), scenery, DETAIL)
    kept = rows.weight.nbytes + rows.node.nbytes
    assert kept <= links_memory(receivers, scenery, DETAIL) <= 8 * kept
    assert thickets.rays_of(DETAIL) == 100
