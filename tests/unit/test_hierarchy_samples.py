# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples that receive for many: clusters of elements, and what they are told."""

from dataclasses import replace

import numpy as np
import pytest

from core.bake import bake
from core.hierarchy import quality as qualities
from core.hierarchy.clustering import _hidden, choose_samples
from core.hierarchy.elements import split_patches
from core.hierarchy.neighbourhoods import find_neighbourhoods
from core.hierarchy.probes import points_facing_dark
from core.hierarchy.receivers import SPARSE_SIZE, group_receivers, group_size
from core.hierarchy.samples import each
from core.lighting.sky import SkyLamp
from core.meshing import mesh
from core.progress import exhaust
from core.scene import BACK, FRONT, Scene
from core.settings import Settings
from core.visibility import scene_occluders
from tests.unit.globes import globe
from tests.unit.source_trees import random_polygons


@pytest.fixture
def parted(box):
    """A box of two rooms with a wall of no thickness between them, as elements and what blocks."""
    wall = np.array([(0.5, 0, 0), (0.5, 1, 0), (0.5, 1, 1), (0.5, 0, 1)])
    polygons = [*box(), wall, wall[::-1]]
    scene = Scene.from_polygons(polygons, 0.5, 1.0, divisions=np.full(len(polygons), 10))
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    return split_patches(patches, occluders, tolerance=1.0, size=1.0), occluders


def test_there_are_about_as_many_as_allowed_and_each_speaks_for_what_looks_alike(parted):
    elements, occluders = parted
    samples = choose_samples(elements, occluders, 200)
    assert 50 < len(samples) <= 220
    assert np.array_equal(samples.cluster[samples.element], np.arange(len(samples)))
    assert (elements.normal == elements.normal[samples.element[samples.cluster]]).all()
    assert samples.area.sum() == pytest.approx(elements.area.sum())


def test_none_speaks_for_the_other_side_of_a_wall(parted):
    elements, occluders = parted
    samples = choose_samples(elements, occluders, 60)
    beyond = elements.centre[:, 0] + 1e-3 * elements.normal[:, 0] > 0.5
    assert (beyond == beyond[samples.element[samples.cluster]]).all()


def test_none_behind_a_picture_speaks_for_the_wall_around_it(box):
    picture = np.array([(0.01, 0.3, 0.3), (0.01, 0.7, 0.3), (0.01, 0.7, 0.7), (0.01, 0.3, 0.7)])
    polygons = [*box(), picture, picture[::-1]]
    scene = Scene.from_polygons(polygons, 0.5, 1.0, divisions=np.full(len(polygons), 10))
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    elements = split_patches(patches, occluders, tolerance=1.0, size=1.0)
    wall = elements.centre[:, 0] < 1e-6
    behind = wall & (np.abs(elements.centre[:, 1:] - 0.5) < 0.2).all(axis=1)
    hid, beside = np.flatnonzero(behind), np.flatnonzero(wall & ~behind)[:1]
    assert len(hid) == 16
    places = elements.centre, elements.normal
    assert _hidden(*places, hid, np.repeat(beside, len(hid)), occluders).all()
    assert not _hidden(*places, beside, beside + 1, occluders).any()


def test_a_floor_is_still_cut_where_little_things_take_up_all_clusters():
    beads = [face for k in range(15) for face in globe(12, 8, 0.1, (k % 5, k // 5, 1.0))]
    floor = np.array([(0, 0, 0), (8, 0, 0), (8, 5, 0), (0, 5, 0)], float)
    scene = Scene.from_polygons([floor, *beads], divisions=np.array([20] + [1] * len(beads)))
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    elements = split_patches(patches, occluders, tolerance=1.0, size=1.0)
    around = find_neighbourhoods(elements, occluders)
    _, alike = around.smallest(len(elements))
    fewest = len(around.tree.cut_where(alike))
    nodes, _ = around.smallest(fewest)
    assert fewest < len(nodes) < 1.5 * fewest
    # The floor is 400 elements that are all alike.
    assert around.tree.size[nodes].max() < 40


def pots_in_a_room(box, inward, parts):
    """Return pots upside down on the floor of a glowing room whose normals look inwards or outwards, and where."""
    places = [(0.1 + 0.2 * i, 0.1 + 0.2 * j, 0.0) for i in range(4) for j in range(4)]
    pots = [face for place in places for face in box((0.1, 0.1, 0.1), place, inward=False)[1:]]
    polygons, parts = [*box(inward=inward), *pots], np.repeat([20, parts], [6, len(pots)])
    sides, emission = np.full(len(polygons), FRONT), np.zeros((len(polygons), 3))
    sides[:6], emission[1] = FRONT if inward else BACK, 1.0
    return Scene.from_polygons(polygons, 0.5, emission, sides=sides, divisions=parts), np.array(places)


@pytest.mark.parametrize("inward", [True, False])
def test_none_under_a_pot_speaks_for_the_open_floor_whatever_the_normals_of_the_room(box, inward):
    scene, places = pots_in_a_room(box, inward, 1)
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    elements = split_patches(patches, occluders, tolerance=1.0, size=1.0)
    floor = (elements.centre[:, 2] == 0) & (elements.normal[:, 2] > 0)
    middle = elements.centre[:, None, :2] - places[:, :2] - 0.05
    under = floor & (np.abs(middle) < 0.05).all(axis=2).any(axis=1)
    assert under.sum() == 64
    dark = points_facing_dark(elements.centre, elements.normal, scene.sides, occluders)
    np.testing.assert_array_equal(dark[floor], under[floor])
    around = find_neighbourhoods(elements, occluders, scene.sides)
    nodes, _ = around.smallest(100)
    start, stop = around.tree.start[nodes], around.tree.stop[nodes]
    for cluster in (around.tree.order[i:j] for i, j in zip(start, stop, strict=True)):
        assert dark[cluster].all() or not dark[cluster].any()


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_cluttered_room_is_as_bright_with_its_normals_outwards(box, monkeypatch):
    sparse = replace(qualities.QUALITIES["medium"], samples=150, corners=30)
    monkeypatch.setitem(qualities.QUALITIES, "medium", sparse)
    light = [exhaust(bake(pots_in_a_room(box, inward, 4)[0], Settings())).corner_radiance for inward in (True, False)]
    assert light[1].mean() == pytest.approx(light[0].mean(), rel=0.02)


def test_plates_behind_a_wide_one_come_off_one_by_one():
    def plate(width, z):
        return np.array([(x * width, y * width, z) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])

    polygons = [plate(0.5, 0.0), *(plate(0.1, -0.08 - 0.04 * k) for k in range(7))]
    scene = Scene.from_polygons(polygons, divisions=np.array([20] + [4] * 7))
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    elements = split_patches(patches, occluders, tolerance=1.0, size=1.0)
    samples = choose_samples(elements, occluders, 8)
    assert len(samples) == 11
    assert np.bincount(samples.cluster).max() == 100
    np.testing.assert_allclose(elements.centre[samples.element[samples.cluster], 2], elements.centre[:, 2])


def test_what_is_told_keeps_its_sum_and_follows_a_trend(parted):
    elements, occluders = parted
    samples = choose_samples(elements, occluders, 120)
    rising = 1 + elements.centre @ np.array([[0.5, 0.2], [0.3, 0.1], [0.1, 0.4]])
    told = samples.spread(rising[samples.element])
    assert elements.area @ told == pytest.approx(samples.area @ rising[samples.element])
    flat = rising[samples.element][samples.cluster]
    assert np.abs(told - rising).mean() < 0.7 * np.abs(flat - rising).mean()
    assert samples.spread(np.zeros((len(samples), 1))).max() == 0


def test_few_elements_stand_for_themselves(parted):
    elements, occluders = parted
    samples = choose_samples(elements, occluders, len(elements))
    assert samples.single and each(elements).single
    values = np.random.default_rng(1).uniform(size=(len(elements), 3))
    assert np.array_equal(samples.spread(values), values)


def test_a_bake_by_samples_is_near_the_one_by_all(box, monkeypatch):
    block = box((0.3, 0.3, 0.3), (0.35, 0.2, 0.0), inward=False)
    polygons = [*box(), *block]
    emission = np.zeros((len(polygons), 3))
    emission[1] = 1
    scene = Scene.from_polygons(polygons, 0.5, emission, divisions=np.full(len(polygons), 12))
    all_of_them = exhaust(bake(scene, Settings()))
    sparse = replace(qualities.QUALITIES["medium"], samples=600, corners=30)
    monkeypatch.setitem(qualities.QUALITIES, "medium", sparse)
    some = exhaust(bake(scene, Settings()))
    assert some.report.energy.error < 1e-3 and some.report.links < all_of_them.report.links
    area = some.patches.area[:, None]
    off = np.sqrt((area * (some.solution.radiosity - all_of_them.solution.radiosity) ** 2).sum() / area.sum() / 3)
    assert off < 0.02 * (area * all_of_them.solution.radiosity).sum() / area.sum() / 3
    assert some.corner_radiance.mean() == pytest.approx(all_of_them.corner_radiance.mean(), rel=0.05)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_areas_that_sums_lose_beside_huge_ones_are_clustered_all_the_same():
    land = 1e6 * np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    crumb = 1e-7 * np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    crumbs = [crumb + (1.0 + 0.01 * column, 0.01 * row, 1.0) for row in range(8) for column in range(8)]
    scene = Scene.from_polygons([land, *crumbs], 0.5, 1.0)
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    elements = split_patches(patches, occluders, tolerance=1.0, size=1e9)
    samples = choose_samples(elements, occluders, 20)
    assert np.isfinite(samples.slope).all() and samples.area.sum() == pytest.approx(elements.area.sum())


def test_blades_of_grass_that_hide_each_other_do_not_each_need_a_sample(box):
    rng = np.random.default_rng(0)
    foot = np.column_stack([rng.uniform(1, 4, (700, 2)), np.zeros(700)])
    along = np.column_stack([rng.normal(size=(700, 2)), np.zeros(700)]) * 0.03
    blades = np.stack([foot, foot + along, foot + along + (0, 0, 0.1), foot + (0, 0, 0.1)], axis=1)
    glow = np.repeat([[0.0], [1.0], [0.0]], [1, 1, 704], axis=0) * np.ones(3)
    scene = Scene.from_polygons([*box((5, 5, 3)), *blades], 0.5, glow, sides=np.repeat([1, 3], [6, 700]))
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    elements = split_patches(patches, occluders, tolerance=1.0, size=1.0)
    # Nothing is gained by elements that are smaller than a blade.
    assert len(elements) < 1.1 * len(patches.area)
    samples = choose_samples(elements, occluders, 100)
    assert len(samples) < 500
    assert np.array_equal(samples.cluster[samples.element], np.arange(len(samples)))
    assert samples.area.sum() == pytest.approx(elements.area.sum())


def test_samples_of_a_bush_are_as_often_outside_as_its_leaves_are():
    pytest.importorskip("bpy", reason="takes long without Blender's tree")
    rng = np.random.default_rng(5)
    leaves = random_polygons(rng, 4000, triangles=0)
    way = rng.normal(size=(4000, 1, 3))
    way *= rng.uniform(0, 1, (4000, 1, 1)) ** (1 / 3) / np.linalg.norm(way, axis=2, keepdims=True)
    corners = way + 0.4 * (leaves - leaves.mean(axis=1, keepdims=True))
    scene = Scene.from_polygons([[*map(tuple, leaf)] for leaf in corners], 0.5)
    occluders = scene_occluders(scene, patches := mesh(scene))
    elements = split_patches(patches, occluders, tolerance=1.0, size=1.0)
    # Light falls on the outside.
    light = np.linalg.norm(elements.centre, axis=1)[:, None] ** 12
    finer = choose_samples(elements, occluders, 600)
    for samples in (finer, choose_samples(elements, occluders, 200, finer=finer)):
        assert samples.stranger.mean() > 0.3
        told = samples.spread(light[samples.element])
        assert elements.area @ told == pytest.approx(elements.area @ light, rel=0.1)


def test_the_sky_is_looked_at_by_samples_of_a_fine_mesh_and_by_those_where_it_changes(monkeypatch):
    """A plain of 9000 corners with a block on it: every corner for itself, or a few hundred for all."""
    n = 94
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * 10 / n
    cell = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    plain = np.stack([cell, cell + n + 1, cell + n + 2, cell + 1], axis=1)
    corners = np.array([(i, j, k) for i in (4, 6) for j in (4, 6) for k in (0, 3)], float)
    block = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (1, 5, 7, 3)]) + len(points)
    faces = np.concatenate([plain, block])
    vertices = np.concatenate([points, corners])
    sky = SkyLamp("Sky", np.ones((1, 1, 3)))
    scene = Scene(vertices, faces.ravel(), 4 * np.arange(len(faces) + 1), np.full((len(faces), 3), 0.5),
                  np.zeros((len(faces), 3)), lamps=[sky])  # fmt: skip
    floor = scene.corner_face < len(plain)
    shown = {}
    for corners in (20_000, 600):
        quality = replace(qualities.QUALITIES["preview"], corners=corners, samples=300)
        monkeypatch.setitem(qualities.QUALITIES, "preview", quality)
        shown[corners] = exhaust(bake(scene, Settings(quality="preview"))).corner_irradiance[floor, 0]
    every, few = shown.values()
    assert every.min() < 0.6 * np.pi < 0.98 * np.pi < every.max()
    error = few - every
    assert abs(error.mean()) < 0.01 * every.mean()
    assert np.sqrt((error**2).mean()) < 0.04 * every.mean()


def test_there_are_about_as_many_groups_of_samples_as_of_all():
    point, normal = np.random.default_rng(6).uniform(0, 1, (8000, 3)) * (1, 1, 0), np.tile((0.0, 0.0, 1.0), (8000, 1))
    groups = [
        len(group_receivers(point[:count], normal[:count], group_size(count, 8000))) for count in (8000, 4000, 2000)
    ]
    assert groups == pytest.approx(3 * groups[:1], rel=0.1)
    assert group_size(10, 100_000) == SPARSE_SIZE


def test_fewer_samples_are_chosen_from_more_of_them(parted):
    elements, occluders = parted
    around = find_neighbourhoods(elements, occluders)
    many = choose_samples(elements, occluders, 400, around)
    few = choose_samples(elements, occluders, 60, around, finer=many)
    assert len(few) < 80 < len(many)
    # Whoever has a sample in common has one in common among the fewer.
    assert (few.cluster == few.cluster[many.element][many.cluster]).all()
    assert np.isin(few.element, many.element).all()
    assert np.array_equal(few.cluster[few.element], np.arange(len(few)))
    assert few.area.sum() == pytest.approx(elements.area.sum())
    beyond = elements.centre[:, 0] + 1e-3 * elements.normal[:, 0] > 0.5
    assert (beyond == beyond[few.element[few.cluster]]).all()
    values = np.random.default_rng(2).uniform(size=(len(few), 3))
    assert elements.area @ few.spread(values) == pytest.approx(few.area @ values)
