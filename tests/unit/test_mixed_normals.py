# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that are turned against their neighbours: found, lit on their lit side, and as bright as the others."""

import numpy as np
import pytest

from core.facing.orientation import orientation
from core.facing.sides import island_counts
from core.scene import AUTO, BACK, FRONT, Scene
from tests.unit.globes import LAMP, globe, sides_in_a_room


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
def test_each_part_of_mixed_normals_has_the_light_of_its_lit_side(box, inward):
    pytest.importorskip("bpy")
    ball = globe(20, 16, 0.5, (1.3, 2.2, 0.6))
    turned = np.random.default_rng(1).permutation(len(ball)) < 60
    ball = [face[::-1] if turn != inward else face for face, turn in zip(ball, turned, strict=True)]
    _, scene = sides_in_a_room(box((4, 4, 3)), {"Ball": ball})
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
