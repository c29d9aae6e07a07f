# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake is one step that undo takes back; one that is cancelled or fails changes nothing."""

from threading import Event

import pytest

from tests.blender.building import (
    SQUARE,
    add_square,
    colors,
    glowing,
    lit_pair,
)


def test_undo_takes_the_colors_back_in_one_step(scene, blender):
    lit_pair(scene)
    blender.ops.ed.undo_push(message="Before")
    # Called with undo, as the button does; a script's call leaves no undo step by itself.
    assert blender.ops.radiosity.bake('EXEC_DEFAULT', True) == {'FINISHED'}
    assert all("Radiosity" in mesh.color_attributes for mesh in blender.data.meshes)
    assert blender.ops.ed.undo() == {'FINISHED'}
    assert len(blender.data.meshes) == 2
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)


@pytest.mark.parametrize("mode", ['EDIT', 'SCULPT', 'VERTEX_PAINT', 'WEIGHT_PAINT', 'TEXTURE_PAINT'])
def test_undo_takes_all_colors_back_from_every_mode(scene, blender, mode):
    _, floor = lit_pair(scene)
    blender.context.view_layer.objects.active = floor
    floor.select_set(True)
    blender.ops.ed.undo_push(message="Before")
    blender.ops.object.mode_set('EXEC_DEFAULT', True, mode=mode)
    assert blender.ops.radiosity.bake('EXEC_DEFAULT', True) == {'FINISHED'}
    assert colors(floor.data)[:, 0].min() > 0.0
    # In these modes Undo knows the active mesh only, so the bake leaves them.
    assert floor.mode == ('OBJECT' if mode in {'EDIT', 'SCULPT', 'TEXTURE_PAINT'} else mode)
    assert blender.ops.ed.undo() == {'FINISHED'}
    assert len(blender.data.meshes) == 2
    assert not any("Radiosity" in mesh.color_attributes for mesh in blender.data.meshes)


def test_a_closed_generator_leaves_the_scene_as_it_was(addon, scene, blender):
    lit_pair(scene)
    scene.radiosity.max_edge = 0.2
    steps = addon("operators").start_bake(blender.context)
    stages = [next(steps).stage for _ in range(3)]
    steps.close()
    assert len(set(stages)) > 1
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)


def test_a_bake_is_told_of_and_cancelled_within_a_long_step(addon, scene, blender, monkeypatch):
    lit_pair(scene)
    scene.radiosity.target = 'IN_PLACE'
    go_on, core_bake = Event(), addon("baking").core_bake
    bake = core_bake.bake

    def slow(*arguments):
        go_on.wait(60)
        return (yield from bake(*arguments))

    monkeypatch.setattr(core_bake, "bake", slow)
    steps = addon("operators").start_bake(blender.context)
    assert [next(steps).stage for _ in range(4)] == ["Reading the scene", *["Patches"] * 3]
    steps.close()
    go_on.set()
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)


def test_no_reference_to_blenders_data_outlives_the_first_step(addon, scene, blender):
    _, floor = lit_pair(scene)
    blender.ops.ed.undo_push(message="First")
    floor.location.x = 0.25
    blender.ops.ed.undo_push(message="Moved")
    steps = addon("operators").start_bake(blender.context)
    next(steps)
    # Undo frees and makes anew what the scene is made of.
    blender.ops.ed.undo()
    for _ in steps:
        pass
    floor = blender.data.objects["Floor"]
    assert floor.location.x == 0.0
    assert colors(floor.data)[:, 0].min() > 0.0


@pytest.mark.parametrize("change", ["edited", "removed"])
def test_a_mesh_that_changes_during_the_bake_is_an_error_and_nothing_is_written(addon, error, scene, blender, change):
    lamp, floor = lit_pair(scene)
    steps = addon("operators").start_bake(blender.context)
    next(steps)
    if change == "edited":
        floor.data.clear_geometry()
        floor.data.from_pydata(SQUARE[:3], [], [(0, 1, 2)])
    else:
        blender.data.meshes.remove(floor.data)
    with pytest.raises(error, match=r"'Floor'.*bake again"):
        for _ in steps:
            pass
    assert not lamp.data.color_attributes


@pytest.mark.parametrize(
    "prepare, message",
    [
        (lambda scene: None, "add a mesh"),
        (lambda scene: add_square(scene), "Emission Strength"),
        (lambda scene: add_square(scene, material=glowing(radiance=0.0)), "Emission Strength"),
        (lambda scene: setattr(lit_pair(scene)[0], "hide_render", True), "Emission Strength"),
    ],
    ids=["empty", "no emitter", "emitter of strength 0", "hidden emitter"],
)
def test_what_cannot_be_baked_is_said_and_changes_nothing(press, scene, blender, prepare, message):
    prepare(scene)
    with pytest.raises(RuntimeError, match=message):
        press()
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)
    assert not blender.context.window_manager.radiosity.running
