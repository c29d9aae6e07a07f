# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole solutions against what is known exactly: scenes times methods, as renderers test their integrators."""

import numpy as np
import pytest

from core import form_factor_matrix
from core.dense.columns import column_transport
from core.dense.matrix import dense_transport
from core.gathering import gathering
from core.lighting.lamps import PointLamp
from core.meshing import mesh
from core.occlusion.surfaces import occluder_polygons
from core.progress import exhaust
from core.scene import BOTH, Scene
from core.shading import corner_colours, corner_irradiance
from core.shooting import shooting
from core.transport import DenseTransport
from core.visibility import scene_occluders

METHODS = ("gathering", "shooting")
FLOOR, CEILING = 0, 1  # of a box
STEFAN_BOLTZMANN = 5.670374419e-8  # [W m^-2 K^-4]

# How far what a patch receives in a furnace may be off: in the mean and anywhere, for each kernel. What a hemicube sees
# adds up to 1 for whoever gathers with it, but for a few pixels; whoever is shot at is seen from the shooter's centre.
CLEAR = {"exact": (2e-4, 4e-4), "centre": (3e-2, 0.75), "hemicube": (1e-5, 1e-5), "hemicube shot": (1e-5, 0.6)}
FURNISHED = {"exact": (1e-3, 1e-2), "centre": (3e-2, 0.4), "hemicube": (5e-4, 3e-3), "hemicube shot": (5e-4, 0.3)}
SCENES = {
    "cube": CLEAR,
    "corridor": CLEAR,
    "tetrahedron": CLEAR,
    "L-room": FURNISHED,
    "sheet that floats": FURNISHED,
    "block that floats": FURNISHED,
}


@pytest.fixture(scope="module")
def transports():
    """What has been computed for the scenes so far: reflectance changes no form factor."""
    return {}


@pytest.fixture
def enclosure(box, l_room):
    """A closed scene by name: `enclosure(name, reflectance, emission)`."""
    corners = np.array([(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)], float)
    sheet = np.array([(0.25, 0.2, 0.5), (0.75, 0.2, 0.5), (0.75, 0.8, 0.5), (0.25, 0.8, 0.5)])
    kinds = {
        "cube": (box(), 4),
        "corridor": (box((8.0, 1.0, 1.0)), 6),
        "tetrahedron": ([corners[list(face)] for face in ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2))], 4),
        "L-room": (l_room(), 3),
        "sheet that floats": ([*box(), sheet], 4),
        "block that floats": ([*box(), *box((0.3, 0.4, 0.2), (0.31, 0.22, 0.43), inward=False)], 4),
    }

    def build(name, reflectance, emission):
        polygons, divisions = kinds[name]
        sides = np.ones(len(polygons), dtype=int)
        if name == "sheet that floats":
            sides[-1] = BOTH
        return Scene.from_polygons(
            polygons, reflectance, emission, divisions=np.full(len(polygons), divisions), sides=sides
        )

    return build


def solve(method, transport, patches, **stop):
    if method == "gathering":
        return exhaust(gathering(transport, patches.emission, patches.reflectance, **stop))
    return exhaust(shooting(transport, patches.emission, patches.reflectance, iterations=10**6, **stop))


def transport_of(transports, name, scene, method, kernel):
    """Return the matrix or the columns of a scene, computed once."""
    key = name, method, kernel
    if key not in transports:
        patches = mesh(scene)
        occluders, surfaces = scene_occluders(scene, patches), occluder_polygons(scene, patches)
        if method == "gathering":
            transports[key] = exhaust(dense_transport(patches, occluders, kernel=kernel, surfaces=surfaces))
        else:
            transports[key] = column_transport(patches, occluders, kernel=kernel, surfaces=surfaces)
    return transports[key]


@pytest.mark.parametrize("rho", [0.0, 0.2, 0.5, 0.8, 0.9])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("name", "kernel"),
    [
        *((name, kernel) for name in SCENES for kernel in ("exact", "centre")),
        *((name, "hemicube") for name in ("cube", "tetrahedron", "sheet that floats", "block that floats")),
    ],
)
def test_in_a_furnace_everything_is_equally_bright(transports, enclosure, name, method, kernel, rho):
    scene = enclosure(name, rho, 1.0)
    patches = mesh(scene)
    solution = solve(method, transport_of(transports, name, scene, method, kernel), patches, tolerance=1e-6)
    bright = 1.0 / (1.0 - rho)
    shot = " shot" if (method, kernel) == ("shooting", "hemicube") else ""
    in_mean, anywhere = SCENES[name][kernel + shot]
    # An error of each bounce grows as the light itself does.
    assert np.average(solution.irradiance[:, 0], weights=patches.area) == pytest.approx(bright, rel=in_mean * bright)
    assert solution.irradiance == pytest.approx(bright, rel=anywhere * bright)
    H = corner_irradiance(scene, patches, solution.irradiance)
    corners = corner_colours(scene, H, H)
    assert corners == pytest.approx(bright / np.pi, rel=1e-6 + rho * anywhere * bright)


@pytest.mark.parametrize("method", METHODS)
def test_a_furnace_from_scene_to_colours(cube, light, method):
    bake = light(cube(reflectance=(0.2, 0.5, 0.8), emission=2.0, divisions=3), method=method, tolerance=1e-6)
    expected = np.broadcast_to(2.0 / (1.0 - np.array([0.2, 0.5, 0.8])) / np.pi, (24, 3))
    np.testing.assert_allclose(bake.corner_radiance, expected, rtol=3e-4)
    assert bake.report.row_sum.min == pytest.approx(1.0, abs=2e-4)
    # Once from everywhere, before any bounce.
    np.testing.assert_allclose(bake.corner_direct, 2.0, rtol=3e-4)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("rho", "ceiling", "floor", "wall"),
    [
        (0.2, 1.009615386, 0.048044545, 0.048085017),
        (0.5, 1.090909098, 0.181745826, 0.181836269),
        (0.8, 1.551724154, 0.689551071, 0.689681194),
    ],
)
def test_cube_with_one_patch_a_face(ceiling_lamp, light, method, rho, ceiling, floor, wall):
    bake = light(ceiling_lamp(rho), method=method, tolerance=1e-8)
    expected = np.array([floor, ceiling, wall, wall, wall, wall])
    np.testing.assert_allclose(bake.solution.radiosity, np.repeat(expected[:, None], 3, axis=1), rtol=1e-6)
    assert bake.report.energy.absorbed == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize("divisions", [1, 4, 8])
def test_direct_light_in_the_mean_of_a_face_is_its_form_factor(ceiling_lamp, light, divisions):
    bake = light(ceiling_lamp(0.5, divisions), method="gathering", iterations=1)
    mean = np.bincount(bake.patches.face, bake.solution.irradiance[:, 0]) / divisions**2
    np.testing.assert_allclose(mean, [0.199824896, 0.0, *[0.200043776] * 4], atol=1e-5)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["cube", "L-room", "block that floats"])
def test_what_is_emitted_is_absorbed(enclosure, light, name, method):
    emission = np.zeros((len(enclosure(name, 0.5, 0.0).sides), 3))
    emission[1] = (3.0, 2.0, 1.0)
    report = light(enclosure(name, (0.8, 0.5, 0.2), emission), method=method, tolerance=1e-6).report
    assert report.energy.error < 1e-5
    assert abs(report.energy.escaped) < 5e-3 * report.energy.emitted


@pytest.mark.parametrize("method", METHODS)
def test_light_escapes_between_two_squares(light, method):
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    scene = Scene.from_polygons([square, square[::-1] + (0, 0, 1)], 0.6, [(1.0, 1.0, 1.0), (0.0, 0.0, 0.0)])
    F, rho = 0.199824895698387, 0.6
    bake = light(scene, method=method, tolerance=1e-9)
    first = 1.0 / (1.0 - (rho * F) ** 2)
    np.testing.assert_allclose(bake.solution.radiosity[:, 0], [first, first * rho * F], rtol=1e-5)
    assert bake.report.energy.escaped == pytest.approx(3.0 * first * (1.0 + rho * F) * (1.0 - F), rel=1e-5)
    assert bake.report.energy.error < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_mean_illuminance_of_a_room_as_in_cie_171(box, light, method):
    # Test case 5.8, a cube of 4 m and 10 000 lm: exact for the mean of a closed room, wherever the lamp is.
    for rho, lux in ((0.0, 104.17), (0.2, 130.21), (0.5, 208.33), (0.8, 520.83), (0.9, 1041.67), (0.95, 2083.33)):
        emission = np.zeros((6, 3))
        emission[1] = 10_000.0 / 16.0
        scene = Scene.from_polygons(box((4.0, 4.0, 4.0)), rho, emission, divisions=np.full(6, 3))
        bake = light(scene, method=method, tolerance=1e-6)
        mean = np.average(bake.solution.irradiance[:, 0], weights=bake.patches.area)
        assert mean == pytest.approx(lux, rel=2e-3)


# Pinney and Bean, test 4: the third wall is 10 K colder than the rest.
HEAT = np.array([-17.06, -14.83, 47.48, -0.3343, -0.4038, -1.769, -6.776, -6.776])
EMITTED = 0.9 * STEFAN_BOLTZMANN * np.array([293.15, 293.15, 283.15, *[293.15] * 5]) ** 4


@pytest.mark.parametrize("method", METHODS)
def test_heat_in_the_l_room_as_published(l_room, method):
    polygons = l_room()
    scene = Scene.from_polygons(polygons, 0.1, np.repeat(EMITTED[:, None], 3, axis=1))
    F = form_factor_matrix(polygons, closed=True)
    transport = DenseTransport(F.astype(np.float32), scene.face_area, F.sum(axis=1), 64, 0)
    solution = solve(method, transport, scene, tolerance=1e-9)
    heat = 0.9 * solution.irradiance[:, 0] - EMITTED
    np.testing.assert_allclose(heat, HEAT, rtol=1e-3, atol=1e-3)
    assert heat @ scene.face_area == pytest.approx(0.0, abs=0.01)


def test_heat_in_the_meshed_l_room(l_room, light):
    polygons = l_room()
    emission = np.repeat(EMITTED[:, None], 3, axis=1)
    scene = Scene.from_polygons(polygons, 0.1, emission, divisions=np.full(8, 6))
    bake = light(scene, method="gathering", tolerance=1e-8)
    area = bake.patches.area
    mean = np.bincount(bake.patches.face, area * bake.solution.irradiance[:, 0]) / np.bincount(bake.patches.face, area)
    # A difference of large numbers, and walls that need not be as warm all over: 0.2 % of what is emitted.
    np.testing.assert_allclose(0.9 * mean - EMITTED, HEAT, atol=2e-3 * EMITTED[0])


@pytest.mark.parametrize("method", METHODS)
def test_methods_and_channels_agree(enclosure, light, method):
    emission = np.zeros((12, 3))
    emission[1] = 1.0
    one = light(enclosure("block that floats", (0.7, 0.3, 0.5), emission), method="gathering", tolerance=1e-7)
    other = light(enclosure("block that floats", (0.3, 0.5, 0.7), emission), method=method, tolerance=1e-7)
    np.testing.assert_allclose(other.corner_radiance[:, [2, 0, 1]], one.corner_radiance, rtol=3e-4, atol=1e-7)


@pytest.mark.parametrize("method", [*METHODS, "hierarchical"])
def test_light_is_direct_or_has_bounced(box, light, method):
    emission = np.zeros((12, 3))
    emission[CEILING] = (1.0, 2.0, 3.0)
    room = [*box(), *box((0.3, 0.3, 0.3), (0.2, 0.2, 0.01), inward=False)]
    lamp = PointLamp("bulb", np.full(3, 0.1), np.array((0.8, 0.8, 0.5)))

    def lit(rho, kind="combined"):
        scene = Scene.from_polygons(room, rho, emission, divisions=np.full(12, 2), lamps=[lamp])
        return light(scene, method=method, light=kind)

    black, grey = lit(0.0), lit(0.6)
    np.testing.assert_allclose(black.corner_direct, black.corner_irradiance, rtol=1e-5, atol=1e-9)
    assert (grey.corner_direct <= grey.corner_irradiance * (1 + 1e-6)).all()
    # What comes first does not depend on what comes after it.
    floor = slice(4 * FLOOR, 4 * FLOOR + 4)
    np.testing.assert_allclose(grey.corner_direct[floor].mean(0), black.corner_direct[floor].mean(0), rtol=0.02)
    assert (grey.corner_direct[floor] < 0.9 * grey.corner_irradiance[floor]).all()
    parts = lit(0.6, "direct").corner_radiance + lit(0.6, "indirect").corner_radiance
    np.testing.assert_allclose(parts, grey.corner_radiance, rtol=1e-5)
