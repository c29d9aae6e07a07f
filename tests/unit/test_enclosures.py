# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed shells: lit outside, inside, or on both sides, by where light starts."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from core.facing.enclosures import Enclosure, enclosure
from core.facing.orientation import orientation
from core.lighting.lamps import PointLamp, SkyLamp
from core.scene import AUTO, BACK, BOTH, FRONT, Scene
from tests.unit.globes import LAMP, globe, ico, sides_in_a_room


@pytest.fixture
def found(box):
    """Return the sides of every object of a room with a hung lamp: `found({"Ball": faces}, glowing=("Ball",))`."""
    pytest.importorskip("bpy")
    return partial(sides_in_a_room, box((4, 4, 3)))


@pytest.mark.parametrize(("segments", "rings"), [(8, 6), (14, 10), (20, 32), (28, 48), (38, 19)])
@pytest.mark.parametrize("radius", [0.02, 0.5])
def test_balls_of_many_resolutions_are_lit_outside(found, segments, rings, radius):
    # Resting on the floor, a little sunk.
    for seed, height in enumerate((1.0, 0.99)):
        balls = {"Ball": globe(segments, rings, radius, (1.3, 2.2, height * radius))}
        assert found(balls, seed=seed)[0]["Ball"] == FRONT


@pytest.mark.parametrize("levels", [0, 1, 2, 3])
@pytest.mark.parametrize("radius", [0.02, 0.5])
def test_balls_of_triangles_are_lit_outside(found, levels, radius):
    assert found({"Ball": ico(levels, radius, (1.3, 2.2, radius))})[0]["Ball"] == FRONT


def test_a_ball_that_is_turned_inside_out_is_lit_from_its_back(found):
    ball = [face[::-1] for face in globe(20, 32, 0.1, (1.3, 2.2, 0.1))]
    assert found({"Ball": ball})[0]["Ball"] == BACK


@pytest.mark.parametrize("radius", [0.05, 0.5])
def test_a_cup_is_lit_on_both_sides(found, radius):
    assert found({"Cup": globe(24, 16, radius, (1.3, 2.2, 1.5 * radius), without=8)})[0]["Cup"] == BOTH


def test_a_shade_with_a_lamp_in_it_is_lit_on_both_sides_and_in_the_dark_only_inside(found):
    shade = {"Shade": globe(20, 32, 0.5, (2, 2, 1.0)), "Bulb": ico(1, 0.1, (2, 2, 1.0))}
    assert found(shade, glowing=("Bulb",))[0] == {"Room": FRONT, "Lamp": BOTH, "Shade": BOTH, "Bulb": FRONT}
    assert found(shade, glowing=("Bulb",), lit=False)[0]["Shade"] == BACK
    bulb = PointLamp("Bulb", np.ones(3), np.array([2.0, 2.0, 1.0]), 0.02)
    assert found({"Shade": shade["Shade"]}, lamps=(bulb,))[0]["Shade"] == BOTH
    assert found({"Shade": shade["Shade"]}, lamps=(bulb,), lit=False)[0]["Shade"] == BACK


def test_of_two_nested_balls_the_outer_one_is_lit_outside(found):
    balls = {"Outer": globe(20, 32, 0.5, (2, 2, 1.0)), "Inner": ico(2, 0.3, (2, 2, 1.0))}
    sides, _ = found(balls)
    assert sides["Outer"] == sides["Inner"] == FRONT
    # Where the inner one glows, the outer one is lit from inside as well.
    sides, _ = found(balls, glowing=("Inner",))
    assert (sides["Outer"], sides["Inner"]) == (BOTH, FRONT)


@pytest.mark.parametrize("segments", [16, 40])
@pytest.mark.parametrize("inward", [True, False])
def test_a_room_may_be_a_ball(found, segments, inward):
    dome = globe(segments, segments // 2, 9.0, (2, 2, 1))
    dome = [face[::-1] for face in dome] if inward else dome
    sky = SkyLamp("World", np.full((1, 1, 3), 0.05))
    scene = found({"Dome": dome, "Bulb": ico(1, 0.1, (2, 2, 5))}, glowing=("Bulb",), lamps=(sky,), lit=False)[0]
    assert scene["Dome"] == (FRONT if inward else BACK)


def test_a_shell_tells_where_light_starts(box):
    scene = Scene.from_polygons(box(inward=False))
    faces, shape = np.arange(6), orientation(scene)

    def starts(*points, scene=scene):
        return enclosure(scene, faces, shape, np.reshape(points, (-1, 3)).astype(float))

    assert starts((0.5, 0.2, 0.9)) == Enclosure(front=False, back=True)
    assert starts((1.5, 0.2, 0.9)) == Enclosure(front=True, back=False)
    assert starts((1.5, 0.2, 0.9), (0.9, 0.9, 0.1)) == Enclosure(front=True, back=True)
    sky = replace(scene, lamps=(SkyLamp("World", np.ones((1, 1, 3))),))
    assert starts(scene=sky) == Enclosure(front=True, back=False)
    # One face short, shining by itself, or letting light through, it is no shell.
    pot = Scene.from_polygons(box()[1:])
    assert enclosure(pot, faces[:5], orientation(pot), np.zeros((0, 3))) is None
    assert starts(scene=replace(scene, emission=np.ones((6, 3)))) is None
    assert starts(scene=replace(scene, occludes=[False, *[True] * 5])) is None


def test_the_points_in_a_star_of_concave_faces_are_told():
    # A prism over an L: its notch is outside.
    plan = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)], float)
    sides = [np.array([(*a, 0), (*b, 0), (*b, 1), (*a, 1)]) for a, b in zip(plan, np.roll(plan, -1, 0), strict=True)]
    top = np.column_stack((plan, np.ones(6)))
    for turn in range(6):
        lids = [np.roll(top, turn, axis=0), np.roll(top, turn, axis=0)[::-1] - (0, 0, 1)]
        scene = Scene.from_polygons([*sides, *lids])
        for point, inside in (((0.5, 2.5, 0.5), True), ((2.5, 0.5, 0.5), True), ((2, 2, 0.5), False)):
            told = enclosure(scene, np.arange(8), orientation(scene), np.array([point], float))
            assert told == Enclosure(front=not inside, back=inside)


def test_what_is_lit_on_both_sides_shows_its_front(box, light):
    """A shelf between a bright and a dark half of a room: whichever of them its front looks at."""

    def shown(up):
        shelf = np.array([(0.5, 0.5, 1.5), (3.5, 0.5, 1.5), (3.5, 3.5, 1.5), (0.5, 3.5, 1.5)])
        polygons = [*box((4, 4, 3)), *LAMP, shelf if up else shelf[::-1]]
        emission = np.zeros((8, 3))
        emission[6] = 10.0
        scene = Scene.from_polygons(
            polygons,
            0.5,
            emission,
            sides=[AUTO] * 8,
            face_object=[0] * 6 + [1, 2],
            object_names=["Room", "Lamp", "Shelf"],
        )
        result = light(scene, method="hierarchical", quality="preview", max_edge=1.0)
        assert result.report.islands == {"front": 1, "back": 0, "both": 2}
        assert any(line.startswith("Object 'Shelf': its sides differ") for line in result.report.warnings)
        return result.corner_radiance[-4:, 0]

    above, below = shown(True), shown(False)
    assert above.min() > 1.5 * below.max() > 0.0
