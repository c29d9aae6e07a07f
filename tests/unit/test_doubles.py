# SPDX-License-Identifier: GPL-3.0-or-later
"""Doubled faces count once, whichever way they are turned."""

from dataclasses import replace

import numpy as np
import pytest

from core.bake import bake
from core.facing.doubles import without_doubles
from core.lighting.lamps import PointLamp
from core.progress import exhaust
from core.scene import AUTO, BACK, BOTH, FRONT, Scene
from core.settings import Settings
from tests.unit.flat_shapes import SQUARE, TRIANGLE


def counted(polygons, sides, **fields):
    """Return the faces that give light to others."""
    scene = without_doubles(Scene.from_polygons(polygons, 0.5, sides=sides, **fields))
    np.testing.assert_array_equal(scene.reflects, scene.occludes)
    return np.flatnonzero(scene.reflects).tolist()


def test_one_of_doubled_faces_counts():
    turned = SQUARE[::-1]
    assert counted([SQUARE, SQUARE, TRIANGLE], [FRONT] * 3) == [0, 2]
    assert counted([SQUARE, np.roll(SQUARE, 1, axis=0), turned], [FRONT, FRONT, BACK]) == [0]
    # Back to back, or lit on more sides.
    assert counted([SQUARE, turned], [FRONT, FRONT]) == [0, 1]
    assert counted([SQUARE, turned], [FRONT, BOTH]) == [1]
    assert counted([SQUARE, SQUARE + (0, 0, 1e-6)], [FRONT, FRONT]) == [0, 1]
    assert counted([SQUARE, SQUARE], [FRONT, FRONT], transmittance=np.full((2, 3), 0.3)) == [0, 1]
    assert counted([SQUARE, SQUARE], [FRONT, FRONT], emission=[[0, 0, 0], [1, 1, 1]]) == [1]


@pytest.mark.parametrize("turn", [1, -1])
def test_a_box_of_doubled_faces_sends_no_more_light(turn):
    def sides_of(size, place, inwards=False):
        wall = 2 * SQUARE - (1, 1, 1)
        faces = [np.roll(side, axis, axis=1) for axis in range(3) for side in (wall[::-1], -wall)]
        return [size * face[:: -1 if inwards else 1] + place for face in faces]

    room, box = sides_of(1.0, 0.0, inwards=True), sides_of(0.35, np.array((0.1, 0.2, -0.65)))
    lamp = PointLamp("Bulb", np.ones(3), np.array((-0.6, -0.5, 0.7)))
    settings = Settings(quality="preview", max_edge=0.25)
    light = []
    for polygons in (room + box, room + box + [face[::turn] for face in box]):
        number = np.repeat(np.arange(3), 6)[: len(polygons)]
        scene = Scene.from_polygons(polygons, 0.8, lamps=[lamp], sides=np.full(len(polygons), AUTO))
        scene = replace(scene, face_object=number, object_names=("Room", "Box", "Double")[: number.max() + 1])
        light.append(exhaust(bake(scene, settings)))
    alone, doubled = (one.corner_irradiance[:, 0] for one in light)
    assert len(doubled) == len(alone) + 24
    assert doubled[:24].mean() == pytest.approx(alone[:24].mean(), rel=0.01)
    np.testing.assert_allclose(doubled[24:48].mean(), alone[24:].mean(), rtol=0.02)
    # What is spared is lit like what it lies in.
    np.testing.assert_allclose(doubled[48:].mean(), doubled[24:48].mean(), rtol=0.02)
