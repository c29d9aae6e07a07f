# SPDX-License-Identifier: GPL-3.0-or-later
"""Factors between polygons against published numbers, independent quadrature, closure, and rays."""

import numpy as np
import pytest

from core import form_factor_matrix
from core.form_factors import point_to_polygon
from tests.unit.flat_shapes import areas, check_reciprocity, disc, square

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
