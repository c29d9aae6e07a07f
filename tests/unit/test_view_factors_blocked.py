# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact view factors where something stands in between, beside rays and sums over closed rooms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core import form_factor_matrix
from tests.unit.flat_shapes import areas, check_reciprocity, disc, square, turned


def ray_factors(polygons, row, n_rays, rng):
    """Return row `row` of the matrix by rays; convex polygons only."""
    receiver = np.asarray(polygons[row])
    fan = np.stack([(receiver[0], receiver[k], receiver[k + 1]) for k in range(1, len(receiver) - 1)])
    triangle = rng.choice(len(fan), n_rays, p=areas(fan) / areas(fan).sum())
    share = np.sort(rng.random((n_rays, 2)), axis=1)
    a, b, c = fan[triangle].transpose(1, 0, 2)
    x = a * share[:, :1] + b * (share[:, 1:] - share[:, :1]) + c * (1 - share[:, 1:])
    frame, _ = np.linalg.qr(np.column_stack((np.cross(b[0] - a[0], c[0] - a[0]), rng.normal(size=(3, 2)))))
    frame[:, 0] *= np.sign(frame[:, 0] @ np.cross(b[0] - a[0], c[0] - a[0]))
    radius, angle = np.sqrt(rng.random(n_rays)), 2 * np.pi * rng.random(n_rays)
    rays = np.stack((np.sqrt(1 - radius**2), radius * np.cos(angle), radius * np.sin(angle)), axis=1) @ frame.T
    nearest, hit = np.full(n_rays, np.inf), np.full(n_rays, -1)
    for index, polygon in enumerate(polygons):
        normal = np.cross(polygon[1] - polygon[0], polygon[2] - polygon[0])
        slope = rays @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (polygon[0] - x) @ normal / slope
            at = x + distance[:, None] * rays
        inside = (distance > 1e-9) & (distance < nearest)
        for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            inside &= (at - start) @ np.cross(normal, end - start) >= 0
        if index != row:
            nearest[inside] = distance[inside]
            hit[inside] = np.where(slope[inside] < 0, index, -1)
    return np.bincount(hit[hit >= 0], minlength=len(polygons)) / n_rays


def volume(axes):
    """Return the determinant; LAPACK's goes wrong on numbers too small to be normal."""
    return np.cross(axes[0], axes[1]) @ axes[2]


@settings(max_examples=20, deadline=None)
@given(
    arrays(float, (3, 3), elements=st.floats(-1, 1)).filter(lambda axes: abs(volume(axes)) > 0.1),
    st.floats(0.2, 1.0),
)
def test_convex_boxes_close_and_are_reciprocal(axes, taper):
    # A frustum, sheared by any matrix: six planar faces, oblique, that all touch.
    low = np.array([(x, y) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float) - 0.5
    corners = np.vstack((np.insert(low, 2, 0, axis=1), np.insert(taper * low, 2, 1, axis=1))) @ axes
    faces = [(0, 1, 2, 3), (7, 6, 5, 4), *((k, k + 4, (k + 1) % 4 + 4, (k + 1) % 4) for k in range(4))]
    order = 1 if volume(axes) > 0 else -1
    polygons = [corners[list(face)][::order] for face in faces]
    F = form_factor_matrix(polygons)
    np.testing.assert_allclose(F.sum(axis=1), 1, atol=1e-6)
    check_reciprocity(F, areas(polygons))
    assert (F >= 0).all()


def furnished(box):
    """Return a room of 4 m x 3 m x 2.5 m with two turned boxes that stand on its floor, their undersides left out."""
    first = turned(box((1, 1, 1.5), (1, 1, 0), inward=False)[1:], 0.3, (1.5, 1.5, 0))
    second = turned(box((0.6, 0.6, 0.8), (2.6, 1, 0), inward=False)[1:], -0.4, (2.9, 1.3, 0))
    return [*box((4, 3, 2.5)), *first, *second]


def test_boxes_on_a_floor(box):
    polygons = furnished(box)
    F = form_factor_matrix(polygons)
    # The floor under the boxes sees their insides only; all other rows are complete.
    expected = np.ones(len(polygons))
    expected[0] -= (1 + 0.36) / 12
    np.testing.assert_allclose(F.sum(axis=1), expected, atol=3e-4)
    check_reciprocity(F, areas(polygons))
    G = form_factor_matrix(polygons, tolerance=1e-3)
    np.testing.assert_allclose(G, F, atol=1e-3)


@pytest.mark.parametrize("row", [0, 4, 6, 12])
def test_boxes_on_a_floor_match_rays(box, row):
    polygons = furnished(box)
    n_rays = 60_000
    F = form_factor_matrix(polygons)[row]
    rays = ray_factors(polygons, row, n_rays, np.random.default_rng(row))
    error = np.sqrt(np.maximum(F * (1 - F), 1e-4) / n_rays)
    assert (np.abs(rays - F) < 4 * error).all()


def test_a_pillar_from_floor_to_ceiling(box):
    polygons = [*box((4, 3, 2.5)), *box((0.3, 0.3, 2.5), (1.5, 1.2, 0), inward=False)[2:]]
    F = form_factor_matrix(polygons)
    expected = np.ones(len(polygons))
    expected[:2] -= 0.09 / 12
    np.testing.assert_allclose(F.sum(axis=1), expected, atol=2e-4)


def test_thin_legs_and_grazing_sheets_are_not_overlooked():
    floor, ceiling = square(4), square(4, 2.5, up=False)
    leg = np.array([(1, 1, 0), (1.02, 1, 0), (1.02, 1, 0.5), (1, 1, 0.5)], float)
    # A sheet whose lower edge rises from the floor by 2 mm over a metre.
    sheet = np.array([(2, 1, 0), (3, 1.2, 0.002), (3, 1.2, 1.0), (2, 1, 1.0)], float)
    blocked = form_factor_matrix([floor, ceiling, leg, sheet])
    fine = form_factor_matrix([floor, ceiling, leg, sheet], tolerance=4e-6)
    np.testing.assert_allclose(blocked, fine, atol=5e-5)


def test_a_disc_between_discs_matches_rays():
    polygons = [disc(24, 1, 0), disc(24, 1, 1, up=False), disc(24, 0.5, 0.5)]
    F = form_factor_matrix(polygons)
    n_rays = 100_000
    rays = ray_factors(polygons, 1, n_rays, np.random.default_rng(5))
    assert np.abs(rays - F[1]).max() < 4 * np.sqrt(0.25 / n_rays)
    assert F[0, 1] < 0.6 * form_factor_matrix(polygons[:2])[0, 1]


def test_light_through_a_door(box):
    # Two rooms, one opening of 1 m x 2 m in the wall between them.
    rooms = box((4, 3, 2.5)) + box((4, 3, 2.5), (4, 0, 0))
    left = [
        np.array([(4, y0, z0), (4, y1, z0), (4, y1, z1), (4, y0, z1)], float)[::-1]
        for y0, y1, z0, z1 in ((0, 1, 0, 2.5), (2, 3, 0, 2.5), (1, 2, 2, 2.5))
    ]
    walls = [p for p in rooms if not np.allclose(p[:, 0], 4)] + left + [p[::-1] for p in left]
    F = form_factor_matrix(walls, tolerance=1e-3)
    np.testing.assert_allclose(F.sum(axis=1), 1, atol=5e-3)
    through = F[:5, 5:10].sum(axis=1)
    assert (through > 0.005).all()


def test_a_wall_with_a_hole_lets_no_more_through_than_the_hole():
    # Two sheets a tenth of a metre apart, then joined by a third.
    source, target = square(1), square(1, 2, up=False)
    sheet = [
        np.array([(-5, -5, 1), (0.45, -5, 1), (0.45, 6, 1), (-5, 6, 1)], float),
        np.array([(0.55, -5, 1), (6, -5, 1), (6, 6, 1), (0.55, 6, 1)], float),
    ]
    slit = np.array([(0.45, -5, 1), (0.55, -5, 1), (0.55, 6, 1), (0.45, 6, 1)], float)
    F = form_factor_matrix([source, target, *sheet])
    closed = form_factor_matrix([source, target, *sheet, slit])
    assert closed[0, 1] == pytest.approx(0, abs=1e-7)
    fine = form_factor_matrix([source, target, *sheet], tolerance=2e-6)
    assert F[0, 1] == pytest.approx(fine[0, 1], abs=3e-5)
    assert 0 < F[0, 1] < form_factor_matrix([source, slit[::-1]])[0, 1]


def test_coplanar_and_averted_polygons_exchange_nothing():
    assert not form_factor_matrix([square(1), square(1) + (1, 0, 0), square(1, -1, up=False)]).any()
    assert form_factor_matrix([]).shape == (0, 0)
    assert form_factor_matrix([square(1)]).shape == (1, 1)
