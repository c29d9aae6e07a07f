# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole street: what it yields, what it refuses, what it warns of."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from core.bake import bake
from core.errors import RadiosityError
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.surfaces import occluder_polygons
from core.progress import exhaust
from core.scene import AUTO, Scene
from core.settings import Settings
from tests.unit.blockers import box as closed_box

DENSE = ("gathering", "shooting")
METHODS = ("hierarchical", *DENSE)


@pytest.mark.parametrize("method", DENSE)
def test_a_bake_brings_colours_for_every_corner(ceiling_lamp, light, method):
    scene = ceiling_lamp(divisions=3)
    bake = light(scene, method=method)
    assert bake.corner_radiance.shape == (24, 3)
    assert (bake.corner_radiance > 0.0).all()
    assert len(bake.patches.area) == len(bake.solution.radiosity) == bake.report.patches == 54
    assert bake.report.converged and bake.report.links > 0


def test_stages_follow_each_other_with_progress_in_each(ceiling_lamp):
    steps = list(bake(ceiling_lamp(divisions=4), Settings(method="gathering")))
    stages = list(dict.fromkeys(step.stage for step in steps))
    assert [stage for stage in stages if stage != "Surfaces"] == ["Patches", "Form factors", "Gathering light"]
    for stage in stages:
        fractions = [step.fraction for step in steps if step.stage == stage]
        assert fractions == sorted(fractions) and 0.0 <= fractions[0] <= fractions[-1] <= 1.0
    assert steps[-1].radiosity.shape == (96, 3)


def test_light_can_be_shown_after_every_shot(ceiling_lamp):
    steps = [s for s in bake(ceiling_lamp(divisions=2), Settings(method="shooting")) if s.stage == "Shooting light"]
    assert [step.iteration for step in steps] == list(range(1, len(steps) + 1))
    assert all(np.isfinite(step.radiosity).all() for step in steps)


def test_a_finer_meshing_is_asked_for_in_two_ways(ceiling_lamp, light):
    assert light(ceiling_lamp(), subdivide=3).report.patches == 54
    assert light(ceiling_lamp(), max_edge=0.26).report.patches == 96


def test_nothing_to_light():
    empty = Scene(np.zeros((0, 3)), [], [0], np.zeros((0, 3)), np.zeros((0, 3)), object_names=())
    line = Scene.from_polygons([np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0)], float)], 0.5, 1.0)
    for scene in (empty, line):
        with pytest.raises(RadiosityError, match="nothing to light: add a mesh"):
            next(bake(scene, Settings()))


def test_no_light(cube):
    with pytest.raises(RadiosityError, match="no light: give a material emission"):
        next(bake(cube(emission=0.0), Settings()))


def test_a_lamp_without_area_is_no_light(box):
    line = np.array([(0.2, 0.5, 0.5), (0.8, 0.5, 0.5), (0.5, 0.5, 0.5)])
    emission = np.zeros((7, 3))
    emission[6] = 1.0
    with pytest.raises(RadiosityError, match="no light"):
        next(bake(Scene.from_polygons([*box(), line], 0.5, emission), Settings()))


def test_too_few_iterations_are_told(ceiling_lamp, light):
    for method in METHODS:
        for iterations in (1, 2, 70):
            report = light(ceiling_lamp(0.98, 2), method=method, iterations=iterations, tolerance=1e-7).report
            assert not report.converged
            assert report.iterations == iterations or method == "shooting"
            # First of all, with what is missing.
            missing = f"{report.energy.error:.1%} of the light is missing"
            assert report.warnings[0].startswith("Not converged") and missing in report.warnings[0]
    assert light(ceiling_lamp()).report.warnings == []


@pytest.mark.parametrize("iterations", [1, 2, 5, 70])
def test_as_many_bounces_as_were_asked_for(cube, light, iterations):
    found = light(cube(0.9, emission=1.0), method="hierarchical", iterations=iterations, tolerance=0.0).solution
    assert found.iterations == iterations
    np.testing.assert_allclose(found.radiosity, (1.0 - 0.9 ** (iterations + 1)) / 0.1, rtol=2e-3)


def test_factors_that_cannot_be_are_told(box, light):
    # Two sheets closer to each other than their patches are wide: the centre kernel finds far more light than there is.
    sheet = np.array([(0, 0, 0.5), (1, 0, 0.5), (1, 1, 0.5), (0, 1, 0.5)], float)
    polygons = [*box(), sheet, sheet[::-1] + (0, 0, 0.05)]
    scene = Scene.from_polygons(polygons, 0.9, 1.0, divisions=np.full(8, 3))
    report = light(scene, method="gathering", form_factors="centre").report
    assert report.row_sum.max > 10.0 and report.converged
    assert any("smaller patches or exact" in warning for warning in report.warnings)
    assert light(scene, method="gathering", form_factors="exact").report.row_sum.max < 1.01


@pytest.mark.parametrize("raised", [0.0, 0.05])
def test_light_that_two_faces_in_one_plane_receive_is_told(light, raised):
    """A cupboard with a lamp in it stands on the floor, or just above."""
    room, cupboard = closed_box((-2, -2, 0), (2, 2, 2))[:, ::-1], closed_box((-0.8, -0.4, raised), (0.8, 0.4, 0.5))
    strip = closed_box((-0.7, -0.2, 0.1), (0.7, 0.2, 0.11))
    emission = 10.0 * (np.arange(18) >= 12)[:, None] * np.ones(3)
    owner = {"face_object": np.repeat((0, 1, 2), 6), "object_names": ["room", "cupboard", "strip"]}
    scene = Scene.from_polygons([*room, *cupboard, *strip], 0.3, emission, sides=np.full(18, AUTO), **owner)
    report = light(scene, "hierarchical", quality="preview", max_edge=0.25).report
    assert any("more light than is sent" in line for line in report.warnings) == (raised == 0.0)


def test_warnings_of_the_scene_are_passed_on(cube, light):
    assert any("0.99" in warning for warning in light(cube(reflectance=1.5), iterations=5).report.warnings)


def test_occluders_and_executor_can_be_handed_in(box):
    polygons = [*box(), *box((0.3, 0.3, 0.3), (0.3, 0.4, 0.0), inward=False)]
    scene = Scene.from_polygons(polygons, 0.5, [(1.0, 1.0, 1.0)] + [(0.0, 0.0, 0.0)] * 11, divisions=np.full(12, 3))
    plain = exhaust(bake(scene, Settings(method="gathering")))
    occluders = BruteForceOccluders(occluder_polygons(scene, plain.patches))
    with ThreadPoolExecutor(1) as executor:
        other = exhaust(bake(scene, Settings(method="gathering"), occluders=occluders, executor=executor))
    np.testing.assert_array_equal(other.corner_radiance, plain.corner_radiance)


@pytest.mark.parametrize("method", DENSE)
def test_same_scene_same_settings_same_bits(ceiling_lamp, light, method):
    first, second = (light(ceiling_lamp(divisions=3), method=method) for _ in range(2))
    np.testing.assert_array_equal(first.corner_radiance, second.corner_radiance)


def test_closing_a_bake_ends_it(ceiling_lamp):
    steps = bake(ceiling_lamp(divisions=4), Settings(method="gathering"))
    for _ in range(3):
        next(steps)
    steps.close()
    with pytest.raises(StopIteration):
        next(steps)
