# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of the exchange: points that integrate, groups that hold everybody, shafts that miss no blocker."""

from dataclasses import replace

import numpy as np
import pytest

from core.dense.blocks import block
from core.dense.exchange import OF_I, OF_J, exchange
from core.dense.quadrature import gauss_points, surface_points, turned_points
from core.dense.shadows import hidden, hidden_pairs
from core.dense.shafts import as_blockers, between, compact_groups
from core.meshing import mesh
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.surfaces import Occluding
from core.scene import Scene
from core.sequences import spread_points

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


def parallelograms(count, rng):
    a, u, v = rng.normal(size=(3, count, 3))
    return np.stack((a, a + u, a + u + v, a + v), axis=1)


def loose_triangles(corners, slack=0.0):
    """Return occluding triangles as they stand, shape (t, 3, 3)."""
    index = np.arange(3 * len(corners)).reshape(-1, 3)
    return Occluding(corners.reshape(-1, 3), index, np.arange(len(corners)), np.full(len(corners), slack))


def halved(quads):
    return loose_triangles(quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3))


@pytest.mark.parametrize("rule", [turned_points, lambda corners: gauss_points(corners, 2)])
def test_four_points_integrate_cubics_on_parallelograms(rule):
    corners = parallelograms(50, np.random.default_rng(0))
    fine, fine_weights = gauss_points(corners, 6)
    points, weights = rule(corners)
    for powers in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 2, 0), (1, 1, 1), (0, 0, 3), (2, 1, 0)):
        exact = (fine_weights * np.prod(fine**powers, axis=2)).sum(axis=1)
        np.testing.assert_allclose((weights * np.prod(points**powers, axis=2)).sum(axis=1), exact, atol=1e-12)


def test_half_of_all_pairs_of_points_integrate_products_up_to_cubics():
    rng = np.random.default_rng(1)
    (p, _), (q, _) = (turned_points(parallelograms(20, rng)) for _ in range(2))
    both = np.concatenate((p[:, OF_I], q[:, OF_J]), axis=2)
    every = np.concatenate((np.repeat(p, 4, axis=1), np.tile(q, (1, 4, 1))), axis=2)
    for _ in range(40):
        powers = np.bincount(rng.integers(0, 6, rng.integers(1, 4)), minlength=6)
        mean, expected = (np.prod(points**powers, axis=2).mean(axis=1) for points in (both, every))
        np.testing.assert_allclose(mean, expected, atol=1e-12)
    # And they are the same pairs whichever patch comes first.
    assert {*zip(OF_I, OF_J, strict=True)} == {*zip(OF_J, OF_I, strict=True)}


def test_triangles_are_integrated_as_quads_that_end_in_a_point():
    triangle = SQUARE[None, [0, 1, 2, 2]]
    for points, weights in (turned_points(triangle), gauss_points(triangle, 3)):
        np.testing.assert_allclose(weights.sum(axis=1), 1.0)
        np.testing.assert_allclose((weights[..., None] * points).sum(axis=1), [[2 / 3, 1 / 3, 0]], atol=1e-12)


def test_points_of_bent_patches_lie_on_their_surface():
    bent = np.array([[(0, 0, 0), (1, 0, 0), (1, 1, 1), (0, 1, 0)]], float)
    points, stretch = surface_points(bent, np.array([0.3]), np.array([0.7]))
    np.testing.assert_allclose(points, [[(0.3, 0.7, 0.21)]])
    np.testing.assert_allclose(stretch, [[np.sqrt(1 + 0.3**2 + 0.7**2)]])


def test_a_patch_without_area_has_finite_points_and_weights():
    for points, weights in (turned_points(np.zeros((1, 4, 3))), gauss_points(np.zeros((1, 4, 3)), 3)):
        assert np.isfinite(points).all()
        assert weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("axes", [1, 2, 4])
def test_spread_points_fill_a_cube_evenly(axes):
    points = spread_points(2048, axes)
    assert ((points >= 0.0) & (points < 1.0)).all()
    np.testing.assert_allclose(points.mean(axis=1), 0.5, atol=2e-3)
    np.testing.assert_allclose(np.cov(points), np.eye(axes) / 12 if axes > 1 else 1 / 12, atol=2e-3)


def test_every_patch_is_in_one_compact_group(box):
    patches = mesh(Scene.from_polygons(box((4.0, 1.0, 1.0)), 0.5, 1.0, divisions=np.full(6, 20)))
    groups = compact_groups(patches.centre, patches.normal, 100)
    np.testing.assert_array_equal(np.sort(np.concatenate(groups)), np.arange(2400))
    for group in groups:
        assert len(group) <= 100
        assert np.ptp(patches.normal[group], axis=0).max() == 0.0
        assert np.ptp(patches.centre[group], axis=0).max() <= 1.1


def test_patches_in_one_place_are_grouped_all_the_same():
    groups = compact_groups(np.ones((500, 3)), np.tile((0.0, 0.0, 1.0), (500, 1)), 100)
    assert max(map(len, groups)) <= 100 and sum(map(len, groups)) == 500


@pytest.mark.parametrize("seed", range(4))
def test_shafts_and_shadows_agree_with_rays(seed):
    rng = np.random.default_rng(seed)
    quads = parallelograms(12, rng)
    triangles = rng.normal(size=(12, 3, 3))
    for occluding in (loose_triangles(triangles), halved(quads)):
        blockers = as_blockers(occluding)
        rays = BruteForceOccluders(occluding, growth=0.0)
        for _ in range(5):
            # Two clouds some way apart, and segments between their points.
            i = rng.normal(size=(4, 6, 3)) * 0.3 + rng.normal(size=3)
            j = rng.normal(size=(4, 7, 3)) * 0.3 + rng.normal(size=3)
            starts, ends = np.broadcast_arrays(i[:, :, None], j[:, None])
            expected = rays.blocked(starts.reshape(-1, 3), ends.reshape(-1, 3)).reshape(4, 6, 7)
            inside = between(i.reshape(-1, 3), j.reshape(-1, 3), blockers)
            np.testing.assert_array_equal(hidden(blockers, inside, i, j), expected)
            np.testing.assert_array_equal(hidden_pairs(blockers, inside, starts, ends), expected)


def test_a_shaft_drops_what_is_beside_behind_and_in_the_planes_of_its_ends():
    floor, ceiling = SQUARE, SQUARE + (0, 0, 2)
    flat = SQUARE * 0.4 + 0.3
    standing = np.array([(0.2, 0.5, 0.1), (0.8, 0.5, 0.1), (0.8, 0.5, 1.9), (0.2, 0.5, 1.9)])
    walls = [floor, ceiling, flat + (0, 0, -0.3 - 1.0), flat + (0, 0, 2.5), flat + (3, 0, 0.7), standing + (0, -2, 0)]
    blockers = as_blockers(halved(np.array([*walls, flat + (0, 0, 0.7), standing])))
    np.testing.assert_array_equal(blockers.edges, 4)
    np.testing.assert_array_equal(between(floor, ceiling, blockers), [6, 7])


def test_nothing_blocks_where_nothing_is():
    blockers = as_blockers(loose_triangles(np.zeros((0, 3, 3))))
    assert len(between(SQUARE, SQUARE + 1, blockers)) == 0


def test_triangles_without_area_block_nothing():
    line = np.array([[(0, 0, 0), (1, 1, 1), (2, 2, 2)]], float)
    assert len(as_blockers(loose_triangles(np.concatenate((line, line)))).edges) == 0


def test_light_does_not_leak_through_the_seams_of_a_fan():
    angle = np.linspace(0.0, 2.0 * np.pi, 14)
    rim = np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1)
    fan = np.stack((np.zeros((13, 3)), rim[:-1], rim[1:]), axis=1)
    blockers = as_blockers(loose_triangles(fan))
    # From above to below through points on the spokes, where two triangles meet.
    spokes = np.linspace(0.0, 0.9, 50)[:, None, None] * rim[:-1]
    starts = spokes.reshape(-1, 3) + (0.3, -0.2, 1.0)
    ends = spokes.reshape(-1, 3) - (0.3, -0.2, 1.0)
    assert hidden_pairs(blockers, np.arange(13), starts, ends).all()


def test_a_patch_whose_corner_only_rises_above_the_other_is_not_forgotten():
    # The tip of a tilted square comes up through the plane of the other: no point of the rule sees it.
    tilted = SQUARE @ np.array([(0, 1, 0), (0, 0, -1), (-1, 0, 0)], float) * 0.5 + (0.0, 0.3, 0.02)
    patches = mesh(Scene.from_polygons([SQUARE, tilted[::-1]], 0.5, 1.0))
    x = exchange(patches, None, None)
    both = np.array([0]), np.array([1])
    exchanged, segments = block(x, *both)
    far, _ = block(replace(x, near=0.0), *both)
    assert segments == 0 and exchanged[0, 0] > 0.0
    assert far is None or far[0, 0] == 0.0
    np.testing.assert_allclose(block(x, *both[::-1])[0], exchanged.T, rtol=1e-12)
