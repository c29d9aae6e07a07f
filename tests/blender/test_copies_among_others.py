# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked copies among everything else in a file: what they replace, hide, leave behind, and what undo does."""

import numpy as np
import pytest

from tests.blender.building import (
    SQUARE,
    add_square,
    colors,
    copy_collection,
    lit_floor,
)


def test_the_next_bake_takes_the_place_of_the_last_and_of_nothing_else(bake_copies, scene, blender):
    lit_floor(scene)
    mine = blender.data.collections.new("Radiosity")
    scene.collection.children.link(mine)
    similar = add_square(scene, "Floor Baked", z=-3.0)
    mine.objects.link(similar)
    first = bake_copies(max_edge=0.5)
    assert copy_collection(blender) != mine
    guest = add_square(scene, "Guest", z=-4.0)
    copy_collection(blender).objects.link(guest)
    before = {kind: len(getattr(blender.data, kind)) for kind in ("objects", "meshes", "collections", "materials")}
    bits = colors(first[1].data)
    names = {copy.name for copy in first}
    second = bake_copies()
    assert names < {copy.name for copy in second} and guest in second and similar.name == "Floor Baked"
    after = {kind: len(getattr(blender.data, kind)) for kind in before}
    # The guest has a copy now.
    assert after == before | {"objects": before["objects"] + 1, "meshes": before["meshes"] + 1}
    assert not similar.data.color_attributes and not guest.data.color_attributes
    # A copy lights nothing: nothing has changed for the floor but that it is the guest's neighbour now.
    again = next(copy for copy in second if copy.get("radiosity_copy_of") == "Floor")
    np.testing.assert_allclose(colors(again.data), bits, rtol=1e-4)


def test_undo_takes_the_copies_back_in_one_step(scene, blender):
    lit_floor(scene)
    scene.radiosity.target, scene.radiosity.hide_originals = 'COPY', True
    blender.ops.ed.undo_push(message="Before")
    assert blender.ops.radiosity.bake('EXEC_DEFAULT', True) == {'FINISHED'}
    assert len(blender.data.objects) == 4 and len(blender.data.collections) == 1
    assert blender.ops.ed.undo() == {'FINISHED'}
    assert len(blender.data.objects) == len(blender.data.meshes) == 2 and not blender.data.collections
    assert not any(obj.hide_render or obj.hide_get() for obj in blender.data.objects)


@pytest.mark.parametrize("end", ["cancelled", "edited", "removed", "layer"])
def test_a_bake_that_does_not_end_well_leaves_nothing(addon, error, scene, blender, end):
    lit_floor(scene)
    scene.radiosity.target, scene.radiosity.max_edge = 'COPY', 0.25
    steps = addon("operators").start_bake(blender.context)
    next(steps)
    if end == "cancelled":
        next(steps)
        steps.close()
    else:
        floor = blender.data.objects["Floor"]
        if end == "edited":
            floor.data.clear_geometry()
            floor.data.from_pydata(SQUARE[:3], [], [(0, 1, 2)])
        elif end == "removed":
            blender.data.meshes.remove(floor.data)
        else:
            scene.view_layers[0].name = "Another"
        with pytest.raises(error, match="bake again"):
            for _ in steps:
                pass
    assert not blender.data.collections
    assert {obj.name for obj in blender.data.objects} <= {"Lamp", "Floor"}
    assert {mesh.name for mesh in blender.data.meshes} <= {"Lamp", "Floor"}
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)


def test_originals_are_hidden_on_request_and_still_count(bake_copies, scene, blender):
    lamp, floor = lit_floor(scene)
    closed = add_square(scene, "Closed", z=-2.0)
    closed.hide_set(True)
    group = blender.data.collections.new("Group")
    group.objects.link(add_square(scene, "Tile", size=0.3))
    place = blender.data.objects.new("Place", None)
    place.instance_type, place.instance_collection, place.location.x = 'COLLECTION', group, 0.5
    scene.collection.objects.link(place)
    scene.collection.objects.unlink(blender.data.objects["Tile"])
    first = bake_copies(hide_originals=True)
    assert lamp.hide_render and floor.hide_render and lamp.hide_get() and place.hide_render
    assert len(first) == 4 and not any(copy.hide_render for copy in first)
    bits = [colors(copy.data) for copy in first]
    second = bake_copies(hide_originals=True)
    for copy, before in zip(second, bits, strict=True):
        np.testing.assert_array_equal(colors(copy.data), before)
    bake_copies(hide_originals=False)
    assert not (lamp.hide_render or floor.hide_render or lamp.hide_get() or closed.hide_render)
    # What the user had hidden stays so.
    assert closed.hide_get()


def test_copies_are_made_from_edit_mode_and_undo_takes_them_back(scene, blender):
    _, floor = lit_floor(scene)
    blender.context.view_layer.objects.active = floor
    floor.select_set(True)
    scene.radiosity.target = 'COPY'
    blender.ops.ed.undo_push(message="Before")
    blender.ops.object.mode_set('EXEC_DEFAULT', True, mode='EDIT')
    assert blender.ops.radiosity.bake('EXEC_DEFAULT', True) == {'FINISHED'}
    assert len(copy_collection(blender).objects) == 2
    assert blender.ops.ed.undo() == {'FINISHED'}
    assert len(blender.data.objects) == len(blender.data.meshes) == 2


def test_a_bake_in_place_tells_that_copies_are_older(bake_copies, scene, blender):
    lit_floor(scene)
    bake_copies()
    scene.radiosity.target = 'IN_PLACE'
    blender.ops.radiosity.bake()
    *_, warning = blender.context.window_manager.radiosity.warnings.splitlines()
    assert "copies of an earlier bake" in warning
