# SPDX-License-Identifier: GPL-3.0-or-later
"""What blocks light between the patches of a matrix: flat faces, thickets, sheets with two sides (T13, T15)."""

from dataclasses import replace

import numpy as np
import pytest

from core.dense import visible_share
from core.scene import BOTH, Scene
from tests.unit.matrices import NeverAsked, by_face, dense, furnished


def thicket(box, count):
    """Return a room with so many small blocks between floor and ceiling that testing each does not pay."""
    rng = np.random.default_rng(5)
    polygons = box()
    for _ in range(count):
        polygons += box(rng.uniform(0.02, 0.06, 3), rng.uniform(0.15, 0.8, 3), inward=False)
    emission = np.zeros((len(polygons), 3))
    emission[0] = 1.0
    return Scene.from_polygons(polygons, 0.5, emission)


def test_a_patch_that_another_ones_plane_cuts(box):
    # The floor's middle patches reach under the block's sides.
    scene = furnished(box, 3)
    patches, F = dense(scene)
    sees = patches.face > 6
    np.testing.assert_allclose(F.row_sums()[sees & (patches.normal[:, 2] > -0.5)], 1.0, atol=6e-3)


def test_blocked_squares_as_published():
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    polygons = [square, square[::-1] + (0, 0, 1), square * 0.5 + (0, 0, 0.5)]
    scene = Scene.from_polygons(polygons, 0.5, 1.0, divisions=[8, 8, 1], sides=[1, 1, BOTH])
    patches, F = dense(scene)
    front = patches.side > 0
    factors = by_face(replace_patches(patches, front), F.matrix[np.ix_(front, front)])
    assert factors[0, 1] == pytest.approx(0.149868672, abs=1e-3)


def replace_patches(patches, chosen):
    return replace(patches, face=patches.face[chosen], area=patches.area[chosen])


def test_flat_blockers_and_rays_agree(box, monkeypatch):
    scene = furnished(box, 5)
    _, fast = dense(scene)
    # Without the surfaces everything is asked of the rays.
    patches, slow = dense(scene, surfaces=False)
    assert fast.rays != slow.rays
    # One ray of eight a pair: alike in what faces receive, pair by pair only within what a few rays can tell.
    np.testing.assert_allclose(by_face(patches, fast.matrix), by_face(patches, slow.matrix), atol=4e-3)
    np.testing.assert_array_equal(fast.matrix[fast.matrix == 0], 0.0)
    monkeypatch.setattr(visible_share, "FEW", 0)
    _, forced = dense(scene)
    assert forced.rays <= slow.rays
    np.testing.assert_allclose(by_face(patches, forced.matrix), by_face(patches, slow.matrix), atol=1e-7)


def test_a_thicket_is_left_to_rays(box, monkeypatch):
    monkeypatch.setattr(visible_share, "FEW", 20)
    scene = thicket(box, 10)
    patches, F = dense(scene, subdivide=2)
    np.testing.assert_allclose(F.row_sums()[patches.face < 6], 1.0, atol=0.12)


def test_a_clear_shaft_needs_no_rays(box):
    # Two cubes side by side: what is in one is never between two walls of the other.
    polygons = [*box(), *box(at=(0.0, 2.0, 0.0))]
    scene = Scene.from_polygons(polygons, 0.5, 1.0, divisions=np.full(12, 3))
    patches, F = dense(scene, occluders=NeverAsked())
    first, second = patches.face < 6, patches.face >= 6
    np.testing.assert_allclose(F.row_sums(), 1.0, atol=2e-4)
    np.testing.assert_array_equal(F.matrix[np.ix_(first, second)], 0.0)


def test_both_sides_of_a_sheet_see_only_their_own_half(box):
    sheet = np.array([(0, 0, 0.5), (1, 0, 0.5), (1, 1, 0.5), (0, 1, 0.5)], float)
    scene = Scene.from_polygons([*box(), sheet], 0.5, 1.0, sides=[1] * 6 + [BOTH], divisions=np.full(7, 4))
    patches, F = dense(scene)
    up, down = patches.centre[:, 2] > 0.5, patches.centre[:, 2] < 0.5
    sheet_up, sheet_down = (patches.face == 6) & (patches.side > 0), (patches.face == 6) & (patches.side < 0)
    upper, lower = (up & (patches.face < 6)) | sheet_up, (down & (patches.face < 6)) | sheet_down
    np.testing.assert_array_equal(F.matrix[np.ix_(upper, lower)], 0.0)
    np.testing.assert_allclose(F.row_sums(), 1.0, atol=1e-3)
