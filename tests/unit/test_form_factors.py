# SPDX-License-Identifier: GPL-3.0-or-later
"""The point kernels against closed forms, closure, and a hemisphere of rays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core.form_factors import BLOCK, centre_to_centre, point_to_polygon, points_to_polygons

UP = np.array([0.0, 0.0, 1.0])
# A wall of 1 m x 1 m over the y axis, radiating towards +x.
WALL = np.array([(0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)], float)


def ceiling(width, depth, height=1.0):
    """Return a rectangle over the first quadrant that radiates down."""
    return np.array([(0, 0, height), (0, depth, height), (width, depth, height), (width, 0, height)], float)


def factor(point, normal, polygon):
    return point_to_polygon(np.array([point], float), np.array([normal], float), np.asarray(polygon, float)[None])[0]


def under_a_corner(width, depth):
    """Hamilton and Morgan 1952: rectangle parallel to the point's surface, one corner above the point at height 1."""
    a, b = np.hypot(1, width), np.hypot(1, depth)
    return (width / a * np.arctan(depth / a) + depth / b * np.arctan(width / b)) / (2 * np.pi)


@pytest.mark.parametrize("width", [1e-3, 0.3, 1.0, 20.0])
@pytest.mark.parametrize("depth", [0.05, 1.0, 7.0])
def test_parallel_rectangle_matches_the_closed_form(width, depth):
    assert factor((0, 0, 0), UP, ceiling(width, depth)) == pytest.approx(under_a_corner(width, depth), rel=1e-9)


@pytest.mark.parametrize("distance", [1e-6, 0.01, 0.4, 3.0, 50.0])
def test_wall_standing_on_the_horizon_matches_the_closed_form(distance):
    # Half the difference of two angles, one of them seen under a slant (Hamilton and Morgan 1952).
    slant = np.hypot(distance, 1)
    expected = (np.arctan(1 / distance) - distance / slant * np.arctan(1 / slant)) / (2 * np.pi)
    assert factor((distance, 0, 0), UP, WALL) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("point", "normal", "expected"),
    [
        ((0, 0.5, 0), UP, 0.5),  # at the wall's foot
        ((1e-12, 0.5, 0), UP, 0.5),
        ((0, 0, 0), UP, 0.25),  # at the corner of its foot
        ((0, 2, 0), UP, 0.0),  # in its plane, beside it
        ((-0.1, 0.5, 0), UP, 0.0),  # behind it
        ((0.1, 0.5, 2), UP, 0.0),  # above it, looking up
        ((0, 0.5, 0.5), (1, 0, 0), 0.0),  # on it, looking the same way
        ((0, 0.5, 0.5), (-1, 0, 0), 0.0),  # back to back
        ((0, 0.5, 0.5), UP, 0.5),  # on it, looking along
        ((1, 0.5, 0.5), (1, 0, 0), 0.0),  # looking away
    ],
)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_on_edges_and_in_planes_have_their_limits(point, normal, expected, dtype):
    F = point_to_polygon(np.array([point], dtype), np.array([normal], dtype), WALL[None].astype(dtype))
    assert F.dtype == dtype
    assert F[0] == pytest.approx(expected, abs=2e-5 if dtype is np.float32 else 1e-6)


@pytest.mark.parametrize("bend", [1e-7, 1e-4, 1e-2])
def test_a_bent_face_beside_the_point_shows_no_more_than_what_stands_out(bend):
    # Two opposite corners stand above the horizon, two below, as rounding leaves faces that are coplanar.
    for z in ((-1, 5, -1, 1), (1, -1, 5, -1), (-0.2, 1, -3, 0.5)):
        bent = np.column_stack(([-0.47, -0.16, -0.16, -0.47], [-0.56, -0.56, -0.19, -0.19], bend * np.array(z)))
        for polygon in (bent, bent[::-1]):
            assert factor((0, 0, 0), UP, polygon) <= 5 * bend


@settings(max_examples=60, deadline=None)
@given(
    arrays(float, 3, elements=st.floats(0.001, 0.999)),
    arrays(float, 3, elements=st.floats(-1, 1)).filter(lambda n: np.linalg.norm(n) > 0.1),
)
def test_a_room_fills_the_view_of_every_point_inside(point, normal):
    # Whatever crosses the horizon is clipped, whatever is close stays exact, or the sum would not be 1.
    x, y, z = (np.array(v) for v in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)))
    low = [np.array([0 * a, a, a + b, b]) for a, b in ((x, y), (y, z), (z, x))]
    walls = np.array([*low, *(side[::-1] + n for side, n in zip(low, (z, x, y), strict=True))])
    F = points_to_polygons(point[None], normal[None] / np.linalg.norm(normal), walls)
    assert F.sum() == pytest.approx(1, abs=1e-9)
    assert (F >= 0).all()


def random_pairs(rng, m):
    """Return m points, normals and parallelograms or triangles strewn around them."""
    corner, a, b = rng.normal(size=(3, m, 3))
    polygons = np.stack((corner, corner + a, corner + a + b, corner + b), axis=1)
    polygons[::2, 3] = polygons[::2, 2]
    normals = rng.normal(size=(m, 3))
    return 0.3 * rng.normal(size=(m, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True), polygons


def test_both_forms_agree_in_both_precisions():
    rng = np.random.default_rng(3)
    points, normals, polygons = random_pairs(rng, 200)
    exact = np.stack(
        [
            point_to_polygon(np.tile(x, (200, 1)), np.tile(n, (200, 1)), polygons)
            for x, n in zip(points, normals, strict=True)
        ]
    )
    assert np.count_nonzero(exact) > 5000
    np.testing.assert_allclose(points_to_polygons(points, normals, polygons), exact, atol=1e-12)
    single = points_to_polygons(points, normals, polygons, np.float32)
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, exact, atol=2e-6)
    paired = point_to_polygon(*(a.astype(np.float32) for a in (points, normals, polygons)))
    np.testing.assert_allclose(paired, np.diagonal(exact), atol=2e-5)


def test_small_far_polygons_keep_their_digits_in_single_precision():
    point, normal = np.array([[1.0, 2.0, 0.0]]), UP[None]
    polygon = (0.01 * ceiling(1, 1, 0) + (4, 3, 3))[None]
    exact = points_to_polygons(point, normal, polygon)
    # F is A cos cos / (pi r^2) with A = 1e-4: a millionth, out of terms that are a thousand times as large.
    assert points_to_polygons(point, normal, polygon, np.float32) == pytest.approx(exact, rel=1e-4)
    singles = (a.astype(np.float32) for a in (point, normal, polygon))
    assert point_to_polygon(*singles) == pytest.approx(exact[0], rel=1e-3)


def test_polygons_across_the_horizon_match_a_hemisphere_of_rays():
    rng = np.random.default_rng(7)
    n_rays = 40_000
    points, normals, polygons = random_pairs(rng, 24)
    F = point_to_polygon(points, normals, polygons)
    # Cosine-weighted rays: their share that meets the polygon's front is the form factor.
    radius, angle = np.sqrt(rng.random(n_rays)), 2 * np.pi * rng.random(n_rays)
    local = np.stack((radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)), axis=1)
    for x, n, polygon, expected in zip(points, normals, polygons, F, strict=True):
        frame, _ = np.linalg.qr(np.column_stack((n, rng.normal(size=(3, 2)))))
        frame[:, 0] = n
        rays = local @ frame[:, [1, 2, 0]].T
        arms = polygon - x
        sides = np.cross(arms, np.roll(arms, -1, axis=0))
        # Seen from the front the edges run counter-clockwise: rays pass every edge's plane on the same side.
        plane = np.cross(arms[1] - arms[0], arms[2] - arms[0])
        hits = (rays @ sides.T <= 0).all(axis=1) & (rays @ plane < 0) & (arms[0] @ plane < 0)
        error = np.sqrt(max(expected * (1 - expected), 1e-4) / n_rays)
        assert abs(hits.mean() - expected) < 4.5 * error


def test_more_pairs_than_a_block_give_the_same_as_few():
    points, normals, polygons = random_pairs(np.random.default_rng(1), BLOCK + 10)
    F = point_to_polygon(points, normals, polygons)
    np.testing.assert_array_equal(F[BLOCK:], point_to_polygon(points[BLOCK:], normals[BLOCK:], polygons[BLOCK:]))


def test_nothing_in_nothing_out():
    assert point_to_polygon(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4, 3))).shape == (0,)
    assert points_to_polygons(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((0, 4, 3))).shape == (2, 0)


def test_centres_far_apart_exchange_as_the_exact_kernel_says():
    polygon = 0.01 * ceiling(1, 1, 0) + (1, 2, 3)
    x, n = np.zeros(3), np.array([0.6, 0, 0.8])
    approximate = centre_to_centre(x, n, polygon.mean(axis=0), -UP, np.array(1e-4))
    assert approximate == pytest.approx(factor(x, n, polygon), rel=1e-5)


def test_centre_to_centre_is_the_formula_and_broadcasts():
    centres = np.array([(0, 0, 0), (0, 0, 2), (0, 0, 2), (0, 0, 0)], float)
    normals = np.array([UP, -UP, UP, -UP])
    F = centre_to_centre(centres[:, None], normals[:, None], centres, normals, np.array([1.0, 3.0, 1.0, 1.0]))
    expected = np.zeros((4, 4))
    expected[0, 1], expected[1, 0] = 3 / (4 * np.pi), 1 / (4 * np.pi)
    np.testing.assert_allclose(F, expected, rtol=1e-15)
