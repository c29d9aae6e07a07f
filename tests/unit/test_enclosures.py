# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed shells, and faces that are turned against their neighbours."""

from dataclasses import replace

import numpy as np
import pytest

from core.facing.enclosures import Enclosure, enclosure
from core.facing.orientation import orientation
from core.facing.sides import auto_sides, island_counts
from core.lighting.lamps import PointLamp, SkyLamp
from core.meshing import mesh
from core.scene import AUTO, BACK, BOTH, FRONT, Scene
from core.visibility import scene_occluders
from tests.benchmarks.meshes import icosphere


def globe(segments, rings, radius, at, *, without=0):
    """Return the faces of a ball whose poles are fans of triangles; some rings from the top may be left out."""
    polar, around = np.linspace(0.0, np.pi, rings + 1)[:, None], np.arange(segments + 1) * 2.0 * np.pi / segments
    around[-1] = 0.0
    at_pole = np.where(np.isin(np.arange(rings + 1), (0, rings))[:, None], 0.0, np.sin(polar))
    point = np.stack([at_pole * np.cos(around), at_pole * np.sin(around), np.cos(polar) + 0.0 * around], axis=2)
    point = radius * point + at
    faces = []
    for i in range(without, rings):
        for j in range(segments):
            corners = [point[i, j], point[i + 1, j], point[i + 1, j + 1], point[i, j + 1]]
            faces.append(np.array(corners[:3] if i == 0 else [*corners[:2], corners[3]] if i == rings - 1 else corners))
    return faces


def ico(levels, radius, at):
    ball = icosphere(radius, levels)
    return [ball.vertices[face[:3]] + at for face in ball.faces]


LAMP = [np.array([(1.5, 1.5, 2.8), (1.5, 2.5, 2.8), (2.5, 2.5, 2.8), (2.5, 1.5, 2.8)])]


@pytest.fixture
def found(box):
    """Return the sides of every object of a room with a hung lamp: `found({"Ball": faces}, glowing=("Ball",))`."""
    pytest.importorskip("bpy")

    def run(things, glowing=(), lamps=(), seed=0, lit=True):
        objects = {"Room": box((4, 4, 3)), **({"Lamp": LAMP} if lit else {}), **things}
        names = list(objects)
        of = np.repeat(np.arange(len(names)), [len(faces) for faces in objects.values()])
        emission = np.array([10.0 * (name == "Lamp" or name in glowing) for name in names])[of]
        scene = Scene.from_polygons(
            [face for faces in objects.values() for face in faces],
            0.5,
            np.repeat(emission[:, None], 3, axis=1),
            sides=np.full(len(of), AUTO),
            face_object=of,
            object_names=names,
            lamps=lamps,
        )
        patches = mesh(scene)
        scene = auto_sides(scene, patches, scene_occluders(scene, patches), seed=seed)
        return {name: int(scene.sides[of == index].min()) for index, name in enumerate(names)}, scene

    return run


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


def test_faces_that_are_turned_are_the_lesser_part():
    rng = np.random.default_rng(3)
    for count in (0, 1, 7, 150):
        ball = globe(20, 16, 1.0, (0, 0, 0))
        turned = np.zeros(len(ball), dtype=bool)
        turned[rng.choice(len(ball), count, replace=False)] = True
        scene = Scene.from_polygons([face[::-1] if turn else face for face, turn in zip(ball, turned, strict=True)])
        shape = orientation(scene)
        np.testing.assert_array_equal(shape.turned, turned)
        assert shape.sealed.all()


def test_a_band_with_one_side_has_no_faces_that_are_turned():
    turn = np.linspace(0.0, np.pi, 13)
    radius = np.array([-0.3, 0.3])[:, None] * np.cos(turn) + 1.0
    height = np.array([-0.3, 0.3])[:, None] * np.sin(turn)
    rim = np.stack([radius * np.cos(2 * turn), radius * np.sin(2 * turn), height], axis=2)
    rim[:, -1] = rim[::-1, 0]
    band = [np.array([rim[0, k], rim[0, k + 1], rim[1, k + 1], rim[1, k]]) for k in range(12)]
    shape = orientation(Scene.from_polygons(band))
    assert not shape.turned.any() and not shape.sealed.any()
    # Cut open it has two sides.
    assert not orientation(Scene.from_polygons(band[1:])).turned.any()


def test_neighbours_at_crowded_edges_are_not_compared():
    floor = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    faces = [floor, floor + (1, 0, 0), np.array([(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)], float)]
    assert not orientation(Scene.from_polygons(faces)).turned.any()
    assert orientation(Scene.from_polygons([floor, (floor + (1, 0, 0))[::-1]])).turned.sum() == 1
    assert orientation(Scene.from_polygons([])).turned.shape == (0,)


@pytest.mark.parametrize("inward", [True, False])
def test_each_part_of_mixed_normals_has_the_light_of_its_lit_side(found, inward):
    ball = globe(20, 16, 0.5, (1.3, 2.2, 0.6))
    turned = np.random.default_rng(1).permutation(len(ball)) < 60
    ball = [face[::-1] if turn != inward else face for face, turn in zip(ball, turned, strict=True)]
    _, scene = found({"Ball": ball})
    mine = scene.sides[scene.face_object == 2]
    np.testing.assert_array_equal(mine, np.where(turned != inward, BACK, FRONT))
    told = [line for line in scene.warnings if "'Ball'" in line]
    assert told[-1] == (
        "Object 'Ball': 60 faces are turned against the neighbors; each shows the light of its own lit side "
        "(recalculate the normals)"
    )
    assert len(told) == 1 + inward
    assert island_counts(scene)["both"] == 2


def test_mixed_normals_are_as_bright_as_the_others(box, light):
    """A smooth ball, a third of whose faces are turned: its corners are lit as those of the ball that is in order."""
    ball = globe(12, 8, 0.5, (2, 2, 1.2))
    turned = np.random.default_rng(2).permutation(len(ball)) < 30
    smooth = [(face - (2, 2, 1.2)) / 0.5 for face in ball]

    def baked(mixed):
        turn = turned & mixed
        faces = [face[::-1] if back else face for face, back in zip(ball, turn, strict=True)]
        normals = [face[::-1] if back else face for face, back in zip(smooth, turn, strict=True)]
        room = [*box((4, 4, 3)), *LAMP]
        flat = [np.tile(face, (4, 1)) for face in Scene.from_polygons(room).face_normal]
        scene = Scene.from_polygons(
            room + faces,
            0.5,
            np.repeat(10.0 * (np.arange(7 + len(faces)) == 6)[:, None], 3, axis=1),
            corner_normals=np.concatenate([flat_face[:4] for flat_face in flat] + normals),
            sides=np.full(7 + len(faces), AUTO),
            face_object=[0] * 6 + [1] + [2] * len(faces),
            object_names=["Room", "Lamp", "Ball"],
        )
        out = light(scene, method="hierarchical", quality="preview", max_edge=1.0).corner_radiance
        where = {}
        for place, value in zip(scene.vertices[scene.corner_vertex], out, strict=True):
            where.setdefault(tuple(np.round(place, 6)), []).append(value[0])
        return {place: values for place, values in where.items() if np.linalg.norm(np.array(place) - (2, 2, 1.2)) < 0.6}

    order, mixed = baked(False), baked(True)
    # One value at each vertex, the same.
    assert all(np.ptp(values) < 1e-9 for values in mixed.values())
    one = np.array([values[0] for values in order.values()])
    other = np.array([mixed[place][0] for place in order])
    assert one.min() > 0.01
    np.testing.assert_allclose(other, one, rtol=0.15)


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
