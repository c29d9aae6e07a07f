# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances of every kind are what they would be if they were real: they give, block and get light, and lamps shine."""

from collections import Counter

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
from tests.blender.instances import (
    add_collection,
    everything,
    furnished,
    hide_instancers,
    instance,
    nodes,
    on_points,
    shown_in_renders,
)


def shown_in_bakes(reading):
    return [(target.instancer_name, target.object_name) for target in reading.targets]


def positions(reading, index=0):
    target = reading.targets[index]
    return reading.scene.vertices[reading.scene.corner_vertex[target.evaluated_corner]]


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
    add_object(lamps, "Lamp", blender.data.lights.new("Lamp", 'POINT')).location = (0, 0, 1)
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
    high = add_object(scene.collection, "High", low.data)
    high.location = (0, 0, 0.8)
    assert {target.mesh_uid for target in read().targets[1:]} == {low.data.session_uid}
    warnings = bake()
    assert any("shared by 2 objects and gets the colors of 'Low', not of 'High'" in line for line in warnings)
