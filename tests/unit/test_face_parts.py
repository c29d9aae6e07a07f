# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that take part in the light by half: they do not block, reflect or emit, or have patches of their own size."""

import numpy as np
import pytest

from core.errors import RadiosityError
from core.lighting.lamps import SkyLamp, SunLamp
from core.meshing import mesh
from core.scene import Scene

FLOOR = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], float)
PANEL = FLOOR[::-1] + (0.0, 0.0, 2.0)
BOARD = FLOOR * 0.5 + (0.5, 0.5, 1.0)
FIRST = np.arange(3) < 2
METHODS = ("hierarchical", "gathering", "shooting")


def layers(board=True, **fields):
    """Return a floor under a panel that shines, and a black board half-way between them."""
    count = 3 if board else 2
    reflectance, emission = (np.outer(values, np.ones(3))[:count] for values in ((0.5, 0.0, 0.25), (0.0, 1.0, 0.0)))
    return Scene.from_polygons([FLOOR, PANEL, BOARD][:count], reflectance, emission, **fields)


@pytest.mark.parametrize("method", METHODS)
def test_what_neither_blocks_nor_reflects_is_lit_and_leaves_no_trace(light, method):
    bare = light(layers(board=False), method=method, max_edge=0.5).corner_radiance
    ghost = light(layers(occludes=FIRST, reflects=FIRST), method=method, max_edge=0.5).corner_radiance
    np.testing.assert_allclose(ghost[:8], bare, rtol=0.01, atol=1e-12)
    # It blocks nothing, not even for itself: its front has what a point in mid-air has, and shows its own reflectance.
    assert (ghost[8:] > 1.4 * (0.25 / 0.5) * bare[:4].max()).all()
    solid = light(layers(), method=method, max_edge=0.5).corner_radiance
    assert (solid[:4] < 0.95 * bare[:4]).all()


@pytest.mark.parametrize("method", METHODS)
def test_an_emitter_that_does_not_light_others_shows_its_own_light(light, method):
    sun = SunLamp("sun", np.ones(3), np.array((0.0, 0.0, 1.0)), 0.0)
    lone = light(layers(emits=[True, False, True], occludes=[True, False, False], lamps=[sun]), method=method)
    dark = light(layers(board=False, occludes=[True, False], lamps=[sun], emits=[True, False]), method=method)
    np.testing.assert_allclose(lone.corner_radiance[4:8], 1.0 / np.pi, rtol=1e-9)
    np.testing.assert_allclose(dark.corner_radiance[:4], 0.5 / np.pi, rtol=0.01)


def test_what_blocks_the_sky_is_a_matter_of_its_own(light):
    sky = SkyLamp("sky", np.ones((1, 1, 3)) / np.pi)
    fields = {
        "lamps": [sky],
        "emits": [True, False, True],
        "sides": [1, 1, 1],
        "reflects": FIRST,
        "divisions": [4, 4, 4],
    }
    both, none = np.ones(3, bool), np.zeros(3, bool)

    def under(scene):
        return light(scene, method="gathering").solution.irradiance[5].mean()

    assert under(layers(occludes=both, shades=none, **fields)) == pytest.approx(1.0)
    shaded = under(layers(occludes=none, shades=both, **fields))
    assert shaded == pytest.approx(under(layers(occludes=both, shades=both, **fields))) and shaded < 0.8
    # The other way round for what the panel sends.
    fields |= {"lamps": (), "emits": both}
    blocked = under(layers(occludes=both, shades=none, **fields))
    assert blocked < 0.5 * under(layers(occludes=none, shades=both, **fields))


def test_a_face_has_patches_of_its_own_size():
    whole = layers(max_edge=[0.5, np.nan, np.inf])
    counts = np.bincount(mesh(whole).face)
    assert counts.tolist() == [16, 1, 1]
    # In place of the bake's, be it finer or coarser.
    assert np.bincount(mesh(whole, max_edge=0.25).face).tolist() == [16, 64, 1]
    # Triangles keep the order of the faces, too.
    mixed = Scene.from_polygons([FLOOR[:3], FLOOR, FLOOR[:3]], max_edge=[0.5, np.nan, 1.0])
    patches = mesh(mixed)
    assert (np.diff(patches.face) >= 0).all() and np.bincount(patches.face)[1] == 1
    edges = np.linalg.norm(np.roll(patches.corners, -1, axis=1) - patches.corners, axis=2).max(axis=1)
    assert edges[patches.face == 0].max() <= 0.5 + 1e-9 and edges[patches.face == 2].max() <= 1.0 + 1e-9


def test_too_small_patches_of_its_own_are_named():
    with pytest.raises(RadiosityError, match="larger patches of its own"):
        mesh(layers(max_edge=[1e-5, np.nan, np.nan]))


@pytest.mark.parametrize("field", ["max_edge", "occludes", "shades", "reflects", "emits"])
def test_there_is_one_value_for_each_face(field):
    with pytest.raises(RadiosityError, match=f"{field} must have one value for each of the 3 faces"):
        layers(**{field: [1.0]})


@pytest.mark.parametrize("length", [0.0, -1.0])
def test_a_patch_size_is_above_zero(length):
    with pytest.raises(RadiosityError, match="'Scene': max_edge must be a length above zero"):
        layers(max_edge=[length, 1.0, 1.0])


def test_a_scene_that_only_emitters_that_light_nothing_light_is_refused(light):
    with pytest.raises(RadiosityError, match="no light"):
        light(layers(emits=np.zeros(3)))
