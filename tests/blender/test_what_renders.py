# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects of a scene are read: those that a render shows, as it shows them."""

import numpy as np

from tests.blender.building import SQUARE, add_mesh, add_square, glowing, positions


def test_what_renders_counts_and_nothing_else(read, scene, blender):
    def collection(name, parent=None):
        made = blender.data.collections.new(name)
        (parent or scene.collection).children.link(made)
        return made

    disabled, excluded = collection("Disabled"), collection("Excluded")
    below = collection("Below", disabled)
    disabled.hide_render = True
    for where, name in ((disabled, "In disabled"), (below, "Below disabled"), (excluded, "In excluded")):
        add_mesh(scene, name, SQUARE, [(0, 1, 2, 3)], collection=where)
    blender.context.view_layer.layer_collection.children["Excluded"].exclude = True
    both = add_square(scene, "In two collections")
    disabled.objects.link(both)
    add_square(scene, "Not rendered").hide_render = True
    add_square(scene, "Eye closed").hide_set(True)
    add_square(scene, "Not in viewports").hide_viewport = True
    assert set(read().scene.object_names) == {"In two collections", "Eye closed", "Not in viewports"}


def test_an_object_disabled_in_viewports_is_what_it_would_render(read, scene, blender):
    parent = add_square(scene, "Parent")
    parent.location = (5, 0, 0)
    scene.frame_set(7)
    for name in ("Hidden", "In hidden collection"):
        where = blender.data.collections.new(name)
        scene.collection.children.link(where)
        hidden = add_mesh(scene, name, SQUARE, [(0, 1, 2, 3)], collection=where)
        hidden.parent, hidden.location = parent, (0, 7, 0)
        hidden.modifiers.new("Array", 'ARRAY').count = 3
        hidden.constraints.new('LIMIT_LOCATION').use_min_z = True
        hidden.constraints[0].min_z = 2.0
        hidden.driver_add("location", 0).driver.expression = "frame"
        hidden.hide_viewport = name == "Hidden"
        where.hide_viewport = name != "Hidden"
    counts = [len(getattr(blender.data, kind)) for kind in ("scenes", "objects", "meshes", "actions")]
    reading = read()
    assert len(reading.scene.face_area) == 1 + 3 + 3
    for target in reading.targets[1:]:
        np.testing.assert_allclose(positions(reading.scene)[target.scene_corner[0]], (12, 7, 2), atol=1e-6)
    assert not reading.scene.warnings
    assert counts == [len(getattr(blender.data, kind)) for kind in ("scenes", "objects", "meshes", "actions")]
    assert blender.context.scene == scene and scene.frame_current == 7


def test_what_a_view_layer_shows_otherwise_is_read_or_told(read, scene, blender):
    add_square(scene)
    layer, world = blender.context.view_layer, blender.data.worlds.new("Night")
    layer.world_override = world
    assert [lamp.name for lamp in read().scene.lamps] == ["Night"] and not read().scene.warnings
    scene.background_set = blender.data.scenes.new("Stage")
    layer.material_override = glowing(name="Clay")
    scene.render.use_simplify, scene.render.simplify_subdivision = True, 0
    lines = read().scene.warnings
    told = ["background set 'Stage'", "material 'Clay'", "Simplify subdivides up to 6 times"]
    assert [what in line for what, line in zip(told, lines, strict=True)] == [True] * 3


def test_modifiers_that_keep_the_faces_move_them(read, scene):
    obj = add_square(scene)
    displace = obj.modifiers.new("Displace", 'DISPLACE')
    displace.strength, displace.mid_level, displace.direction = 2.0, 0.0, 'Z'
    reading = read()
    np.testing.assert_allclose(positions(reading.scene)[:, 2], 2.0)
    assert not reading.scene.warnings


def test_an_object_in_edit_mode_is_read_as_it_is_edited(read, scene, blender):
    import bmesh

    obj = add_square(scene)
    blender.context.view_layer.objects.active = obj
    blender.ops.object.mode_set(mode='EDIT')
    edited = bmesh.from_edit_mesh(obj.data)
    top = edited.verts.new((0.5, 0.5, 3.0))
    edited.verts.ensure_lookup_table()
    edited.faces.new((edited.verts[0], edited.verts[1], top))
    bmesh.update_edit_mesh(obj.data)
    reading = read()
    assert len(reading.scene.face_area) == 2
    assert positions(reading.scene)[:, 2].max() == 3.0
    assert len(reading.targets[0].scene_corner) == 7
    assert obj.mode == 'EDIT'
