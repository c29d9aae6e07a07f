# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances of every kind are what they would be if they were real: they give, block and get light, and lamps shine."""

from collections import Counter

import numpy as np
import pytest

from tests.blender.building import CUBE_FACES, CUBE_VERTICES, SQUARE, add_mesh, add_room, add_square, colors, glowing


def add_collection(blender, name, parent=None):
    """Add a collection that is in no scene."""
    made = blender.data.collections.new(name)
    if parent is not None:
        parent.children.link(made)
    return made


def add_object(blender, where, name, data=None):
    made = blender.data.objects.new(name, data)
    where.objects.link(made)
    return made


def instance(blender, scene, collection, name="Instance", where=None):
    """Add an empty that shows a collection."""
    empty = add_object(blender, where or scene.collection, name)
    empty.instance_type, empty.instance_collection = 'COLLECTION', collection
    return empty


def nodes(blender, obj, build):
    """Add geometry nodes: `build(tree, geometry)` returns the socket that goes to the output."""
    tree = blender.data.node_groups.new("Nodes", 'GeometryNodeTree')
    for way in ('INPUT', 'OUTPUT'):
        tree.interface.new_socket("Geometry", in_out=way, socket_type='NodeSocketGeometry')
    first, last = tree.nodes.new('NodeGroupInput'), tree.nodes.new('NodeGroupOutput')
    tree.links.new(build(tree, first.outputs[0]), last.inputs[0])
    obj.modifiers.new("Nodes", 'NODES').node_group = tree


def on_points(tree, points, what):
    node = tree.nodes.new('GeometryNodeInstanceOnPoints')
    tree.links.new(points, node.inputs["Points"])
    tree.links.new(what, node.inputs["Instance"])
    return node.outputs[0]


def shown_in_renders(blender, scene):
    """Return what Blender itself hands a renderer, as (instancer, object) with faces."""
    found = []

    class Looker(blender.types.RenderEngine):
        bl_idname, bl_label, bl_use_preview = 'LOOKER', "Looker", False

        def render(self, depsgraph):
            for one in depsgraph.object_instances:
                if one.object.type == 'MESH' and one.show_self and len(one.object.data.polygons):
                    found.append(((one.parent or one.object).original.name, one.object.original.name))

    add_object(blender, scene.collection, "Camera", blender.data.cameras.new("Camera"))
    scene.camera = scene.objects["Camera"]
    blender.utils.register_class(Looker)
    engine, scene.render.engine = scene.render.engine, 'LOOKER'
    scene.render.resolution_x = scene.render.resolution_y = 4
    try:
        blender.ops.render.render()
    finally:
        scene.render.engine = engine
        blender.utils.unregister_class(Looker)
    return found


def shown_in_bakes(reading):
    return [(target.instancer_name, target.object_name) for target in reading.targets]


def positions(reading, index=0):
    target = reading.targets[index]
    return reading.scene.vertices[reading.scene.corner_vertex[target.evaluated_corner]]


def furnished(blender, scene):
    """Return a room with two chairs in a collection that an instance shows, the second of them mirrored."""
    add_room(scene, material=glowing())
    chairs = add_collection(blender, "Chairs")
    # All numbers are such that nothing has to be rounded.
    for x in (0.0, 0.375):
        chair = add_mesh(scene, "Chair", np.array(CUBE_VERTICES) * 0.25, CUBE_FACES, glowing(0.4, 0.0), chairs)
        chair.location, chair.scale = (
            (x, 0.125 if not x else 0.375, 0.25 if x else 0.0),
            (-1, -1, -1) if x else (1, 1, 1),
        )
    chairs.instance_offset = (-0.125, 0.0, 0.0)
    shown = instance(blender, scene, chairs)
    shown.location, shown.scale = (0.125, 0.25, 0.0625), (1.0, 1.0, 1.5)
    return shown


def test_instances_light_a_scene_like_real_objects(bake, read, scene, blender):
    shown = furnished(blender, scene)
    warnings = bake()
    assert "2 instances ('Chair', 'Chair.001') get no colors in place; choose Baked Copy" in warnings
    room, virtual = colors(scene.objects["Room"].data), read()
    blender.context.view_layer.objects.active = shown
    shown.select_set(True)
    blender.ops.object.duplicates_make_real()
    real = read()
    assert [len(one.targets) for one in (virtual, real)] == [3, 3]
    for index in (1, 2):
        np.testing.assert_array_equal(positions(virtual, index), positions(real, index))
        assert virtual.targets[index].instance and not real.targets[index].instance
    np.testing.assert_array_equal(virtual.scene.face_normal, real.scene.face_normal)
    bake()
    np.testing.assert_array_equal(colors(scene.objects["Room"].data), room)


def everything(blender, scene):
    """Fill a scene with instances of all kinds, some of them hidden in one of the ways there are."""
    tree = add_collection(blender, "Tree")
    add_mesh(scene, "Trunk", SQUARE, [(0, 1, 2, 3)], collection=tree)
    add_mesh(scene, "Not rendered", SQUARE, [(0, 1, 2, 3)], collection=tree).hide_render = True
    below = add_collection(blender, "Below", tree)
    below.hide_render = True
    add_mesh(scene, "Below", SQUARE, [(0, 1, 2, 3)], collection=below)
    forest = add_collection(blender, "Forest")
    instance(blender, scene, tree, "Nested", forest)
    instance(blender, scene, tree, "One tree")
    instance(blender, scene, forest, "One forest")
    instance(blender, scene, tree, "No tree").hide_render = True
    for kind in ('VERTS', 'FACES'):
        for name, shows in (("shown", True), ("not shown", False)):
            parent = add_square(scene, f"{kind} {name}")
            parent.instance_type, parent.show_instancer_for_render = kind, shows
            child = add_square(scene, f"Child of {parent.name}")
            child.parent = parent
            add_square(scene, f"Grandchild of {parent.name}").parent = child
            hidden = add_square(scene, f"Hidden child of {parent.name}")
            hidden.parent, hidden.hide_render = parent, True
    leaf = add_square(scene, "Leaf")
    leaf.hide_render = True

    def object_info(tree, geometry):
        node = tree.nodes.new('GeometryNodeObjectInfo')
        node.inputs["Object"].default_value = leaf
        node.inputs["As Instance"].default_value = True
        return on_points(tree, geometry, node.outputs["Geometry"])

    def collection_info(separate, tree, geometry):
        node = tree.nodes.new('GeometryNodeCollectionInfo')
        node.inputs["Collection"].default_value = blender.data.collections["Tree"]
        node.inputs["Separate Children"].default_value = separate
        return on_points(tree, geometry, node.outputs[0])

    def made(tree, geometry):
        return on_points(tree, geometry, tree.nodes.new('GeometryNodeMeshCube').outputs[0])

    nodes(blender, add_square(scene, "Leaves by nodes"), object_info)
    nodes(blender, add_square(scene, "Trees by nodes"), lambda *these: collection_info(False, *these))
    nodes(blender, add_square(scene, "Branches by nodes"), lambda *these: collection_info(True, *these))
    nodes(blender, add_square(scene, "Cubes by nodes"), made)
    # Of a collection some of whose objects are disabled in renders, the viewport picks others than a render.
    fruit = add_collection(blender, "Fruit")
    for name in ("Apple", "Pear"):
        add_mesh(scene, name, SQUARE, [(0, 1, 2, 3)], collection=fruit)
    for kind in ('OBJECT', 'COLLECTION'):
        emitter = add_square(scene, f"Particles {kind}")
        emitter.modifiers.new("Particles", 'PARTICLE_SYSTEM')
        settings = emitter.particle_systems[0].settings
        settings.type, settings.count, settings.render_type = 'HAIR', 3, kind
        settings.instance_object, settings.instance_collection = leaf, fruit
        emitter.show_instancer_for_render = kind == 'OBJECT'
    words = blender.data.curves.new("Words", 'FONT')
    words.body = "I"
    add_object(blender, forest, "Words", words)
    add_object(blender, scene.collection, "More words", words)
    add_object(blender, scene.collection, "Ball", blender.data.metaballs.new("Ball")).data.elements.new()


def hide_instancers(blender, scene, way):
    """Hide what makes instances, in the viewport only."""
    names = (
        "One tree",
        "One forest",
        "VERTS shown",
        "FACES not shown",
        "Trees by nodes",
        "Particles OBJECT",
        "No tree",
    )
    for name in (*names, "Cubes by nodes", "More words"):
        obj = scene.objects[name]
        if way == 'EYE':
            obj.hide_set(True)
        elif way == 'MONITOR':
            obj.hide_viewport = True


@pytest.mark.parametrize("way", [None, 'EYE', 'MONITOR'])
def test_the_instances_are_those_that_a_render_shows(read, scene, blender, way):
    everything(blender, scene)
    hide_instancers(blender, scene, way)
    before = len(blender.data.objects), len(blender.data.scenes)
    found = read()
    # Blender's own list is right by definition; the names in it are of objects, so this is what is where.
    ours, theirs = Counter(shown_in_bakes(found)), Counter(shown_in_renders(blender, scene))
    assert (ours - theirs, theirs - ours) == (Counter(), Counter())
    # Each is told apart by what Blender keeps telling.
    keys = [(target.instancer_name, target.object_name, target.instance) for target in found.targets]
    assert len(set(keys)) == len(keys) > 40
    # Only the camera is new.
    assert not found.scene.warnings and before == (len(blender.data.objects) - 1, len(blender.data.scenes))


@pytest.mark.parametrize("way", [None, 'MONITOR'])
def test_what_was_lit_can_be_made_again(read, addon, scene, blender, way):
    everything(blender, scene)
    hide_instancers(blender, scene, way)
    one, two = glowing(0.1, 0.0), glowing(0.2, 0.0)
    array = add_mesh(scene, "Array", SQUARE, [(0, 1, 2, 3)], one)
    array.modifiers.new("Array", 'ARRAY')
    array.scale = (1, -1, 1)
    array.material_slots[0].link = 'OBJECT'
    array.material_slots[0].material = two
    array.data.materials.append(one)
    slots = [two.name, one.name]
    array.data.polygons[0].material_index = 1
    reading, before = read(), len(blender.data.meshes)
    made = addon("objects.remade").remake(reading.targets, blender.context.evaluated_depsgraph_get())
    assert [one.target for one in made] == list(reading.targets)
    assert len(blender.data.meshes) == before + len(made) == len({one.mesh.name for one in made}) + before
    for one in made:
        matrix = np.array(one.matrix)
        vertices = np.array([vertex.co[:] for vertex in one.mesh.vertices]) @ matrix[:3, :3].T + matrix[:3, 3]
        corners = vertices[[loop.vertex_index for loop in one.mesh.loops]]
        there = reading.scene.corner_vertex[one.target.evaluated_corner]
        np.testing.assert_allclose(corners, reading.scene.vertices[there], atol=1e-5)
    assert [material.name for material in made[-1].mesh.materials] == slots
    assert all(polygon.material_index == 1 for polygon in made[-1].mesh.polygons)


def test_what_was_changed_is_not_made_again(read, error, addon, scene, blender):
    everything(blender, scene)
    reading, before = read(), len(blender.data.meshes)
    blender.data.collections["Tree"].objects.unlink(blender.data.objects["Trunk"])
    blender.context.view_layer.update()
    with pytest.raises(error, match="Trunk' was edited or removed"):
        addon("objects.remade").remake(reading.targets, blender.context.evaluated_depsgraph_get())
    assert len(blender.data.meshes) == before


def test_what_the_viewport_does_not_show_of_a_collection_is_told(read, scene, blender):
    inside = add_collection(blender, "Inside")
    for name in ("Shown", "Hidden"):
        add_mesh(scene, name, SQUARE, [(0, 1, 2, 3)], collection=inside).hide_viewport = name == "Hidden"
    instance(blender, scene, inside)
    reading = read()
    assert [target.object_name for target in reading.targets] == ["Shown"]
    assert list(reading.scene.warnings) == ["Instances of 'Hidden' are left out, as the viewport does not show them"]


def test_lamps_in_instances_shine_where_the_instances_are(read, scene, blender):
    add_square(scene)
    lamps = add_collection(blender, "Lamps")
    add_object(blender, lamps, "Lamp", blender.data.lights.new("Lamp", 'POINT')).location = (0, 0, 1)
    for x in (1.0, 2.0):
        instance(blender, scene, lamps).location = (x, 0, 0)
    instance(blender, scene, lamps, "Excluded").radiosity.exclude = True
    found = read().scene
    assert sorted(lamp.centre.tolist() for lamp in found.lamps) == [[1, 0, 1], [2, 0, 1]]


def test_thousands_of_instances_read_their_mesh_once(read, scene, blender, addon, monkeypatch):
    grid = [(x, y, 0) for x in range(50) for y in range(50)]
    points = add_mesh(scene, "Points", grid, [])
    nodes(
        blender,
        points,
        lambda tree, geometry: on_points(tree, geometry, tree.nodes.new('GeometryNodeMeshCube').outputs[0]),
    )
    instances, counted = addon("objects.instances"), []
    monkeypatch.setattr(
        instances, "local_mesh", lambda mesh: counted.append(1) or addon("objects.meshes").local_mesh(mesh)
    )
    reading = read()
    assert len(reading.targets) == 2500 and len(reading.scene.face_area) == 15000 and len(counted) == 1
    centres = reading.scene.vertices.reshape(2500, 8, 3).mean(axis=1)
    np.testing.assert_allclose(sorted(centres.tolist()), grid, atol=1e-5)


def test_more_faces_than_fit_are_refused_before_they_are_made(error, read, addon, scene, blender, monkeypatch):
    monkeypatch.setattr(addon("scene_reader"), "PATCH_LIMIT", 10)
    boxes = add_collection(blender, "Boxes")
    add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES, collection=boxes)
    instance(blender, scene, boxes, "Many")
    instance(blender, scene, boxes, "Many more")
    with pytest.raises(error, match=r"12 faces \(10 at most\), 12 of them in object 'Box' and its instances"):
        read()


def test_linked_duplicates_have_light_of_their_own(bake, read, scene, blender):
    add_room(scene, material=glowing())
    low = add_mesh(scene, "Low", np.array(SQUARE) * 0.2 + (0.4, 0.4, 0.05), [(0, 1, 2, 3)], glowing(0.5, 0.0))
    high = add_object(blender, scene.collection, "High", low.data)
    high.location = (0, 0, 0.8)
    assert {target.mesh_uid for target in read().targets[1:]} == {low.data.session_uid}
    warnings = bake()
    assert any("shared by 2 objects and gets the colors of 'Low', not of 'High'" in line for line in warnings)
