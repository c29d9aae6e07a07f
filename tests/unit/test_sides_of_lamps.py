# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sides lamps, sun and sky light: of rooms and solids, through windows, on leaves."""

import numpy as np
import pytest

from core.lighting.lamps import PointLamp, SkyLamp, SunLamp
from core.scene import BACK, BOTH, FRONT
from tests.unit.globes import globe
from tests.unit.islands import Things, sheet, upright

GREY_WORLD = SkyLamp("World", np.full((1, 1, 3), 0.05))

SUN = SunLamp("Sun", np.full(3, 3.0), np.array([0.6, 0.0, 0.8]))


def bulb(place):
    return PointLamp("Bulb", np.ones(3), np.array(place, float), 0.02)


@pytest.mark.parametrize("inward", [True, False])
def test_a_lamp_lights_the_inside_of_a_room(found, box, inward):
    things = Things().add("Room", box((4, 4, 3), inward=inward)).add("Block", box((1, 1, 1), (1, 1, 0), inward=False))
    assert found(things, bulb((3, 3, 2))) == {"Room": FRONT if inward else BACK, "Block": FRONT}
    # Blender's own world is not black, and lights the outside, which nobody sees.
    assert found(things, bulb((3, 3, 2)), GREY_WORLD) == {"Room": FRONT if inward else BACK, "Block": FRONT}


@pytest.mark.parametrize("lamp", [GREY_WORLD, SUN, bulb((3, 3, 3))])
def test_solids_on_a_floor_are_lit_outside(found, box, lamp):
    things = Things().add("Floor", [sheet((0, 0, 0), (4, 4))])
    things.add("Flush", box((1, 1, 1), (1, 1, 0), inward=False))
    things.add("Above", box((0.5, 0.5, 0.5), (2.5, 1, 1e-3), inward=False))
    assert found(things, lamp) == {"Floor": FRONT, "Flush": FRONT, "Above": FRONT}


@pytest.mark.parametrize("inward", [True, False])
def test_sun_and_sky_through_a_window(found, box, inward):
    walls = [face for index, face in enumerate(box((4, 4, 3), inward=inward)) if index != 5]
    # The wall at x = 4, with a window of 1 m x 1 m in it.
    ys, zs = [0, 1.5, 2.5, 4], [0, 1, 2, 3]
    for i in range(3):
        for j in range(3):
            if (i, j) != (1, 1):
                walls.append(upright(4, ys[i : i + 2], zs[j : j + 2], right=not inward))
    room = Things().add("Room", walls)
    side = FRONT if inward else BACK
    assert found(room, SUN) == found(room, GREY_WORLD) == {"Room": side}
    # A shelf in the corner beside the window: only what the walls reflect gets there.
    room.add("Shelf", [sheet((3, 0, 1), (3.9, 0.9), up=True)])
    assert found(room, SUN) == {"Room": side, "Shelf": BOTH}
    # The outside of the walls sends light to the ground.
    room.add("Ground", [sheet((-9, -9, -1e-3), (18, 18))])
    assert found(room, SUN)["Room"] == BOTH


def test_a_room_of_a_sheet_for_each_wall_is_lit_inside_though_the_day_is_outside(found, box):
    room = Things()
    for index, wall in enumerate(box((4, 4, 3), inward=False)):
        room.add(f"Wall {index}", [wall])
    table = [sheet((1, 1, 0.7), (2, 2))]
    sides = found(room.add("Table", table), bulb((3, 3, 2)), GREY_WORLD)
    assert sides == {**{f"Wall {index}": BACK for index in range(6)}, "Table": BOTH}
    # From outside, the walls light the ground.
    room.add("Ground", [sheet((-9, -9, -1e-3), (18, 18))])
    assert found(room, bulb((3, 3, 2)), GREY_WORLD)["Wall 2"] == BOTH


def test_roofs_over_the_ground_are_no_room(found):
    roofs = Things().add("Ground", [sheet((-9, -9, 0), (9, 9))])
    for index, x in enumerate((0, 1)):
        roofs.add(f"Roof {index}", [sheet((x, 0, 2), (x + 1, 2))])
    assert found(roofs, SUN, GREY_WORLD) == {"Ground": FRONT, "Roof 0": BOTH, "Roof 1": BOTH}


def test_two_sheets_back_to_back_are_a_sign_and_no_room(found):
    sign = Things().add("Front", [upright(0.0, (0, 1), (0, 1), right=False)])
    sign.add("Back", [upright(0.02, (0, 1), (0, 1))])
    assert found(sign, GREY_WORLD) == {"Front": BOTH, "Back": BOTH}
    # A metre apart they are walls, and lit on the inside as long as that has more than sky before it.
    apart = Things().add("Front", [upright(0.0, (0, 9), (0, 9), right=False)])
    apart.add("Back", [upright(1.0, (0, 9), (0, 9))])
    assert found(apart, GREY_WORLD) == {"Front": BACK, "Back": BACK}


@pytest.mark.parametrize("segments", [9, 32])
def test_a_vase_alone_in_the_day_shows_its_outside(found, segments):
    vase = Things().add("Vase", globe(segments, 16, 0.5, (0, 0, 0), without=3))
    assert found(vase, GREY_WORLD) == {"Vase": BOTH}
    # A lamp in it makes it a dome that people are in.
    assert found(vase, GREY_WORLD, bulb((0, 0, 0))) == {"Vase": BACK}


def test_light_that_nothing_blocks_comes_into_a_closed_room(found, box):
    room = Things().add("Room", box((4, 4, 3))).add("Top", [sheet((1, 1, 0.7), (2, 2))])
    bare = SunLamp("Sun", np.full(3, 3.0), np.array([0.6, 0.0, 0.8]), shadows=False)
    assert found(room, bare) == {"Room": FRONT, "Top": BOTH}
    assert found(room, SUN) == {"Room": BACK, "Top": FRONT}


def test_a_leaf_over_the_ground_is_lit_on_both_sides(found):
    things = Things().add("Ground", [sheet((-9, -9, 0), (18, 18))]).add("Leaf", [sheet((0, 0, 2), (0.1, 0.1))])
    assert found(things, SUN) == {"Ground": FRONT, "Leaf": BOTH}


@pytest.mark.parametrize("inward", [True, False])
def test_a_glowing_sky_round_the_scene_lights_the_little_that_is_in_it(found, box, inward):
    # The sun shines on the outside of that sky; of its own light next to nothing meets anything but itself.
    sky = box((20000, 20000, 10000), (-10000, -10000, -1000), inward=inward)
    things = Things().add("Sky", sky, emission=1.0).add("Ground", [sheet((0, 0, 0), (90, 90))])
    assert found(things, SUN) == {"Sky": FRONT if inward else BACK, "Ground": BOTH}
