# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own tree: what only shows where there is one."""

import numpy as np
import pytest

pytest.importorskip("bpy")

from core import visibility
from core.occlusion import blender_tree
from core.occlusion.blender_tree import BVHOccluders
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.surfaces import Occluding
from core.visibility import SurfaceOccluders


def soup(corners):
    """Return loose triangles (t, 3, 3)."""
    return Occluding(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3), np.arange(len(corners)))


def scattered(rng, count, size):
    return rng.uniform(0, 1, (count, 1, 3)) + rng.uniform(-size, size, (count, 3, 3))


@pytest.mark.parametrize(("count", "size"), [(50, 0.5), (1000, 0.1)])
def test_nearest_agrees_with_brute_force(count, size):
    rng = np.random.default_rng(count)
    scene = soup(scattered(rng, count, size))
    start, along = rng.uniform(0, 1, (1500, 3)), rng.normal(size=(1500, 3))
    face, distance, front = BVHOccluders(scene).nearest(start, along)
    expected = BruteForceOccluders(scene).nearest(start, along)
    np.testing.assert_array_equal(face, expected[0])
    np.testing.assert_allclose(distance, expected[1], atol=1e-4)
    np.testing.assert_array_equal(front, expected[2])
    assert 0.1 < np.mean(face >= 0) < 1


def test_rays_start_on_surfaces_and_do_not_hit_them():
    rng = np.random.default_rng(1)
    corners = scattered(rng, 300, 0.2)
    weight = rng.dirichlet([1, 1, 1], 300)
    start, along = (weight[:, :, None] * corners).sum(axis=1), rng.normal(size=(300, 3))
    for found in (BVHOccluders(soup(corners)), BruteForceOccluders(soup(corners))):
        face, distance, _ = found.nearest(start, along)
        assert np.all(face != np.arange(300))
        assert np.all(distance > 0)


def test_slack_moves_the_plane():
    square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)
    height = np.array([-0.02, -0.005, 0.005, 0.02])
    start = np.column_stack([np.full((4, 2), 0.4), height])
    end = np.array([[0.4, 0.3, 1.0]] * 4)
    for kind in (BVHOccluders, BruteForceOccluders, SurfaceOccluders):
        loose = Occluding(square.reshape(-1, 3), np.arange(6).reshape(2, 3), np.zeros(2, int), np.full(2, 0.01))
        np.testing.assert_array_equal(kind(loose).blocked(start, end), [True, False, False, False])
        np.testing.assert_array_equal(kind(soup(square)).blocked(start, end), [True, True, False, False])


def test_needles_do_not_grow_out_of_bounds():
    needle = np.array([[[0, 0, 0], [1, 0, 0], [0.5, 1e-5, 0]]])
    grown = blender_tree._outgrown(needle)
    assert np.abs(grown - needle).max() < 0.05
    equilateral = np.array([[[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0]]])
    np.testing.assert_allclose(blender_tree._outgrown(equilateral)[0, :2, 1], -blender_tree.GROWTH)


def test_the_tree_answers_for_few_segments(monkeypatch):
    rng = np.random.default_rng(2)
    scene = soup(scattered(rng, 400, 0.1))
    ends = rng.uniform(0, 1, (2, 1000, 3))
    expected = BruteForceOccluders(scene).blocked(*ends)
    asked = []

    class Counted(BVHOccluders):
        def blocked(self, origins, targets):
            asked.append(len(origins))
            return super().blocked(origins, targets)

    monkeypatch.setattr("core.occlusion.single_rays.BVHOccluders", Counted)
    mixed = SurfaceOccluders(scene)
    np.testing.assert_array_equal(mixed.blocked(*ends), expected)
    assert asked == []
    np.testing.assert_array_equal(mixed.blocked(ends[0][:50], ends[1][:50]), expected[:50])
    assert asked == [50]
    monkeypatch.setattr(visibility, "ENOUGH", 40)
    np.testing.assert_array_equal(mixed.blocked(ends[0][:50], ends[1][:50]), expected[:50])
    assert asked == [50]
