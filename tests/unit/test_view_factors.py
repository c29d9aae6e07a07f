# SPDX-License-Identifier: GPL-3.0-or-later
"""Factors between polygons against published numbers, independent quadrature, closure, and rays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core import form_factor_matrix
from core.errors import RadiosityError
from core.exact import visible_exchange
from core.form_factors import point_to_polygon

TOLERANCE = 1e-4
SIGMA = 5.670374419e-8

# OpenViewFactor's verification set: parallel squares of side a at distance 1; squares that share an edge, 1 x depth.
PARALLEL = {
    0.1: 0.003162056838754,
    0.2: 0.012403977313243,
    0.4: 0.046137416744875,
    0.6: 0.093362337840650,
    1: 0.199824895698387,
    2: 0.415253283577147,
    4: 0.632036430013860,
    10: 0.826994522397256,
}
PERPENDICULAR = {
    0.1: 0.281887806787901,
    0.2: 0.271036935697358,
    0.4: 0.250319555056282,
    0.6: 0.231469999626555,
    1: 0.200043776075403,
    2: 0.149299795886762,
    4: 0.101358700221681,
    10: 0.055023979528411,
}


def square(side, height=0.0, *, up=True):
    corners = side * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]) + (0, 0, height)
    return corners if up else corners[::-1]


def disc(n_sides, radius, height, *, up=True):
    angle = 2 * np.pi * np.arange(n_sides) / n_sides
    corners = np.column_stack((radius * np.cos(angle), radius * np.sin(angle), np.full(n_sides, float(height))))
    return corners if up else corners[::-1]


def area(polygon):
    arms = polygon - polygon[0]
    return np.linalg.norm(np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0)) / 2


def areas(polygons):
    return np.array([area(np.asarray(polygon)) for polygon in polygons])


def turned(polygons, angle, about):
    c, s = np.cos(angle), np.sin(angle)
    return [(p - about) @ np.array([(c, s, 0), (-s, c, 0), (0, 0, 1)]) + about for p in polygons]


def mean_over(receiver, source, n_points=60):
    """Return the factor between quadrilaterals by a graded product rule over the exact factor of points."""
    t, w = np.polynomial.legendre.leggauss(n_points)
    t, w = (t + 1) / 2, w / 2
    # Corners and edges may touch: the points crowd there.
    t, w = t * t * (3 - 2 * t), 6 * w * t * (1 - t)
    u, v = (grid.ravel()[:, None] for grid in np.meshgrid(t, t))
    a, b, c, d = receiver
    points = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    normal = np.cross(b - a, d - a)
    m = len(points)
    F = point_to_polygon(points, np.tile(normal / np.linalg.norm(normal), (m, 1)), np.tile(source, (m, 1, 1)))
    return F @ np.outer(w, w).ravel()


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


def check_reciprocity(F, A):
    exchange = A[:, None] * F
    np.testing.assert_allclose(exchange, exchange.T, rtol=1e-12, atol=1e-15 * A.max())


@pytest.mark.parametrize(("side", "expected"), PARALLEL.items())
def test_parallel_squares(side, expected):
    F = form_factor_matrix([square(side), square(side, 1, up=False)])
    np.testing.assert_allclose(F, [[0, expected], [expected, 0]], atol=1e-9)


@pytest.mark.parametrize(("depth", "expected"), PERPENDICULAR.items())
def test_perpendicular_squares_with_a_shared_edge(depth, expected):
    floor = np.array([(0, 0, 0), (1, 0, 0), (1, depth, 0), (0, depth, 0)], float)
    wall = np.array([(0, 0, 0), (0, 0, depth), (1, 0, depth), (1, 0, 0)], float)
    np.testing.assert_allclose(form_factor_matrix([floor, wall]), [[0, expected], [expected, 0]], atol=1e-8)


def test_cube(box):
    F = form_factor_matrix(box())
    opposite = np.kron(np.eye(3), [[0, 1], [1, 0]])
    expected = 0.199824896 * opposite + 0.200043776 * (1 - opposite - np.eye(6))
    np.testing.assert_allclose(F, expected, atol=1e-8)
    np.testing.assert_allclose(F.sum(axis=1), 1, atol=1e-9)


def test_obstructed_squares():
    # View3D's square-obstruction example; the first number by independent integration.
    F = form_factor_matrix([square(1), square(1, 1, up=False), square(0.5, 0.5)])
    assert F[0, 1] == pytest.approx(0.149868672, abs=1e-6)
    assert F[2, 1] == pytest.approx(0.415253, abs=1e-6)
    assert F[1, 2] == pytest.approx(0.103813, abs=1e-6)
    assert F[0, 2] == F[2, 0] == 0


L_ROWS = {
    0: (0, 0.113153, 0.378093, 0.027473, 0.032894, 0.182354, 0.133017, 0.133017),
    1: (0.339458, 0, 0.318994, 0, 0, 0.098682, 0.121433, 0.121433),
    2: (0.567139, 0.159497, 0, 0, 0, 0.041210, 0.116077, 0.116077),
    6: (0.239430, 0.072860, 0.139292, 0.139292, 0.072860, 0.239430, 0, 0.096836),
}


def test_pinney_and_bean_room(l_room):
    polygons = l_room()
    np.testing.assert_allclose(areas(polygons), (9, 3, 6, 6, 3, 9, 5, 5))
    F = form_factor_matrix(polygons, closed=True)
    for row, expected in L_ROWS.items():
        np.testing.assert_allclose(F[row], expected, atol=3e-5)
    np.testing.assert_allclose(F.sum(axis=1), 1, atol=1e-9)
    check_reciprocity(F, areas(polygons))
    # View3D's own rows sum to 1 within 1.2e-5 only before it scales them.
    F = form_factor_matrix(polygons, tolerance=3e-6, closed=True)
    for row, expected in L_ROWS.items():
        np.testing.assert_allclose(F[row], expected, atol=1.2e-5)


def test_heat_of_the_pinney_and_bean_room(l_room):
    # View3D's viewht example: emissivity 0.9, one surface 10 K colder, net flux of every surface [W/m^2].
    polygons = l_room()
    F = form_factor_matrix(polygons, closed=True)
    emitted = SIGMA * np.where(np.arange(8) == 2, 283.15, 293.15) ** 4
    J = np.linalg.solve(np.eye(8) - 0.1 * F, 0.9 * emitted)
    q = 0.9 * (F @ J - emitted)
    np.testing.assert_allclose(q, (-17.06, -14.83, 47.48, -0.3343, -0.4035, -1.7684, -6.775, -6.775), atol=0.006)
    assert areas(polygons) @ q == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    ("rho", "ceiling", "floor", "wall"),
    [
        (0.2, 1.009615386, 0.048044545, 0.048085017),
        (0.5, 1.090909098, 0.181745826, 0.181836269),
        (0.8, 1.551724154, 0.689551071, 0.689681194),
    ],
)
def test_cube_with_a_bright_ceiling(box, rho, ceiling, floor, wall):
    F = form_factor_matrix(box(), closed=True)
    B = np.linalg.solve(np.eye(6) - rho * F, np.eye(6)[1])
    np.testing.assert_allclose(B, (floor, ceiling, wall, wall, wall, wall), atol=1e-8)
    assert ((1 - rho) * F @ B).sum() == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("n_sides", [24, 64])
@pytest.mark.parametrize(("radius", "other"), [(1.0, 1.0), (0.2, 1.0), (3.0, 0.5)])
def test_coaxial_discs(n_sides, radius, other):
    F = form_factor_matrix([disc(n_sides, radius, 0), disc(n_sides, other, 1, up=False)])
    # Closed form for circles of the same areas, which regular polygons of many sides come close to.
    round_off = np.sqrt(n_sides / (2 * np.pi) * np.sin(2 * np.pi / n_sides))
    a, b = radius * round_off, other * round_off
    X = 1 + (1 + b**2) / a**2
    circles = (X - np.sqrt(X**2 - 4 * (b / a) ** 2)) / 2
    assert F[0, 1] == pytest.approx(circles, abs=2 / n_sides**3)


@pytest.mark.parametrize("angle", [5, 30, 60, 120, 150, 175])
@pytest.mark.parametrize("depth", [0.2, 1.0])
def test_oblique_squares_with_a_shared_edge(angle, depth):
    c, s = depth * np.cos(np.radians(angle)), depth * np.sin(np.radians(angle))
    floor = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    wall = np.array([(0, 0, 0), (0, c, s), (1, c, s), (1, 0, 0)], float)
    F = form_factor_matrix([floor, wall])
    assert F[1, 0] == pytest.approx(mean_over(wall, floor), abs=2e-6)


@pytest.mark.parametrize("corner", [(1.0, 1.0, 0.0), (0.5, 1.0, 0.0), (0.5, 0.5, 0.0), (1.0, 1.0, 1e-4)])
def test_polygons_that_touch_in_a_corner(corner):
    wall = np.array([(0, 0, 0), (0.3, 0.9, 0.2), (0.1, 1.0, 0.9), (-0.2, 0.1, 0.7)]) * (1, -1, 1)
    wall[2] = wall[1] + wall[3] - wall[0]
    floor = square(1)
    F = form_factor_matrix([floor, wall + corner])
    assert F[1, 0] == pytest.approx(mean_over(wall + corner, floor, 120), abs=5e-6)
    assert F[1, 0] > 0.01


def test_polygons_across_each_others_planes():
    first, second = square(2), np.array([(1, -0.5, -1), (1, 1.5, -1), (1.5, 1.5, 1), (1.5, -0.5, 1)])
    F = form_factor_matrix([first, second])
    G = form_factor_matrix([first[::-1], second])
    assert F[1, 0] == pytest.approx(mean_over(second, first, 200), abs=5e-5)
    # Light from its other side reaches the part below the plane.
    assert G[1, 0] == pytest.approx(mean_over(second, first[::-1], 200), abs=5e-5)
    assert min(F[1, 0], G[1, 0]) > 0.01


@pytest.mark.parametrize("shared", [1e-3, 50.0])
def test_long_strips_and_extreme_ratios(shared):
    floor = np.array([(0, 0, 0), (shared, 0, 0), (shared, 1, 0), (0, 1, 0)], float)
    wall = np.array([(0, 0, 0), (0, 0, 1), (shared, 0, 1), (shared, 0, 0)], float)
    F = form_factor_matrix([floor, wall])
    # Howell's configuration C-14.
    h = w = 1 / shared
    a, b, c = 1 + w * w, 1 + h * h, 1 + h * h + w * w
    logs = np.log(a * b / c) + w * w * np.log(w * w * c / (a * (c - 1))) + h * h * np.log(h * h * c / (b * (c - 1)))
    angles = w * np.arctan(1 / w) + h * np.arctan(1 / h) - np.hypot(h, w) * np.arctan(1 / np.hypot(h, w))
    assert F[0, 1] == pytest.approx((angles + logs / 4) / (np.pi * w), abs=1e-7)


def test_concave_polygons_are_the_sum_of_their_parts():
    horseshoe = np.array(
        [(0, 0, 0), (3, 0, 0), (3, 3, 0), (2, 3, 0), (2, 1, 0), (1, 1, 0), (1, 3, 0), (0, 3, 0)], float
    )
    parts = [
        np.array([(a, 0, 0), (b, 0, 0), (b, d, 0), (a, d, 0)], float) for a, b, d in ((0, 1, 3), (1, 2, 1), (2, 3, 3))
    ]
    other = square(3, 2, up=False)
    whole = form_factor_matrix([other, horseshoe])
    split = form_factor_matrix([other, *parts])
    assert whole[0, 1] == pytest.approx(split[0].sum(), abs=1e-9)
    # As a blocker, too.
    below = square(3, -1)
    assert form_factor_matrix([other, below, horseshoe])[0, 1] == pytest.approx(
        form_factor_matrix([other, below, *parts])[0, 1], abs=1e-5
    )


def test_units_and_place_do_not_matter(l_room):
    F = form_factor_matrix(l_room())
    moved = [1e-3 * polygon + (5, -7, 11) for polygon in l_room()]
    np.testing.assert_allclose(form_factor_matrix(moved), F, atol=5e-5)


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


def test_closed_keeps_reciprocity_and_scales_rows(box):
    # A seam of a millimetre is left open.
    polygons = box((2, 1, 1))
    polygons[1] = polygons[1] * (0.999, 1, 1)
    F = form_factor_matrix(polygons, closed=True)
    np.testing.assert_allclose(F.sum(axis=1), 1, atol=1e-9)
    check_reciprocity(F, areas(polygons))
    np.testing.assert_allclose(F, form_factor_matrix(polygons), atol=2e-3)


def test_closed_lets_a_box_rest_on_the_floor_but_no_sheet_see_its_back(box):
    polygons = [*box((4, 3, 2.5)), *box((1, 1, 1), (1, 1, 0), inward=False)]
    F = form_factor_matrix(polygons, closed=True)
    assert F[6, 0] == pytest.approx(1, abs=1e-6)
    np.testing.assert_allclose(F.sum(axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(F[7:], form_factor_matrix(polygons)[7:], atol=1e-4)
    sheet = square(1, 1) + (1, 1, 0)
    F = form_factor_matrix([*box((4, 3, 2.5)), sheet, sheet[::-1]], closed=True)
    assert F[6, 7] == F[7, 6] == 0


@pytest.mark.parametrize("missing", range(6))
def test_closed_refuses_an_open_box(box, missing):
    polygons = box()
    del polygons[missing]
    with pytest.raises(RadiosityError, match="do not enclose"):
        form_factor_matrix(polygons, closed=True)


def test_closed_refuses_what_cannot_be_scaled():
    # Each of two plates sees nothing but the other, and their areas differ.
    plates = [square(1), square(1.01, 0.01, up=False) - (0.005, 0.005, 0)]
    assert form_factor_matrix(plates).sum(axis=1).min() > 0.95
    with pytest.raises(RadiosityError, match="contradict"):
        form_factor_matrix(plates, closed=True)


def test_a_tolerance_out_of_reach_is_an_error(monkeypatch):
    monkeypatch.setattr(visible_exchange, "MOST_ROUNDS", 4)
    with pytest.raises(RadiosityError, match="allow a larger one"):
        form_factor_matrix([square(1), square(1, 1, up=False), square(0.5, 0.5)], tolerance=1e-12)


@pytest.mark.parametrize(
    ("polygon", "message"),
    [
        (np.zeros((4, 2)), r"Polygon 1: expected corners of shape \(k, 3\)"),
        ([(0, 0, 0), (1, 0)], "Polygon 1: expected an array"),
        (square(1)[:2], "Polygon 1: has 2 corners"),
        (np.zeros((3, 3)), "Polygon 1: has no area"),
        (np.array([(0, 0, 0), (1, 0, 0), (3, 0, 0)]), "Polygon 1: has no area"),
        (np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)]), "Polygon 1: is not planar"),
        (np.array([(0, 0, 0), (1, 0, 0), (1, np.nan, 0)]), "Polygon 1: a coordinate is not finite"),
    ],
)
def test_bad_polygons_are_named(polygon, message):
    with pytest.raises(RadiosityError, match=message):
        form_factor_matrix([square(1), polygon])


@pytest.mark.parametrize("tolerance", [0, -1, 1, np.nan])
def test_tolerance_is_checked(tolerance):
    with pytest.raises(RadiosityError, match="between 0 and 1"):
        form_factor_matrix([square(1)], tolerance=tolerance)
