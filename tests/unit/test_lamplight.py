# SPDX-License-Identifier: GPL-3.0-or-later
"""Light straight from elements that are lamps, on meshes so fine that some corners look at them for others."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from core.bake import bake
from core.hierarchy import corners, lamplight, sparse_glances
from core.hierarchy import quality as qualities
from core.hierarchy.filter import mesh_edges
from core.hierarchy.kernels import near_form_factors
from core.hierarchy.sources import build_sources
from core.hierarchy.unblocked import unblocked_irradiance
from core.hierarchy.vantages import corner_receivers
from core.lighting.lamps import PointLamp
from core.meshing import mesh
from core.progress import Progress, exhaust, scaled
from core.scene import Scene
from core.settings import Settings
from core.shading import smooth_groups


@pytest.fixture
def plain():
    """A plain of 9000 corners under a glowing panel, with a block that casts a shadow; and the corners of the plain."""
    n = 94
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * 10 / n
    cell = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    floor = np.stack([cell, cell + n + 1, cell + n + 2, cell + 1], axis=1)
    block = np.array([(i, j, k) for i in (4, 6) for j in (4, 6) for k in (0, 2)], float)
    panel = np.array([(1, 1, 5), (1, 2, 5), (2, 2, 5), (2, 1, 5)], float)
    sides = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (1, 5, 7, 3)]) + len(points)
    faces = np.concatenate([floor, sides, np.arange(4)[None] + len(points) + len(block)])
    glow = np.zeros((len(faces), 3))
    glow[-1] = 50.0
    vertices = np.concatenate([points, block, panel])
    scene = Scene(vertices, faces.ravel(), 4 * np.arange(len(faces) + 1), np.full((len(faces), 3), 0.5), glow)
    return scene, scene.corner_face < len(floor)


@pytest.fixture
def lamplit(plain, monkeypatch):
    """Bake the plain: light straight from the panel on it, and which of its corners looked at that."""
    scene, floor = plain
    seen, looking = lamplight._seen, []

    def noted(corners, which, *others):
        looking.append(which)
        return seen(corners, which, *others)

    monkeypatch.setattr(lamplight, "_seen", noted)
    quality = replace(qualities.QUALITIES["medium"], corners=600, samples=300)
    monkeypatch.setitem(qualities.QUALITIES, "medium", quality)

    def run(more):
        monkeypatch.setattr(sparse_glances, "_MORE", more)
        looking.clear()
        light = exhaust(bake(scene, Settings())).corner_direct[floor, 0]
        return light, np.isin(smooth_groups(scene)[floor], np.concatenate(looking))

    return run


def test_some_corners_look_at_lamps_for_others_and_all_round_shadows(plain, lamplit):
    (every, all_of_them), (few, some) = lamplit(100), lamplit(2)
    assert all_of_them.all() and some.mean() < 0.3
    # Right by the block there are other reasons to differ.
    scene, floor = plain
    free = (np.abs(scene.vertices[scene.corner_vertex[floor], :2] - 5) > 1.2).any(axis=1)
    error, mean = (few - every)[free], every.mean()
    assert abs(error.mean()) < 1e-3 * mean
    # Where they look, rays differ; where they do not, light is as smooth as it is.
    assert np.sqrt((error**2).mean()) < 0.012 * mean
    assert np.sqrt((error[~some[free]] ** 2).mean()) < 0.009 * mean
    assert every.min() < 0.02 * mean and few.min() < 0.02 * mean


def test_light_that_nothing_blocks_is_known_without_rays(plain):
    scene, _ = plain
    patches = mesh(scene)
    corners = patches.corners[-1:]
    sources = build_sources(corners, patches.centre[-1:], patches.normal[-1:], patches.area[-1:])
    point = np.random.default_rng(0).uniform(0, 10, (200, 3)) * (1, 1, 0)
    up = np.tile((0.0, 0.0, 1.0), (200, 1))
    light = unblocked_irradiance(point, up, sources, corners, np.array([[1.0, 2.0, 3.0]]))
    exact = near_form_factors(point, up, np.repeat(corners, 200, axis=0))
    np.testing.assert_allclose(light, exact[:, None] * (1, 2, 3), rtol=0.02)


def test_steps_are_told_as_a_part_of_their_stage():
    def steps():
        yield Progress("Final gather", 0.0)
        yield Progress("Final gather", 1.0)
        return 7

    told = []
    result = yield_all(scaled(steps(), 0.25, 0.75), told)
    assert result == 7 and [step.fraction for step in told] == [0.25, 0.75]


def yield_all(steps, told):
    """Run a generator to its end, note what it yields, and return its result."""
    while True:
        try:
            told.append(next(steps))
        except StopIteration as end:
            return end.value


def test_the_final_gather_of_a_fine_mesh_goes_forward_only(plain, monkeypatch):
    scene, _ = plain
    scene = replace(scene, lamps=[PointLamp("lamp", np.ones(3), np.array((2.0, 2.0, 3.0)))])
    quality = replace(qualities.QUALITIES["preview"], corners=600, samples=300)
    monkeypatch.setitem(qualities.QUALITIES, "preview", quality)
    monkeypatch.setattr(corners, "_BLOCK", 1000)
    told = []
    yield_all(bake(scene, Settings(quality="preview")), told)
    done = [step.fraction for step in told if step.stage == "Final gather"]
    assert len(done) > 15 and done == sorted(done) and done[0] == 0


def test_corners_of_large_faces_among_fine_ones_look_for_themselves(plain):
    scene, floor = plain
    group = smooth_groups(scene)
    receivers = corner_receivers(scene)
    lone = sparse_glances.lone_corners(receivers.point, mesh_edges(scene, group), 100)
    assert lone[group[~floor]].all() and not lone[group[floor]].any()
    few = sparse_glances.lone_corners(receivers.point, mesh_edges(scene, group), 8)
    assert 0 < few.sum() <= 8 and lone[few].all()
    samples = SimpleNamespace(slope=np.zeros(1), region=np.zeros(1, int), cluster=np.zeros(len(lone), int))
    nobody = np.zeros(len(lone), bool)
    looking = sparse_glances._closer(samples, np.ones(1), nobody, nobody, lone, 1000)
    assert np.array_equal(looking, np.flatnonzero(lone))
