# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects as artists leave them: curves and text, in Edit Mode, mirrored, linked from files that may be gone."""

import numpy as np
import pytest

from tests.blender.building import (
    CUBE_FACES,
    CUBE_VERTICES,
    SQUARE,
    add_mesh,
    add_object,
    add_room,
    add_square,
    colors,
    glowing,
)


def words(blender):
    text = blender.data.curves.new("Words", 'FONT')
    text.body, text.extrude, text.size, text.resolution_u = "I", 0.05, 0.5, 2
    return text


def ribbon(blender):
    curve = blender.data.curves.new("Ribbon", 'CURVE')
    curve.dimensions, curve.extrude = '3D', 0.25
    points = curve.splines.new('POLY').points
    points.add(1)
    points[0].co, points[1].co = (0.25, 0.5, 0.5, 1), (0.75, 0.5, 0.5, 1)
    return curve


def sheet(blender):
    blender.ops.surface.primitive_nurbs_surface_surface_add(radius=0.25)
    obj = blender.context.object
    surface = obj.data
    surface.resolution_u = surface.resolution_v = 2
    surface.transform(((1, 0, 0, 0.5), (0, 1, 0, 0.5), (0, 0, 1, 0.5), (0, 0, 0, 1)))
    blender.data.objects.remove(obj)
    return surface


def ball(blender):
    ball = blender.data.metaballs.new("Ball")
    ball.elements.new().co = (0.5, 0.5, 0.5)
    ball.elements[0].radius, ball.resolution = 0.4, 0.2
    return ball


@pytest.mark.parametrize("make", [words, ribbon, sheet, ball])
def test_what_is_no_mesh_lights_a_scene_like_one(bake, scene, blender, make):
    add_room(scene, material=glowing())
    shape = make(blender)
    shape.materials.append(glowing(0.25, 0.0))
    obj = add_object(scene.collection, "Shape", shape)
    assert "1 object without a mesh ('Shape') gets no colors in place; choose Baked Copy" in bake()
    room = colors(scene.objects["Room"].data)
    depsgraph = blender.context.evaluated_depsgraph_get()
    mesh = blender.data.meshes.new_from_object(obj.evaluated_get(depsgraph), depsgraph=depsgraph)
    assert len(mesh.polygons) and mesh.materials[0].name == shape.materials[0].name
    blender.data.objects.remove(obj)
    add_object(scene.collection, "Shape", mesh)
    bake()
    np.testing.assert_array_equal(colors(scene.objects["Room"].data), room)
    assert room[:, 0].min() < 2.0 - 0.01  # a furnace with something darker in it


def test_what_has_no_faces_is_left_out_by_name(read, scene, blender):
    add_square(scene)
    for name, data in (
        ("Hair", blender.data.hair_curves.new("Hair")),
        ("Points", blender.data.pointclouds.new("Points")),
        ("Smoke", blender.data.volumes.new("Smoke")),
    ):
        add_object(scene.collection, name, data)
    furry = add_square(scene, "Furry")
    furry.modifiers.new("Fur", 'PARTICLE_SYSTEM')
    furry.particle_systems[0].settings.type = 'HAIR'
    reading = read()
    assert reading.scene.object_names == ("Square", "Furry")
    assert set(reading.scene.warnings) == {
        "Object 'Hair' is hair curves without faces and left out",
        "Object 'Points' is a point cloud without faces and left out",
        "Object 'Smoke' is a volume without faces and left out",
        "Object 'Furry': hair has no faces and is left out",
    }


def test_a_curve_of_which_nodes_leave_nothing_is_nothing(read, scene, blender):
    add_square(scene)
    tree = blender.data.node_groups.new("Nothing", 'GeometryNodeTree')
    tree.interface.new_socket("Geometry", in_out='OUTPUT', socket_type='NodeSocketGeometry')
    tree.nodes.new('NodeGroupOutput')
    for make in (words, ribbon):
        obj = add_object(scene.collection, "Gone", make(blender))
        obj.modifiers.new("Nodes", 'NODES').node_group = tree
    assert read().scene.object_names == ("Square",)


def test_settings_of_modifiers_for_renders_are_told_in_one_line(read, scene):
    add_square(scene, "Plain").modifiers.new("Weld", 'WELD')
    hidden = add_square(scene, "Hidden")
    hidden.modifiers.new("Mirror", 'MIRROR').show_viewport = False
    smooth = add_square(scene, "Smooth").modifiers.new("Subdivision", 'SUBSURF')
    smooth.levels, smooth.render_levels = 1, 2
    off = add_square(scene, "Off").modifiers.new("Subdivision", 'SUBSURF')
    off.show_viewport = off.show_render = False
    reading = read()
    assert len(reading.scene.face_area) == 1 + 1 + 4 + 1
    assert list(reading.scene.warnings) == [
        "Objects 'Hidden', 'Smooth': modifiers are other in renders; they are read as the viewport shows them"
    ]


@pytest.mark.parametrize("modifier", [None, 'ARRAY'])
def test_edit_mode_changes_nothing(bake, scene, blender, modifier):
    room = add_room(scene, material=glowing())
    box = add_mesh(scene, "Box", np.array(CUBE_VERTICES) * 0.25 + 0.125, CUBE_FACES, glowing(0.25, 0.0))
    if modifier:
        box.modifiers.new("Modifier", modifier)
    bake()
    before = colors(room.data), colors(box.data)
    for mesh in (room.data, box.data):
        mesh.color_attributes.remove(mesh.color_attributes[0])
    box.select_set(True)
    blender.context.view_layer.objects.active = box
    blender.ops.object.mode_set(mode='EDIT')
    bake()
    for one, other in zip(before, (colors(room.data), colors(box.data)), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-2, -0.5, -1), (2, 2, 0.5)])
def test_a_scale_lights_like_an_applied_one(bake, read, scene, blender, scale):
    add_room(scene, material=glowing())
    box = add_mesh(scene, "Box", np.array(CUBE_VERTICES) * 0.25 - 0.125, CUBE_FACES, glowing(0.25, 0.0))
    box.scale, box.location = scale, (0.5, 0.5, 0.5)
    found = read().scene
    middles = found.vertices[found.corner_vertex][24:].reshape(6, 4, 3).mean(axis=1)
    assert (np.einsum("ij,ij->i", found.face_normal[6:], middles - 0.5) > 0).all()
    bake()
    before = colors(scene.objects["Room"].data), colors(box.data)
    box.select_set(True)
    blender.context.view_layer.objects.active = box
    # Some versions of Blender leave the faces inside out.
    blender.ops.object.transform_apply(location=True, rotation=True, scale=True)
    bake()
    # Applying may turn faces round: the corners of a face stay, but start elsewhere.
    np.testing.assert_allclose(colors(scene.objects["Room"].data), before[0], rtol=1e-3)
    np.testing.assert_allclose(*(np.sort(one.reshape(6, 16)) for one in (before[1], colors(box.data))), rtol=1e-2)


def test_constraints_and_parents_move_objects(read, scene, blender):
    goal = add_object(scene.collection, "Goal")
    goal.location = (1, 2, 3)
    child = add_square(scene)
    child.parent = add_object(scene.collection, "Parent")
    child.parent.constraints.new('COPY_LOCATION').target = goal
    np.testing.assert_allclose(read().scene.vertices.min(axis=0), (1, 2, 3), atol=1e-6)


def test_each_scene_and_view_layer_has_its_own_objects(addon, scene, blender):
    add_square(scene, "Here")
    for name in ("One", "Two"):
        collection = blender.data.collections.new(name)
        scene.collection.children.link(collection)
        add_mesh(scene, name, SQUARE, [(0, 1, 2, 3)], collection=collection)
    other = blender.data.scenes.new("Other")
    add_square(other, "There")
    layer = scene.view_layers.new("Second")
    layer.layer_collection.children["Two"].exclude = True
    scene.view_layers[0].layer_collection.children["One"].exclude = True
    # A holdout is one for the camera only, and so is what is indirect only.
    one = layer.layer_collection.children["One"]
    one.holdout = one.indirect_only = True
    read_scene = addon("scene_reader").read_scene
    for owner, where, names in (
        (scene, scene.view_layers[0], ("Here", "Two")),
        (scene, layer, ("Here", "One")),
        (other, other.view_layers[0], ("There",)),
    ):
        where.update()
        assert read_scene(owner, where, where.depsgraph).scene.object_names == names
