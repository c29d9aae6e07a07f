# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sides of the surfaces light reaches."""

import numpy as np
import pytest

from core.facing.islands import islands
from core.facing.sides import auto_sides, choose_sides, island_counts
from core.meshing import mesh
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.surfaces import occluder_polygons
from core.scene import BACK, BOTH, FRONT, Scene
from tests.unit.globes import globe
from tests.unit.islands import SQUARE, Things, sheet, upright


def test_a_room_is_lit_inside_whatever_its_normals(found, lit_room):
    assert found(lit_room(inward=True))["Room"] == FRONT
    assert found(lit_room(inward=False))["Room"] == BACK


def test_a_hung_panel_shines_up_and_down(found, lit_room):
    assert found(lit_room())["Lamp"] == BOTH


def test_the_back_of_a_panel_that_nothing_sees_is_left_out(found):
    things = Things().add("Floor", [sheet((0, 0, 0), (4, 4))])
    things.add("Lamp", [sheet((1, 1, 2), (2, 2), up=False)], emission=10.0)
    assert found(things) == {"Floor": FRONT, "Lamp": FRONT}


@pytest.mark.parametrize("gap", [0.0, 1e-3, 0.5, -1e-3])
def test_a_closed_solid_is_lit_outside(found, lit_room, box, gap):
    # Flush on the floor, a little above, well above, a little sunk into it.
    things = lit_room().add("Block", box((1, 1, 1), (1, 1, gap), inward=False))
    assert found(things) == {"Room": FRONT, "Lamp": BOTH, "Block": FRONT}


def test_solids_that_touch_each_other_and_the_walls(found, lit_room, box):
    things = lit_room()
    for index, place in enumerate([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (3, 3, 0)]):
        things.add(f"Block {index}", box((1, 1, 1), place, inward=False))
    sides = found(things)
    assert {name: side for name, side in sides.items() if side != FRONT} == {"Lamp": BOTH}


def test_a_solid_turned_inside_out_is_lit_from_its_back(found, lit_room, box):
    assert found(lit_room().add("Block", box((1, 1, 1), (1, 1, 1), inward=True)))["Block"] == BACK


def test_a_box_without_a_bottom_is_dark_inside(found, lit_room, box):
    block = box((1, 1, 1), (1, 1, 0), inward=False)[1:]
    assert found(lit_room().add("Block", block))["Block"] == FRONT


def test_an_open_bowl_is_lit_on_both_sides(found, lit_room, box):
    bowl = [face for index, face in enumerate(box((1, 1, 0.5), (1, 1, 0.5), inward=False)) if index != 1]
    assert found(lit_room().add("Bowl", bowl))["Bowl"] == BOTH


@pytest.mark.parametrize("inward", [False, True])
def test_a_globe_with_a_slit_is_lit_outside(found, lit_room, inward):
    outside, ball = BACK if inward else FRONT, globe(32, 16, 0.5, (1, 1, 1))
    # What is left out lies at the equator.
    ball = [face[::-1] if inward else face for face in ball[256:] + ball[:256]]
    assert found(lit_room().add("Globe", ball[1:]))["Globe"] == outside
    # Not where light starts in it, nor where more than a slit is open.
    lamp = lit_room().add("Globe", ball[1:])
    lamp.add("Bulb", [sheet((0.9, 0.9, 1), (1.1, 1.1), up=up) for up in (True, False)], emission=5.0)
    assert found(lamp)["Globe"] == BOTH
    assert found(lit_room().add("Globe", ball[10:]))["Globe"] == BOTH


@pytest.mark.parametrize("up", [True, False])
def test_a_table_top_is_lit_on_both_sides(found, lit_room, up):
    assert found(lit_room().add("Top", [sheet((1, 1, 0.7), (2, 2), up=up)]))["Top"] == BOTH


@pytest.mark.parametrize("right", [True, False])
def test_a_sheet_between_two_rooms(found, box, right):
    def house(wall, *more):
        things = Things().add("House", box((6, 3, 3))).add("Wall", wall)
        for index, x in enumerate((1, *more)):
            things.add(f"Lamp {index}", [sheet((x, 1, 2.5), (x + 1, 2), up=False)], emission=10.0)
        return found(things)["Wall"]

    closed = [upright(3, (0, 3), (0, 3), right=right)]
    with_door = [upright(3, (0, 2), (0, 3), right=right), upright(3, (2, 3), (2, 3), right=right)]
    # The lamp on the left lights the left side only, until there is another on the right, or a door.
    assert house(closed) == (BACK if right else FRONT)
    assert house(closed, 4) == BOTH
    assert house(with_door) == BOTH


def test_cornells_open_box_is_dark_outside(found, box):
    walls = box((4, 4, 4))
    lamp = [sheet((1.5, 1.5, 3.9), (2.5, 2.5), up=False)]
    open_box = [face for index, face in enumerate(walls) if index != 2]
    things = Things().add("Box", open_box).add("Lamp", lamp, emission=10.0)
    assert found(things) == {"Box": FRONT, "Lamp": BOTH}
    # Something in front of the opening sends light round the corner.
    things.add("Screen", [np.array([(-9, -3, -9), (-9, -3, 9), (9, -3, 9), (9, -3, -9)], float)[::-1]])
    sides = found(things)
    assert sides["Lamp"] == BOTH and sides["Screen"] in (FRONT, BACK)


def test_the_lamp_in_a_hole_of_the_ceiling_shines_down_only(found, box):
    walls = box((3, 3, 3))
    frame = [sheet((x, y, 3), (x + 1, y + 1), up=False) for x in range(3) for y in range(3) if (x, y) != (1, 1)]
    things = Things().add("Walls", [*walls[:1], *walls[2:]]).add("Ceiling", frame)
    things.add("Lamp", [sheet((1, 1, 3), (2, 2), up=False)], emission=10.0)
    assert found(things) == {"Walls": FRONT, "Ceiling": FRONT, "Lamp": FRONT}


@pytest.mark.parametrize("inward", [True, False])
def test_a_furnace_is_lit_inside(found, box, inward):
    furnace = Things().add("Furnace", box(inward=inward), emission=1.0)
    assert found(furnace)["Furnace"] == (FRONT if inward else BACK)


def test_a_bulb_shines_outwards(found, lit_room, box):
    things = lit_room().add("Bulb", box((0.1, 0.1, 0.1), (1, 1, 1), inward=False), emission=5.0)
    assert found(things)["Bulb"] == FRONT


def test_what_no_light_reaches_shows_its_front(found, lit_room, box):
    things = lit_room().add("Cellar", box((4, 4, 2), (0, 0, -3), inward=False))
    assert found(things)["Cellar"] == FRONT


def test_islands_of_one_object_are_decided_one_by_one(decide, lit_room, box):
    things = lit_room(inward=False)
    things.add("Room", box((1, 1, 1), (0.5, 0.5, 0.5), inward=False))
    scene = decide(things.scene())
    assert scene.sides[scene.face_object == 0].tolist() == [BACK] * 6 + [FRONT] * 6
    assert island_counts(scene) == {"front": 1, "back": 1, "both": 1}


def test_flipped_islands_are_told(decide, lit_room, box):
    things = lit_room(inward=False)
    for x in (1, 2):
        things.add("Blocks", box((0.5, 0.5, 0.5), (x, 1, 1), inward=True))
    scene = decide(things.scene(warnings=["Something else"]))
    assert scene.warnings[0] == "Something else"
    told = [line.partition("; ")[0] for line in scene.warnings[1:]]
    assert told == [
        "Object 'Room': 1 island is lit from the back",
        "Object 'Blocks': 2 islands are lit from the back",
    ]
    assert island_counts(scene) == {"front": 0, "back": 3, "both": 1}


def test_sides_that_are_chosen_stay(decide, lit_room):
    things = lit_room(inward=False).add("Top", [sheet((1, 1, 0.7), (2, 2))], sides=FRONT)
    scene = decide(things.scene())
    assert scene.sides.tolist() == [BACK] * 6 + [BOTH, FRONT]
    assert decide(scene) is scene


@pytest.mark.parametrize(("choice", "side"), [("front", FRONT), ("back", BACK)])
def test_a_choice_for_all_goes_where_none_was_made(lit_room, choice, side):
    scene = lit_room().add("Top", [sheet((1, 1, 0.7), (2, 2))], sides=BOTH).scene()
    assert choose_sides(scene, mesh(scene), None, choice).sides.tolist() == [side] * 7 + [BOTH]


@pytest.mark.parametrize("inward", [True, False])
def test_a_bake_shows_the_light_inside(lit_room, light, inward):
    scene = lit_room(inward).scene()
    chosen = {"method": "gathering", "max_edge": 1.0}
    auto = light(scene, **chosen)
    np.testing.assert_allclose(auto.report.row_sum.mean, 1.0, atol=0.02)
    assert auto.corner_radiance.min() > 0.01
    assert auto.report.islands == {"front": inward, "back": not inward, "both": 1}
    assert any("lit from the back" in line for line in auto.report.warnings) is not inward
    if not inward:
        # Outside it is dark.
        assert np.all(light(scene, sides="front", **chosen).corner_radiance[:24] == 0.0)


def test_a_side_that_is_chosen_off_passes_no_light_on(found, box):
    # The lamp shines down on a floor whose front is off, so nothing comes back up to its neighbour's underside.
    def under(sides):
        things = Things().add("Floor", [sheet((0, 0, 0), (4, 4))], sides=sides)
        things.add("Shelf", [sheet((1, 1, 1), (2, 2))])
        return found(things.add("Lamp", [sheet((1, 1, 3), (2, 2), up=False)], emission=9.0))["Shelf"]

    assert under(FRONT) == BOTH
    assert under(BACK) == FRONT


def test_the_same_seed_decides_the_same(decide, lit_room, box):
    scene = lit_room().add("Block", box((1, 1, 1), (1, 1, 0))).scene()
    one, other = decide(scene, seed=5), decide(scene, seed=5)
    np.testing.assert_array_equal(one.sides, other.sides)


def test_a_crowd_is_decided_object_by_object(lit_room):
    things = lit_room()
    for index in range(600):
        x, y, z = index % 10, index // 10 % 10, index // 100
        place = (0.4 * x, 0.4 * y, 0.2 + 0.4 * z)
        things.add("Crowd", [sheet(place, (place[0] + 0.1, place[1] + 0.1), up=index % 2)])
    cast = []

    class Counted(BruteForceOccluders):
        def blocked(self, origins, targets):
            cast.append(len(origins))
            return super().blocked(origins, targets)

        def nearest(self, origins, directions):
            cast.append(len(origins))
            return super().nearest(origins, directions)

    scene = things.scene()
    patches = mesh(scene)
    sides = auto_sides(scene, patches, Counted(occluder_polygons(scene, patches))).sides
    assert np.all(sides[scene.face_object == 2] == BOTH)
    assert sum(cast) < 20_000


def test_islands_hang_together_by_vertices_of_an_object():
    rng = np.random.default_rng(1)
    squares = [SQUARE + (x, y, 0) for x in range(30) for y in range(30) if y != 12]
    polygons = [squares[index] for index in rng.permutation(len(squares))]
    part = islands(Scene.from_polygons(polygons))
    above = np.array([polygon[0, 1] > 12 for polygon in polygons])
    assert len(np.unique(part)) == 2 and len(np.unique(part[above])) == 1
    # Corner to corner is enough, but not from object to object.
    pair = [SQUARE, SQUARE + (1, 1, 0)]
    assert islands(Scene.from_polygons(pair)).tolist() == [0, 0]
    apart = Scene.from_polygons(pair, face_object=[0, 1], object_names=["One", "Other"])
    assert islands(apart).tolist() == [0, 1]
    assert islands(Scene.from_polygons([])).tolist() == []
