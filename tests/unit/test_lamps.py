# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps and sky against closed forms: alone, behind things, and in a whole bake."""

import numpy as np
import pytest

from core.lighting.lamps import AreaLamp, Cone, PointLamp, SkyLamp, SunLamp, lamp_irradiance
from core.scene import Scene
from tests.unit.lamps import COLOUR, DOWN, UP, WHITE, Nothing, averaged, disc, lit


def test_nothing_shines_without_lamps():
    assert not lamp_irradiance([], np.zeros((2, 3)), np.tile(UP, (2, 1)), Nothing(), rays=4, reach=1.0).any()


@pytest.mark.parametrize("soft", [False, True])
def test_a_point_of_light_weakens_with_the_square(soft):
    lamp = PointLamp("point", COLOUR, np.array((1, 0, 2.0)), soft=soft)
    at = [(1, 0, 0), (0, 0, 0), (1, 0, 4)]
    np.testing.assert_allclose(lit(lamp, at), [3 / 4, 3 * 2 / 5**1.5, 0])


def test_a_ball_shines_like_a_point_and_a_turning_disc_does_not():
    # A disc of radiance I / (pi r^2) from its axis: pi L sin^2.
    ball = PointLamp("ball", WHITE, 2 * UP, radius=1.0)
    turning = PointLamp("disc", WHITE, 2 * UP, radius=1.0, soft=True)
    np.testing.assert_allclose([lit(ball, (0, 0, 0))[0], lit(turning, (0, 0, 0))[0]], [1 / 4, 1 / 5])


def test_inside_a_ball_it_is_bright_all_around():
    lamp = PointLamp("ball", WHITE, np.zeros(3), radius=2.0)
    np.testing.assert_allclose(lit(lamp, [(0, 0, 0.5), (1, 1, 0)]), 1 / 4)


@pytest.mark.parametrize("elevation", [0.5, 0.2, 0.0, -0.3])
def test_a_disc_that_the_horizon_cuts_is_the_sum_of_its_parts(elevation):
    angle = 1.6
    lamp = SunLamp("sun", WHITE, np.array((np.cos(elevation), 0, np.sin(elevation))), angle)
    _, _, light = averaged(lamp, (0, 0, 0), UP)
    # Even radiance 1 / (pi sin^2) over the disc's solid angle.
    solid = 2 * np.pi * (1 - np.cos(angle / 2))
    expected = light.mean() * solid / (np.pi * np.sin(angle / 2) ** 2)
    assert lit(lamp, (0, 0, 0))[0] == pytest.approx(expected, rel=2e-3)


def test_a_sun_shines_by_the_cosine_everywhere():
    lamp = SunLamp("sun", COLOUR, np.array((0.6, 0, 0.8)), 0.01)
    normals = np.array([(0, 0, 1), (0.6, 0, 0.8), (-1, 0, 0)], float)
    np.testing.assert_allclose(lit(lamp, [(0, 0, 0), (1e5, 0, 0), (0, 0, 0)], normals), [2.4, 3, 0], atol=1e-6)


def test_a_sky_of_one_colour_in_the_open():
    lamp = SkyLamp("sky", COLOUR.reshape(1, 1, 3))
    np.testing.assert_allclose(lit(lamp, np.zeros((3, 3)), np.eye(3)), 3 * np.pi)


def test_a_sky_by_direction():
    # Radiance that grows with the height, 1 + z: E = pi + 2 pi / 3 on a floor, pi below a wall's normal.
    height = np.sin(np.pi * ((np.arange(64) + 0.5) / 64 - 0.5))
    sky = np.repeat(np.repeat(1 + height[:, None, None], 128, axis=1), 3, axis=2)
    normals = np.array([(0, 0, 1), (1, 0, 0), (0, 0, -1)], float)
    expected = np.pi + 2 * np.pi / 3 * np.array((1, 0, -1))
    np.testing.assert_allclose(lit(SkyLamp("sky", sky), np.zeros((3, 3)), normals), expected, rtol=1e-3)


@pytest.mark.parametrize("way", [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)])
def test_the_pixels_of_a_sky_are_where_its_samples_find_them(way):
    # One bright quarter: u = 1/2 - atan2(y, x) / (2 pi).
    sky = np.zeros((8, 16, 3))
    column = int((0.5 - np.arctan2(way[1], way[0]) / (2 * np.pi)) * 16) % 16
    sky[2:6, [column, column - 1]] = 1
    lamp = SkyLamp("sky", sky)
    _, _, light = averaged(lamp, (0, 0, 0), way)
    assert lit(lamp, (0, 0, 0), way)[0] == pytest.approx(np.pi * light[:, 0].mean(), rel=0.02)
    assert lit(lamp, (0, 0, 0), way)[0] > 3 * max(lit(lamp, (0, 0, 0), -np.array(way))[0], 0.01)


def test_a_disc_seen_from_its_axis():
    # E = pi L r^2 / (r^2 + h^2)
    heights = np.array((0.05, 0.5, 2.0, 20.0))
    points = np.column_stack((np.zeros((4, 2)), 2 - heights))
    np.testing.assert_allclose(lit(disc(), points), np.pi * 0.25 / (0.25 + heights**2), rtol=2e-3)


def test_a_rectangle_is_lambert_s_polygon():
    # A square of side 1 at height 1, over its corner: Hottel's corner formula.
    lamp = AreaLamp("square", WHITE, np.array((0.5, 0.5, 1)), np.array((0.5, 0, 0)), np.array((0, 0.5, 0)), DOWN)
    corner = 2 / (2 * np.pi) / np.sqrt(2) * np.arctan(1 / np.sqrt(2))
    np.testing.assert_allclose(lit(lamp, (0, 0, 0)), np.pi * corner)
    assert not lit(lamp, (0, 0, 2), DOWN).any()


@pytest.mark.parametrize("turned", [1, -1])
def test_the_sides_may_run_either_way_round(turned):
    u, v = np.array((0.5, 0, 0)), turned * np.array((0, 0.5, 0))
    lamp = AreaLamp("square", WHITE, UP, u, v, DOWN)
    # Four corners of half the side.
    quarter = 1 / np.pi / np.sqrt(5) * np.arctan(1 / np.sqrt(5))
    np.testing.assert_allclose(lit(lamp, (0, 0, 0)), np.pi * 4 * quarter)


@pytest.mark.parametrize("ellipse", [False, True])
@pytest.mark.parametrize("spread", [0.2, 1.0, 2.5])
def test_a_grid_keeps_the_power(ellipse, spread):
    u, v = np.array((0.4, 0, 0)), np.array((0, 0.7, 0))
    lamp = AreaLamp("softbox", WHITE, UP, u, v, DOWN, ellipse=ellipse, spread=spread)
    side = np.linspace(-1, 1, 160)
    reach = 1 + np.tan(spread / 2)
    points = np.stack(np.meshgrid(reach * side, reach * side, [0.0]), axis=-1).reshape(-1, 3)
    power = lit(lamp, points).sum() * (reach * (side[1] - side[0])) ** 2
    area = 4 * 0.4 * 0.7 * (np.pi / 4 if ellipse else 1)
    # The widest one throws a few per cent beyond the points.
    assert power == pytest.approx(np.pi * area, rel=0.01 if spread < 2 else 0.05)


def test_a_spot_shines_within_its_cone():
    lamp = PointLamp("spot", WHITE, 2 * UP, cone=Cone(np.eye(3), np.pi / 2, 0.5))
    # On the axis; half way through the blend; just outside.
    rim = np.cos(np.pi / 4)
    half = np.arccos(rim + 0.5 * 0.5 * (1 - rim))
    points = [(0, 0, 0), (2 * np.tan(half), 0, 0), (2.01, 0, 0)]
    np.testing.assert_allclose(lit(lamp, points), [1 / 4, np.cos(half) ** 3 / 4 / 2, 0], rtol=1e-6)


def test_the_edge_of_a_large_spot_is_averaged():
    cone = Cone(np.eye(3), 1.0, 0.2)
    lamp = PointLamp("spot", WHITE, 2 * UP, radius=0.4, cone=cone)
    point = np.array((1.0, 0, 0))
    out, _, light = averaged(lamp, point, UP)
    whole = np.maximum(out @ UP, 0)
    bare = lit(PointLamp("ball", WHITE, 2 * UP, radius=0.4), point)[0]
    assert lit(lamp, point)[0] == pytest.approx(bare * light.mean() / whole.mean(), rel=0.01)


def test_a_narrow_beam_that_all_rays_miss_is_not_lost():
    # Receivers at the rim of a beam: little light, and few samples of the lamp that show any.
    lamp = AreaLamp("beam", WHITE, UP, np.array((2.0, 0, 0)), np.array((0, 2.0, 0)), DOWN, ellipse=True, spread=0.3)
    points = np.column_stack((np.linspace(2.05, 2.14, 50), np.zeros((50, 2))))
    expected = lamp.unshadowed(points, np.tile(UP, (50, 1)))[:, 0]
    assert (expected > 0).all()
    np.testing.assert_allclose(lit(lamp, points, rays=1), expected)


@pytest.mark.parametrize("method", ["gathering", "shooting"])
def test_a_lamp_lights_a_bake(box, light, method):
    # Closed and grey: what a lamp of 1 W brings in is absorbed; a little is lost to the patches' middles.
    lamp = PointLamp("bulb", WHITE / (4 * np.pi), np.full(3, 0.5))
    scene = Scene.from_polygons(box(), 0.5, 0.0, divisions=np.full(6, 8), lamps=[lamp])
    bake = light(scene, method=method, tolerance=1e-6)
    assert bake.report.energy.emitted == pytest.approx(3, rel=0.01)
    assert bake.report.energy.error < 0.01
    # All bounces: 1 W / (1 - rho) over 6 m^2.
    mean = np.average(bake.solution.irradiance, axis=0, weights=bake.patches.area)
    np.testing.assert_allclose(mean, 1 / 0.5 / 6, rtol=0.02)
    assert (bake.corner_radiance > 0).all()
