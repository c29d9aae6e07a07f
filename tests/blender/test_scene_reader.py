# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's scene as the core gets it: what counts, where it is, which way it looks."""

from math import radians

import numpy as np
import pytest

from tests.blender.building import CUBE_FACES, CUBE_VERTICES, SQUARE, add_mesh, add_room, add_square, glowing, positions


def world_corners(obj):
    """Return where Blender puts every corner of an object's mesh, shape (c, 3)."""
    return np.array([obj.matrix_world @ obj.data.vertices[loop.vertex_index].co for loop in obj.data.loops])


def test_corners_are_where_blender_has_them(read, scene, blender):
    parent = add_square(scene, "Parent")
    parent.location, parent.rotation_euler, parent.scale = (1, 2, 3), (0.3, 0.5, 0.7), (1.5, 0.5, 2.0)
    child = add_mesh(scene, "Child", CUBE_VERTICES, CUBE_FACES)
    child.parent, child.location, child.rotation_euler = parent, (0, 0, 1), (0.2, 0.0, 0.4)
    reading = read()
    assert reading.scene.object_names == ("Parent", "Child")
    assert [target.object_name for target in reading.targets] == ["Parent", "Child"]
    for target, obj in zip(reading.targets, (parent, child), strict=True):
        np.testing.assert_allclose(positions(reading.scene)[target.scene_corner], world_corners(obj), atol=1e-6)


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 1, 0.5), (-1, 1, 1), (-1, -2, -3), (1, -2, 0.5)])
def test_the_outside_stays_outside_whatever_the_scale(read, scene, scale):
    box = add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES)
    box.scale, box.rotation_euler, box.location = scale, (0.3, 0.5, 0.7), (4, 5, 6)
    found = read().scene
    centre = positions(found).mean(axis=0)
    middles = positions(found).reshape(-1, 4, 3).mean(axis=1)
    assert (np.einsum("ij,ij->i", found.face_normal, middles - centre) > 0).all()
    # Flat shading: the normals at the corners are those of the faces, also where the box is squashed.
    np.testing.assert_allclose(found.corner_normals, np.repeat(found.face_normal, 4, axis=0), atol=1e-5)


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1)])
def test_each_mesh_corner_finds_its_own_place(read, scene, blender, scale):
    # Faces of three, four and five corners, so that turning the order around has to know the sizes.
    vertices = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (-1, 1, 0), (3, 1, 0)]
    obj = add_mesh(scene, "Mixed", vertices, [(0, 1, 2, 3), (0, 3, 4), (1, 5, 2)])
    obj.scale = scale
    reading = read()
    (target,) = reading.targets
    np.testing.assert_allclose(positions(reading.scene)[target.scene_corner], world_corners(obj), atol=1e-6)
    assert (reading.scene.face_normal[:, 2] > 0.999).all()
    # Faces keep their order, and corners stay with their face.
    face = np.repeat(np.arange(3), [len(polygon.vertices) for polygon in obj.data.polygons])
    assert (reading.scene.corner_face[target.scene_corner] == face).all()


def test_smooth_normals_follow_an_uneven_scale(read, scene):
    # Octahedron with smooth faces: its corner normals are the directions of its vertices; as it is squashed, they
    # become the normals of the ellipsoid, so x / a^2.
    vertices = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (0.6, 0.8, 0)]
    faces = [
        (0, 6, 4),
        (6, 2, 4),
        (2, 1, 4),
        (1, 3, 4),
        (3, 0, 4),
        (6, 0, 5),
        (2, 6, 5),
        (1, 2, 5),
        (3, 1, 5),
        (0, 3, 5),
    ]
    ball = add_mesh(scene, "Ball", vertices, faces)
    ball.data.shade_smooth()
    before = np.array([normal.vector[:] for normal in ball.data.corner_normals])
    ball.scale = (-2.0, 1.0, 0.5)
    reading = read()
    expected = before / np.array([-2.0, 1.0, 0.5])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(reading.scene.corner_normals[reading.targets[0].scene_corner], expected, atol=1e-5)


def test_a_scale_of_zero_flattens_without_harm(read, scene):
    box = add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES)
    box.scale = (1, 1, 0)
    found = read().scene
    assert found.live.sum() == 2
    assert np.isfinite(found.corner_normals).all()
    assert any("4 faces" in warning and "'Box'" in warning for warning in found.warnings)


def test_lengths_are_metres(read, scene):
    add_square(scene, size=2.0)
    scene.unit_settings.scale_length = 0.01
    assert np.isclose(read().scene.face_area[0], 4e-4)
    scene.unit_settings.system = 'NONE'
    assert np.isclose(read().scene.face_area[0], 4.0)


def test_each_face_has_the_material_of_its_slot(read, scene, blender):
    faces = [(0, 1, 2, 3)] * 4
    obj = add_mesh(scene, "Striped", SQUARE, faces)
    for name, reflectance in (("First", 0.1), ("Second", 0.2), ("Third", 0.3)):
        obj.data.materials.append(glowing(reflectance, name=name))
    for polygon, index in zip(obj.data.polygons, (0, 1, 2, 7), strict=True):
        polygon.material_index = index
    # An index beyond the last slot means the last slot; a slot may belong to the object, and may be empty.
    np.testing.assert_allclose(read().scene.reflectance[:, 0], [0.1, 0.2, 0.3, 0.3], rtol=1e-6)
    obj.material_slots[1].link = 'OBJECT'
    obj.material_slots[1].material = glowing(0.6, radiance=2.0)
    obj.data.materials[2] = None
    found = read().scene
    np.testing.assert_allclose(found.reflectance[:, 0], [0.1, 0.6, 0.8, 0.8], rtol=1e-6)
    np.testing.assert_allclose(found.emission[:, 0], np.pi * np.array([1, 2, 0, 0]), rtol=1e-6)


def test_faces_without_material_are_four_fifths_white(read, scene):
    add_square(scene)
    found = read().scene
    np.testing.assert_allclose(found.reflectance, 0.8)
    assert not found.emission.any() and not found.warnings


def test_a_driven_material_is_read_as_it_renders(read, scene):
    material = glowing(radiance=1.0)
    node = next(node for node in material.node_tree.nodes if node.bl_idname == 'ShaderNodeBsdfPrincipled')
    driver = node.inputs["Emission Strength"].driver_add("default_value").driver
    driver.expression = "4.0"
    add_square(scene, material=material)
    np.testing.assert_allclose(read().scene.emission, 4.0 * np.pi, rtol=1e-6)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_vertex_that_is_nowhere_costs_its_face_and_is_told(read, scene, value):
    add_square(scene, "Good")
    broken = add_square(scene, "Broken", z=1.0)
    broken.data.vertices[2].co.x = value
    found = read().scene
    assert found.live.tolist() == [True, False] and np.isfinite(found.vertices).all()
    assert any("'Broken': 1 face with a vertex at no finite place" in line for line in found.warnings)


def test_a_loose_vertex_that_is_nowhere_does_not_matter(read, scene):
    add_mesh(scene, "Loose", [*SQUARE, (np.nan, 0, 0)], [(0, 1, 2, 3)])
    found = read().scene
    assert len(found.vertices) == 4 and np.isclose(found.face_area[0], 1.0)


def test_a_hundred_thousand_loose_edges_do_not_matter(read, scene):
    wires = add_square(scene, "Wires").data
    loose = 100_000
    first = len(wires.vertices)
    wires.vertices.add(2 * loose)
    wires.edges.add(loose)
    ends = np.concatenate((np.ravel(SQUARE), np.random.default_rng(0).random(6 * loose)))
    wires.vertices.foreach_set("co", ends.astype(np.float32))
    edges = np.zeros(2 * len(wires.edges), np.int32)
    wires.edges.foreach_get("vertices", edges)
    edges[-2 * loose :] = first + np.arange(2 * loose)
    wires.edges.foreach_set("vertices", edges)
    found = read().scene
    assert len(found.vertices) == 4 and found.live.tolist() == [True]


def test_a_scene_without_faces_is_an_error_that_says_what_to_add(read, error, scene):
    with pytest.raises(error, match="add a mesh"):
        read()
    add_mesh(scene, "Points", SQUARE, [])
    with pytest.raises(error, match="add a mesh"):
        read()


def test_warnings_of_a_material_come_once(read, scene):
    material = glowing(name="Chrome")
    node = next(node for node in material.node_tree.nodes if node.bl_idname == 'ShaderNodeBsdfPrincipled')
    node.inputs["Metallic"].default_value = 1.0
    for index in range(3):
        add_square(scene, f"Square {index}", material)
    warnings = read().scene.warnings
    assert ["'Chrome'" in warning for warning in warnings] == [True]


def test_reading_changes_nothing(read, scene, blender):
    room = add_room(scene, material=glowing())
    room.scale = (-1, 1, 2)
    blender.context.view_layer.update()
    before = [list(vertex.co) for vertex in room.data.vertices], [list(row) for row in room.matrix_world]
    read()
    assert before == ([list(vertex.co) for vertex in room.data.vertices], [list(row) for row in room.matrix_world])
    assert not room.data.color_attributes and len(blender.data.meshes) == 1


def test_a_turned_object_radiates_to_where_it_looks(read, scene):
    obj = add_square(scene)
    obj.rotation_euler = (radians(90), 0, 0)
    np.testing.assert_allclose(read().scene.face_normal, [[0, -1, 0]], atol=1e-6)
