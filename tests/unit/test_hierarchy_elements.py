# SPDX-License-Identifier: GPL-3.0-or-later
"""Elements: who is split where there is not room for all splits."""

import numpy as np
import pytest

from core.hierarchy import elements as splitting
from core.hierarchy.elements import split_patches
from core.hierarchy.quality import QUALITIES
from core.hierarchy.unblocked import unblocked_light
from core.lighting.lamps import AreaLamp, PointLamp
from core.meshing import mesh
from core.scene import BOTH, Scene
from core.visibility import scene_occluders
from tests.unit.flat_shapes import SQUARE

# Small faces along each side of the crowd: half of them lie, half stand in them.
SIDE = 32
SMALL = 2 * SIDE * SIDE


@pytest.fixture(scope="module")
def crowd():
    """Return the patches and occluders of crossed small faces over a large floor, the last but a lamp over it."""
    x, y = (part.reshape(-1) for part in np.indices((SIDE, SIDE)))
    place = np.column_stack((x, y, np.full(len(x), 4.0)))[:, None]
    standing = SQUARE[:, [2, 0, 1]] + (0.4, 0.0, -0.6)
    polygons = [*(place + 0.7 * SQUARE), *(place + 0.7 * standing), SIDE * SQUARE, 3 * SQUARE[::-1] + (0, 0, 20)]
    emission = np.zeros((SMALL + 2, 3))
    emission[-1] = 5.0
    scene = Scene.from_polygons(polygons, 0.5, emission)
    patches = mesh(scene)
    return patches, scene_occluders(scene, patches)


@pytest.mark.parametrize("quality", ["preview", "medium", "production"])
def test_a_large_floor_is_split_however_many_small_faces_would_be(crowd, quality, monkeypatch):
    patches, occluders = crowd
    wanted = {"tolerance": QUALITIES[quality].split, "size": QUALITIES[quality].size}
    found = split_patches(patches, occluders, **wanted)
    # Each split puts four in the place of one, and there is room for four for each patch.
    assert len(found) <= SMALL + 2 + 3 * (SMALL + 2)
    np.testing.assert_allclose(np.bincount(found.patch, found.area), patches.area, rtol=1e-9)
    again = split_patches(patches, occluders, **wanted)
    np.testing.assert_array_equal(again.corners, found.corners)
    # With room for all, more small faces are split, and floor and lamp as they are now.
    monkeypatch.setattr(splitting, "_MOST", 1000)
    whole = split_patches(patches, occluders, **wanted)
    few, all_of_them = (np.bincount(one.patch) for one in (found, whole))
    assert 1.2 * SMALL < few[:SMALL].sum() < all_of_them[:SMALL].sum()
    np.testing.assert_array_equal(few[SMALL:], all_of_them[SMALL:])
    assert few[SMALL] >= 0.25 / QUALITIES[quality].size ** 2
    np.testing.assert_array_equal(found.corners[found.patch >= SMALL], whole.corners[whole.patch >= SMALL])


@pytest.mark.parametrize("passed_on", ["reflected", "transmitted"])
@pytest.mark.parametrize("kind", ["bulb", "panel"])
def test_what_is_near_a_lamp_is_split_until_its_light_adds_up(kind, passed_on):
    # Around a lamp that shines close to the top of a box of 0.3 m, whose faces are all that is there.
    place = np.array((0.05, 0.0, 0.12))
    wall = 2 * SQUARE - (1, 1, 1)
    sides = [wall, -wall[::-1]]
    sides += [np.roll(side, turn, axis=1) for turn in (1, 2) for side in sides]
    surface = {"reflected": {"reflectance": 0.5}, "transmitted": {"transmittance": np.full((6, 3), 0.5)}}[passed_on]
    scene = Scene.from_polygons([0.15 * side for side in sides], sides=[BOTH] * 6, **surface)
    patches = mesh(scene)
    panel = AreaLamp("panel", np.ones(3), place, 0.02 * np.eye(3)[0], 0.02 * np.eye(3)[1], np.eye(3)[2])
    lamp, power = {
        "bulb": (PointLamp("bulb", np.ones(3), place, 0.01), 4 * np.pi),
        "panel": (panel, np.pi * 0.04**2),
    }[kind]
    occluders = scene_occluders(scene, patches)
    sent = {}
    for lamps in ((), (lamp,)):
        found = split_patches(patches, occluders, tolerance=QUALITIES["medium"].split, size=1.0, lamps=lamps)
        light = lamp.unshadowed(found.centre, found.normal)[:, 0]
        sent[lamps] = float(found.area @ light) / power
    assert abs(sent[()] - 1) > 0.1
    assert sent[(lamp,)] == pytest.approx(1, abs=0.05)


def test_emitters_are_not_looked_for_at_pieces_too_small_to_misplace_their_light(crowd):
    patches, _ = crowd
    shining = unblocked_light(patches, (), 1e-3)
    point = np.tile((16.0, 16.0, 4.0), (5, 2, 1))
    normal = np.broadcast_to((0.0, 0.0, 1.0), point.shape)
    # A lamp of 9 square metres: a piece of a hundredth of what may go amiss, and one of a quarter of the lamp.
    small, large = shining.irradiance(point, normal, np.array([0.003, 1.5])).T
    np.testing.assert_array_equal(small, 0.0)
    assert (large > 0).all()
