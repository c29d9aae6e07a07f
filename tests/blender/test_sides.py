# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces of Blender have two sides; the lit ones are baked."""

import json

import numpy as np
import pytest

from tests.blender.building import CUBE_FACES, CUBE_VERTICES, add_mesh, add_room, add_square, colors, glowing


@pytest.fixture
def bake(scene, blender):
    """Return a function that presses the button and gives the warnings."""

    def bake(**settings):
        for name, value in settings.items():
            setattr(scene.radiosity, name, value)
        assert blender.ops.radiosity.bake() == {'FINISHED'}
        return blender.context.window_manager.radiosity.warnings.splitlines()

    return bake


def add_lamp(scene, z=0.9):
    """Add a small square that faces downwards, in the middle of a unit room."""
    lamp = add_square(scene, "Lamp", glowing(0.0, 5.0), size=0.2)
    lamp.rotation_euler, lamp.location = (np.pi, 0.0, 0.0), (0.4, 0.6, z)
    return lamp


def add_outward_room(scene):
    """Add a default cube, as most rooms begin."""
    return add_mesh(scene, "Room", CUBE_VERTICES, CUBE_FACES)


def test_a_cube_with_outward_normals_is_a_room(bake, scene):
    add_lamp(scene)
    room = add_outward_room(scene)
    warnings = bake(max_edge=0.5)
    assert warnings[0] == (
        "Object 'Room': 1 island is lit from the back; the colors show the light there (flip the normals, or choose "
        "Sides: Front)"
    )
    outward = colors(room.data)[:, :3].reshape(6, 4, 3)
    assert outward.min() > 0.05

    # The same as in a room that faces inwards, corner by corner.
    room.hide_render = True
    facing = add_room(scene, "Facing")
    assert not any("lit from the back" in line for line in bake(max_edge=0.5))
    inward = colors(facing.data)[:, :3].reshape(6, 4, 3)
    np.testing.assert_allclose(outward[:, ::-1], inward, rtol=0.05)


@pytest.mark.parametrize(("sides", "lit"), [('front', False), ('back', True)])
def test_the_side_can_be_chosen(bake, scene, sides, lit):
    add_lamp(scene).rotation_euler = (0.0 if lit else np.pi, 0.0, 0.0)
    room = add_outward_room(scene)
    assert not any("lit from the back" in line for line in bake(sides=sides))
    assert bool(colors(room.data)[:, :3].max() > 0.05) is lit


def test_a_hung_panel_lights_the_ceiling(bake, scene):
    add_lamp(scene, z=0.8)
    room = add_room(scene)
    bake(max_edge=0.25)
    auto = colors(room.data)[:, :3].reshape(6, 4, 3)
    bake(max_edge=0.25, sides='front')
    one_sided = colors(room.data)[:, :3].reshape(6, 4, 3)
    # The last face is the ceiling.
    assert auto[5].min() > 1.5 * one_sided[5].min()


def test_the_sides_are_reported_and_can_be_given_to_the_command(addon, bake, scene, blender, tmp_path):
    cli = addon("cli")
    add_lamp(scene)
    add_outward_room(scene)
    path = str(tmp_path / "room.blend")
    blender.ops.wm.save_as_mainfile(filepath=path)

    def islands(*options):
        assert cli.main([path, "--report", str(tmp_path / "report.json"), *options], prog="bake") == 0
        return json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["islands"]

    assert islands() == {"front": 0, "back": 1, "both": 1}
    assert islands("--sides", "front") == {"front": 2, "back": 0, "both": 0}
