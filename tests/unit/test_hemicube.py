# SPDX-License-Identifier: GPL-3.0-or-later
"""The hemicube against its formulas, the exact kernel and what is behind what."""

import numpy as np
import pytest

from core.errors import RadiosityError
from core.form_factors import points_to_polygons
from core.hemicube import Hemicube

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("resolution", [2, 16, 100])
def test_deltas_sum_to_one(resolution):
    deltas = Hemicube(resolution).deltas
    assert deltas.shape == (3 * resolution**2,)
    assert (deltas > 0).all()
    assert deltas.sum() == pytest.approx(1, abs=1e-12)


def test_deltas_are_those_of_cohen_and_greenberg():
    n = 64
    deltas = Hemicube(n).deltas
    centres = (np.arange(n) + 0.5) * 2 / n - 1
    x, y = centres[None, :], centres[:, None]
    area = (2 / n) ** 2
    top = area / (np.pi * (x**2 + y**2 + 1) ** 2)
    z = centres[n // 2 :, None]
    side = z * area / (np.pi * (x**2 + z**2 + 1) ** 2)
    np.testing.assert_allclose(deltas[: n * n], top.ravel(), rtol=1e-3)
    for face in np.split(deltas[n * n :], 4):
        np.testing.assert_allclose(face, side.ravel(), rtol=5e-3, atol=0.02 * side.max() / n)


@pytest.mark.parametrize("resolution", [0, 1, 31, -4])
def test_resolution_is_checked(resolution):
    with pytest.raises(RadiosityError, match="even number"):
        Hemicube(resolution)


@pytest.mark.parametrize("seed", range(6))
def test_unobstructed_factors_agree_with_the_exact_kernel(seed):
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    corner, a, b = rng.normal(size=(3, 3))
    corner = normal - (a + b) / 2 + 0.5 * corner
    polygon = np.array([corner, corner + a, corner + a + b, corner + b])
    # Whichever way it is turned, one of the two shows its front.
    pair = np.array([polygon, polygon[::-1]])
    exact = points_to_polygons(np.zeros((1, 3)), normal[None], pair)[0]
    cube = Hemicube(128)
    for one, expected in zip(pair, exact, strict=True):
        F = cube.factors(np.zeros(3), normal, one[None])
        # Half a pixel along a border of at most eight pixels' rows.
        assert F[0] == pytest.approx(expected, abs=4 / 128 * cube.deltas.max() * 128)
    assert exact.max() > 0.005


def test_a_room_of_patches_fills_every_pixel(box):
    quads = np.array(box((2.0, 1.0, 1.0)))
    t = np.linspace(0, 1, 6)
    u, v = (g.ravel()[:, None, None] for g in np.meshgrid(t[:-1], t[:-1]))
    s = t[1]
    cells = [
        np.concatenate((u, v), 1),
        np.concatenate((u + s, v), 1),
        np.concatenate((u + s, v + s), 1),
        np.concatenate((u, v + s), 1),
    ]
    weights = [
        np.stack(
            ((1 - c[:, 0]) * (1 - c[:, 1]), c[:, 0] * (1 - c[:, 1]), c[:, 0] * c[:, 1], (1 - c[:, 0]) * c[:, 1]), axis=1
        )[:, :, 0]
        for c in cells
    ]
    patches = np.concatenate([np.stack([w @ quad for w in weights], axis=1) for quad in quads])
    # On the floor, off the pattern of its patches: its own and the coplanar ones must not be in the way.
    point = np.array([0.71, 0.37, 0.0])
    F = Hemicube(64).factors(point, UP, patches)
    assert F.sum() == pytest.approx(1, abs=1e-12)
    exact = points_to_polygons(point[None], UP[None], patches)[0]
    assert np.abs(F - exact).max() < 0.01
    assert np.abs(F - exact).mean() < 5e-4


def square(height, size=1.0, down=True):
    """Return a square about the z axis."""
    corners = size * np.array([(-1, -1, 0), (-1, 1, 0), (1, 1, 0), (1, -1, 0)]) + (0, 0, height)
    return corners if down else corners[::-1]


def test_the_nearest_polygon_wins_from_either_side():
    far, near = square(2, 2.0), square(1, 0.5)
    cube = Hemicube(64)
    alone = cube.factors(np.zeros(3), UP, np.array([far]))[0]
    blocker = cube.factors(np.zeros(3), UP, np.array([near]))[0]
    for order in ([far, near], [near, far]):
        F = cube.factors(np.zeros(3), UP, np.array(order))
        assert sorted(F) == pytest.approx(sorted([alone - blocker, blocker]), abs=1e-12)
    # Its back hides as well but radiates nothing.
    F = cube.factors(np.zeros(3), UP, np.array([far, near[::-1]]))
    assert F == pytest.approx([alone - blocker, 0], abs=1e-12)


def test_seen_names_the_polygon_in_every_pixel():
    polygon, front = Hemicube(32).seen(np.zeros(3), UP, np.array([square(1, 3.0, down=False)]))
    top, sides = np.split(polygon, [32 * 32])
    assert (top == 0).all()
    # At height 1 and up to 3 away, the square reaches down to a third of the sides' height.
    assert set(sides) == {0, -1}
    assert not front.any()


def test_what_is_below_the_horizon_or_in_the_plane_is_not_seen():
    below, around = square(-1), square(0, 2.0, down=False)
    polygon, _ = Hemicube(16).seen(np.zeros(3), UP, np.array([below, around]))
    assert (polygon == -1).all()
    assert Hemicube(16).factors(np.zeros(3), UP, np.zeros((0, 4, 3))).shape == (0,)


def test_a_polygon_across_the_horizon_counts_with_its_upper_part():
    wall = np.array([(1, -1, -1), (1, -1, 1), (1, 1, 1), (1, 1, -1)], float)
    upper = wall.copy()
    upper[:, 2] = np.maximum(upper[:, 2], 0)
    F = Hemicube(64).factors(np.zeros(3), UP, np.array([wall]))
    assert F[0] == pytest.approx(points_to_polygons(np.zeros((1, 3)), UP[None], upper[None])[0, 0], abs=1e-3)
    assert F[0] > 0.1
