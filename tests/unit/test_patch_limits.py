# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the meshing that make no sense or too many patches are refused in words."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core import grids
from core.errors import RadiosityError
from core.meshing import mesh
from core.scene import BOTH, Scene
from tests.unit.flat_shapes import ELL, NEEDLE, SQUARE


@pytest.mark.parametrize("max_edge", [0, -1, np.nan, np.inf])
def test_a_largest_edge_that_is_no_length_is_refused(max_edge):
    with pytest.raises(RadiosityError, match="largest patch edge must be a length above zero"):
        mesh(Scene.from_polygons([SQUARE]), max_edge=max_edge)


@pytest.mark.parametrize("subdivide", [0, -2, 1.5, np.nan, np.inf])
def test_a_subdivision_that_is_no_number_of_parts_is_refused(subdivide):
    with pytest.raises(RadiosityError, match="subdivision must be a whole number"):
        mesh(Scene.from_polygons([SQUARE]), subdivide=subdivide)


@given(st.integers(0, 2**32 - 1), st.floats(1e-300, 1e-3))
def test_too_short_an_edge_is_refused_with_one_that_fits(seed, max_edge):
    scales = np.random.default_rng(seed).uniform(0.5, 10, 3)
    polygons = [SQUARE * scales[0], ELL * (20 + scales[1]), NEEDLE * 0.1 * scales[2]]
    scene = Scene.from_polygons(polygons, face_object=[0, 1, 2], object_names=["Floor", "Wall", "Rod"], sides=[1, 3, 2])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(grids, "PATCH_LIMIT", 1000)
        with pytest.raises(RadiosityError, match=r"Object 'Wall' would be cut into [\d,]+ patches") as refusal:
            mesh(scene, max_edge=max_edge)
        fitting = float(re.search(r"take a largest edge of (\S+) m or more", str(refusal.value))[1])
        # It fits, and it is not needlessly long.
        assert len(mesh(scene, max_edge=fitting).area) <= 1000
        with pytest.raises(RadiosityError):
            mesh(scene, max_edge=0.8 * fitting)


@pytest.mark.parametrize("cut", [{"subdivide": 3000}, {"subdivide": 3000, "max_edge": 0.1}, {"subdivide": 10**400}])
def test_too_many_divisions_are_refused_with_the_object(cut):
    with pytest.raises(RadiosityError, match=r"Object 'Scene' .* patches .* take fewer divisions or a smaller"):
        mesh(Scene.from_polygons([SQUARE]), **cut)


def test_exactly_as_many_patches_as_allowed_are_made(monkeypatch):
    monkeypatch.setattr(grids, "PATCH_LIMIT", 200)
    both = Scene.from_polygons([SQUARE], sides=[BOTH])
    assert len(mesh(both, subdivide=10).area) == 200
    with pytest.raises(RadiosityError, match=r"242 patches \(242 in all, 200 at most\)"):
        mesh(both, subdivide=11)
