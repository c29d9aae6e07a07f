# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that enters surfaces and leaves on their other side."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from core.hierarchy.pieces import quarters
from core.hierarchy.quality import QUALITIES
from core.hierarchy.relight import prepare_relighting, relight
from core.hierarchy.solve import solve
from core.meshing import mesh
from core.progress import exhaust
from core.scene import AUTO, BACK, BOTH, FRONT, Scene
from core.translucence import behind, piece_translucence
from core.visibility import scene_occluders
from tests.unit.conftest import box_polygons
from tests.unit.islands import sheet, upright

METHODS = ("hierarchical", "gathering", "shooting")
WALL = 6
# The wall at x = 0 of the first room.
LAMP = 4


def two_rooms(rho=0.5, tau=0.3, emission=1.0, divisions=4, **fields):
    """Return two rooms of a cubic metre side by side, with a translucent wall between them."""
    polygons = [*box_polygons((2, 1, 1)), upright(1.0, (0, 1), (0, 1))]
    transmittance = np.zeros((7, 3))
    transmittance[WALL] = tau
    fields = {"sides": [FRONT] * 6 + [BOTH], "divisions": [divisions] * 7} | fields
    return Scene.from_polygons(polygons, rho, emission, transmittance=transmittance, **fields)


def one_lit():
    """Return the two rooms with light in the first one only."""
    emission = np.zeros((7, 3))
    emission[LAMP] = (1.0, 2.0, 0.0)
    return two_rooms(tau=(0.4, 0.2, 0.3), emission=emission)


@pytest.mark.parametrize("method", METHODS)
def test_between_two_furnaces_nothing_changes_but_what_is_lost(light, method):
    """What leaves a wall is E + (rho + tau) H: as much as walls of that reflectance, where all is the same."""
    rho = np.full((7, 3), 0.5)
    rho[WALL] = (0.1, 0.2, 0.3)
    scene = two_rooms(rho, (0.4, 0.3, 0.2))
    found = light(scene, method=method, tolerance=1e-6)
    np.testing.assert_allclose(found.solution.radiosity, 2.0, rtol=2e-3)
    np.testing.assert_allclose(np.pi * found.corner_radiance, 2.0, rtol=2e-3)
    assert found.report.energy.error < 1e-5 and found.report.energy.escaped == pytest.approx(0.0, abs=0.02)


def test_the_room_behind_has_the_light_that_comes_through(light):
    scene = one_lit()
    sums = {}
    for method in METHODS:
        found = light(scene, method=method, tolerance=1e-4)
        patches, energy = found.patches, found.report.energy
        assert energy.error < 1e-3 and energy.absorbed == pytest.approx(energy.emitted, rel=1e-3)
        behind_wall = patches.centre[:, 0] > 1.0 + 1e-6
        sums[method] = (patches.area[behind_wall, None] * found.solution.radiosity[behind_wall]).sum(axis=0)
        assert (sums[method][:2] > 0.0).all() and sums[method][2] == 0.0
        # The tint is that of the wall.
        assert sums[method][0] > 0.9 * sums[method][1]
    for method in METHODS[1:]:
        np.testing.assert_allclose(sums[method], sums["hierarchical"], rtol=0.03)


def test_colors_tell_what_comes_from_either_side(light):
    kinds = {}
    for kind in ("combined", "direct", "indirect", "lighting"):
        bake = light(one_lit(), method="hierarchical", light=kind, quality="preview", tolerance=1e-6)
        scene = one_lit()
        kinds[kind] = bake.corner_radiance[scene.corner_face == WALL]
    np.testing.assert_allclose(kinds["direct"] + kinds["indirect"], kinds["combined"], rtol=1e-6, atol=1e-9)
    # The front looks into the dark room: what it shows straight from the lamp comes through.
    assert (kinds["direct"][:, :2] > 0.4 * kinds["combined"][:, :2]).all()
    rho, tau = 0.5, np.array([0.4, 0.2, 0.3])
    np.testing.assert_allclose(kinds["lighting"] * (rho + tau), kinds["combined"], rtol=1e-6, atol=1e-9)


def test_no_more_goes_out_than_comes_in():
    scene = two_rooms(rho=0.8, tau=0.8)
    np.testing.assert_allclose((scene.reflectance + scene.transmittance)[WALL], 0.99)
    assert scene.warnings == ()
    (line,) = two_rooms(tau=1.5).warnings
    assert "transmittance above 1 is taken as 1" in line


@pytest.mark.parametrize("polygon", [sheet((0, 0, 0), (2, 1)), [(0, 0, 0), (3, 0.1, 0), (0.2, 1, 0.5)]])
def test_pieces_know_what_is_on_their_other_side(polygon):
    scene = Scene.from_polygons([polygon], 0.5, transmittance=[[0.4] * 3], divisions=[3], sides=[FRONT])
    patches = mesh(scene)
    np.testing.assert_array_equal(patches.opposite[patches.opposite], np.arange(len(patches.area)))
    corners, patch = quarters(quarters(patches.corners)), np.repeat(np.arange(len(patches.area)), 16)
    through = piece_translucence(corners, patch, patches)
    np.testing.assert_array_equal(through.piece, np.arange(len(patch)))
    np.testing.assert_array_equal(through.other[through.other], through.piece)
    centre, side = corners.mean(axis=1), patches.side[patch]
    if len(polygon) == 3:
        centre = corners[:, :3].mean(axis=1)
    np.testing.assert_allclose(centre[through.other], centre, atol=1e-12)
    assert (side[through.other] == -side).all()
    assert mesh(Scene.from_polygons([polygon], 0.5)).opposite.max() == -1


def test_the_side_that_shows_is_the_one_that_was_chosen():
    for side in (FRONT, BACK, BOTH):
        scene = two_rooms(sides=[FRONT] * 6 + [side])
        patches = mesh(scene)
        other = behind(scene, patches)
        shown = patches.side[patches.touch_patch[scene.corner_face[patches.touch_corner] == WALL]]
        assert (shown == (-1 if side == BACK else 1)).all()
        assert (patches.side[other.patches.touch_patch] == -shown[0]).all()
        np.testing.assert_array_equal(scene.corner_vertex[other.corner], other.scene.corner_vertex)


def test_light_finds_its_way_through(decide):
    """A lamp in a shade lights the room round it, whose normals look outwards."""
    polygons = [*box_polygons((4, 4, 3), inward=False), *box_polygons((1, 1, 1), (1.5, 1.5, 1))]
    polygons.append(sheet((1.8, 1.8, 1.4), (2.2, 2.2), up=False))
    emission = np.zeros((13, 3))
    emission[12] = 10.0
    for tau, room in ((0.5, BACK), (0.0, FRONT)):
        transmittance = np.zeros((13, 3))
        transmittance[6:12] = tau
        scene = Scene.from_polygons(polygons, 0.3, emission, transmittance=transmittance, sides=[AUTO] * 13)
        sides = decide(scene).sides
        assert (sides[:6] == room).all()
        assert (sides[6:12] == (BOTH if tau else FRONT)).all()


def test_new_light_goes_through_as_well():
    scene = one_lit()
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    with ThreadPoolExecutor(1) as workers:
        lit = exhaust(solve(patches, occluders, QUALITIES["preview"], workers, tolerance=1e-6))
    again = relight(prepare_relighting(lit), patches, sweeps=8)
    for name in ("radiosity", "irradiance"):
        found, expected = getattr(again.solution, name), getattr(lit.solution, name)
        np.testing.assert_allclose(found, expected, atol=2e-3 * expected.max())
