# SPDX-License-Identifier: GPL-3.0-or-later
"""Panes of glass reflect a part of the light that comes to them, and dim whatever goes through."""

import numpy as np
import pytest

from core.lighting.lamps import SkyLamp, SunLamp, lamp_irradiance, scene_reach
from core.meshing import mesh
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.panes import Panes, ior_of, reflected_share
from core.occlusion.surfaces import separate_polygons
from core.scene import BOTH, FRONT, Scene
from core.visibility import scene_occluders
from tests.unit.lamps import SQUARE, UP

GLASS = 1.5
# What a surface of glass reflects of diffuse light from outside (Walsh 1926), and from within.
OF_DIFFUSE, OF_DIFFUSE_WITHIN = 0.0918, 1 - (1 - 0.0918) / 1.5**2


def light_under(panes, lamp, ior=GLASS, **fields):
    """Return the light of a lamp below horizontal panes, over what it is without them."""
    points = np.column_stack((np.zeros(64), np.linspace(-0.5, 0.5, 64), np.zeros(64)))

    def light(**more):
        scene = Scene.from_polygons(panes, occludes=np.zeros(len(panes)), shades=np.zeros(len(panes)), **more)
        occluders, reach = scene_occluders(scene, mesh(scene)), scene_reach(scene)
        return lamp_irradiance([lamp], points, np.tile(UP, (64, 1)), occluders, rays=256, reach=reach).mean()

    return light(ior=np.full(len(panes), ior), **fields) / light()


def test_fresnel_at_angles_that_are_known():
    brewster = 1 / np.sqrt(1 + GLASS**2)
    cosine, ior = np.array([1, brewster, 1e-6, 1, 0.74, 0.76]), np.array([GLASS] * 3 + [1 / GLASS] * 3)
    found = reflected_share(cosine, ior)
    # There only light across the plane of incidence is reflected.
    expected = [0.04, 0.5 * ((GLASS**2 - 1) / (GLASS**2 + 1)) ** 2, 1, 0.04, 1]
    np.testing.assert_allclose(found[:5], expected, rtol=1e-4)
    assert found[5] < 0.5


def test_fresnel_of_diffuse_light():
    cosine = np.sqrt((np.arange(100_000) + 0.5) / 100_000)
    assert reflected_share(cosine, np.full(100_000, GLASS)).mean() == pytest.approx(OF_DIFFUSE, abs=1e-4)


def test_an_index_of_refraction_from_what_it_reflects():
    np.testing.assert_allclose(ior_of(np.array([0, 0.04, ((2.4 - 1) / (2.4 + 1)) ** 2])), [1, 1.5, 2.4])


@pytest.mark.parametrize("slope", [0.0, 0.5, 2.0])
def test_the_sun_through_a_pane_of_two_surfaces(slope):
    way = np.array((slope, 0, 1)) / np.hypot(slope, 1)
    pane = [90 * SQUARE + (0, 0, 1.1), 90 * SQUARE[::-1] + (0, 0, 1)]
    left = 1 - reflected_share(way[2:], np.array([GLASS]))[0]
    assert light_under(pane, SunLamp("sun", np.ones(3), way)) == pytest.approx(left**2, rel=1e-6)


def test_the_sky_through_the_surface_of_glass():
    sky = SkyLamp("sky", np.ones((1, 1, 3)))
    facing = light_under([900 * SQUARE[::-1] + UP], sky)
    assert facing == pytest.approx(1 - OF_DIFFUSE, abs=0.005)
    # Out of glass, light that comes too flat is reflected wholly.
    assert light_under([900 * SQUARE + UP], sky) == pytest.approx(1 - OF_DIFFUSE_WITHIN, abs=0.01)


@pytest.mark.parametrize("method", ["hierarchical", "gathering", "shooting"])
@pytest.mark.parametrize("tint", [(0.5, 0.5, 0.5), (0.9, 0.5, 0.1)])
def test_light_of_surfaces_is_dimmed_by_what_it_goes_through(light, tint, method):
    floor, pane, lamp = SQUARE, 9 * SQUARE + 0.4 * UP, SQUARE[::-1] + UP

    def floor_light(color):
        clear = [True, False, True]
        scene = Scene.from_polygons(
            [floor, pane, lamp],
            reflectance=[[0.5] * 3, [0] * 3, [0] * 3],
            emission=[[0] * 3, [0] * 3, [1] * 3],
            tint=[[1] * 3, color, [1] * 3],
            occludes=clear,
            shades=clear,
        )
        return light(scene, method, subdivide=4).corner_radiance[:4]

    np.testing.assert_allclose(floor_light(tint), 0.5 * floor_light((1, 1, 1)), rtol=1e-3)


@pytest.mark.parametrize("faces", [1, 16])
def test_a_white_screen_that_is_half_clear_keeps_a_furnace_even(light, box, faces):
    """It scatters half of the light and lets the other half through, so that nobody can tell that it is there."""
    size, cells = 3.0 / faces**0.5, range(int(faces**0.5))
    square = 0.5 * size * (SQUARE + (1, 1, 0))
    screen = [square + (0.5 + size * i, 0.5 + size * j, 1.5) for i in cells for j in cells]
    walls = box((4, 4, 3), inward=True)
    count = len(walls), faces
    scene = Scene.from_polygons(
        [*walls, *screen],
        reflectance=0.5,
        emission=np.repeat([1.0, 0.0], count)[:, None] * np.ones(3),
        tint=np.repeat([1.0, 0.5], count)[:, None] * np.ones(3),
        occludes=np.repeat([True, False], count),
        shades=np.repeat([True, False], count),
        sides=np.repeat([FRONT, BOTH], count),
    )
    found = light(scene, "hierarchical", quality="medium", subdivide=4)
    radiance = np.pi * found.corner_radiance / np.repeat([2.0, 1.0], 4 * np.array(count))[:, None]
    np.testing.assert_allclose(radiance, 1.0, rtol=0.02)
    assert found.report.row_sum.mean == pytest.approx(1.0, abs=0.01)
    assert abs(found.report.energy.escaped) < 0.02 * found.report.energy.emitted


def panes(polygons, **fields):
    """Return panes of polygons, and the scene that they are."""
    clear = np.zeros(len(polygons), bool)
    scene = Scene.from_polygons(polygons, occludes=clear, shades=clear, **fields)
    return Panes(scene, ~clear), scene


def test_segments_take_on_the_tint_of_each_pane_that_blocks_them_by_itself():
    rng = np.random.default_rng(3)
    across = rng.normal(size=(2, 40, 3))
    quads = rng.random((40, 1, 3)) + 0.2 * np.stack([across[0], across[1], -across[0], -across[1]], axis=1)
    tint = rng.uniform(0.2, 0.9, (40, 3))
    many, scene = panes(list(quads), tint=tint)
    origins, targets = rng.random((2, 500, 3))
    expected = np.ones((500, 3))
    for number in range(40):
        one = BruteForceOccluders(separate_polygons(scene, np.arange(40) == number))
        expected[one.blocked(origins, targets)] *= tint[number]
    assert (expected[:, 0] < 0.1).any()
    np.testing.assert_allclose(many.tint(origins, targets), expected, rtol=1e-9)


def test_a_curtain_before_an_open_sheet_of_glass_is_no_glass_that_light_leaves():
    start, end = np.zeros((1, 3)), np.array([(2.0, 0, 1)])
    sheet, curtain = 90 * SQUARE + 0.8 * UP, 90 * SQUARE[::-1] + 0.2 * UP
    flat, _ = panes([sheet], ior=[GLASS])
    both, _ = panes([sheet, curtain], ior=[GLASS, 1.0], tint=[[1.0] * 3, [0.5] * 3])
    into, _ = panes([sheet[::-1], curtain], ior=[GLASS, 1.0], tint=[[1.0] * 3, [0.5] * 3])
    assert flat.tint(start, end).max() < 1e-9 and both.tint(start, end).max() < 1e-9
    assert into.tint(start, end).min() > 0.4
