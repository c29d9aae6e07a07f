# SPDX-License-Identifier: GPL-3.0-or-later
"""The baked copy: its shape and light, and that it has all that its original has."""

import numpy as np
import pytest

from tests.blender.building import (
    CUBE_FACES,
    CUBE_VERTICES,
    add_mesh,
    add_square,
    colors,
    glowing,
    lit_floor,
)


def world(obj):
    """Return the corners of an object in the world, shape (c, 3)."""
    mesh, matrix = obj.data, np.array(obj.matrix_world)
    points = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    return (points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])[[loop.vertex_index for loop in mesh.loops]]


def columns(items, name, width):
    values = np.zeros(len(items) * width, np.float32)
    items.foreach_get(name, values)
    return values.reshape(-1, width)


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
@pytest.mark.parametrize("data_type", ['FLOAT_COLOR', 'BYTE_COLOR'])
def test_without_cuts_it_has_the_colors_of_a_bake_in_place(bake_copies, scene, blender, domain, data_type):
    originals = lit_floor(scene)
    originals[1].scale = (-1.0, 1.0, 1.0)
    originals[1].location.x = 1.0
    copies = bake_copies(domain=domain, data_type=data_type)
    assert not any(obj.data.color_attributes for obj in originals)
    scene.radiosity.target = 'IN_PLACE'
    blender.ops.radiosity.bake()
    for original, copy in zip(originals, copies, strict=True):
        assert copy.name == copy.data.name == f"{original.name} Baked"
        np.testing.assert_array_equal(colors(copy.data), colors(original.data))
        np.testing.assert_allclose(world(copy), world(original), atol=1e-6)
        layer = copy.data.color_attributes["Radiosity"]
        assert (layer.domain, layer.data_type) == (domain, data_type)
        assert copy.data.color_attributes.active_color == layer


@pytest.mark.parametrize("scale", [1.0, -1.0])
def test_faces_are_as_fine_as_the_patches_and_shadows_show_between_far_vertices(bake_copies, scene, scale):
    _, floor = lit_floor(scene)
    # A plate that hides the lamp from the middle of the floor only.
    add_mesh(scene, "Plate", [(0.9, 0.4, 0.1), (1.1, 0.4, 0.1), (1.1, 0.6, 0.1), (0.9, 0.6, 0.1)], [(0, 1, 2, 3)])
    floor.scale.x, floor.location.x = scale, 1.0 - scale
    _, copy, _ = bake_copies(max_edge=0.1)
    assert len(floor.data.polygons) == 1 and len(copy.data.polygons) == 200 and len(copy.data.vertices) == 21 * 11
    place, light = world(copy), colors(copy.data)[:, 0]
    under = np.linalg.norm(place - (1.0, 0.5, 0.0), axis=1) < 0.01
    beside = np.linalg.norm(place - (1.0, 0.0, 0.0), axis=1) < 0.01
    assert light[under].max() < 0.4 * light[beside].min()
    # It faces where the original does.
    assert all(polygon.normal.z > 0.9 for polygon in copy.data.polygons)
    assert np.sign(np.linalg.det(np.array(copy.matrix_world)[:3, :3])) == scale


def test_large_faces_are_cut_where_nobody_has_chosen_a_size(bake_copies, scene, blender):
    _, floor = lit_floor(scene)
    add_mesh(scene, "Plate", [(0.9, 0.4, 0.1), (1.1, 0.4, 0.1), (1.1, 0.6, 0.1), (0.9, 0.6, 0.1)], [(0, 1, 2, 3)])
    copy = bake_copies(cut_large=True)[1]
    place, light = world(copy), colors(copy.data)[:, 0]
    under, beside = (np.linalg.norm(place - at, axis=1).argmin() for at in ((1.0, 0.5, 0.0), (1.0, 0.0, 0.0)))
    assert light[under] < 0.4 * light[beside]
    assert len(floor.data.polygons) == 1 and not floor.data.color_attributes
    # A size, or the wish to leave faces as they are, is heard.
    assert len(bake_copies(cut_large=True, max_edge=0.5)[1].data.polygons) == 8
    assert len(bake_copies(cut_large=False, max_edge=0.0)[1].data.polygons) == 1


def test_everything_that_a_mesh_carries_is_on_the_finer_one(bake_copies, scene, blender):
    lit_floor(scene)
    box = add_mesh(scene, "Box", np.array(CUBE_VERTICES) * (2, 1, 1), CUBE_FACES, glowing(name="A"))
    mesh = box.data
    mesh.materials.append(glowing(name="B"))
    mesh.polygons.foreach_set("material_index", [0, 1, 0, 1, 0, 1])
    uv = mesh.uv_layers.new(name="Map")
    first, second = np.array([(1, 2), (3, -1), (0.5, 4)], float), (0.25, 0.5)
    corner = np.array(CUBE_VERTICES)[[loop.vertex_index for loop in mesh.loops]] * (2, 1, 1)
    uv.data.foreach_set("uv", (corner @ first + second).astype(np.float32).ravel())
    mesh.uv_layers.new(name="Other")
    heat = mesh.attributes.new("Heat", 'FLOAT', 'POINT')
    heat.data.foreach_set("value", np.array(CUBE_VERTICES)[:, 0] * 2.0)
    number = mesh.attributes.new("Number", 'INT', 'FACE')
    number.data.foreach_set("value", [10, 11, 12, 13, 14, 15])
    mesh.edges[0].use_edge_sharp = mesh.edges[1].use_seam = True
    paint = mesh.color_attributes.new("Paint", 'BYTE_COLOR', 'CORNER')
    paint.data.foreach_set("color", np.tile((1.0, 0.0, 0.0, 1.0), 24))
    mesh.polygons.foreach_set("use_smooth", [True] * 5 + [False])
    normals = np.array([tuple(normal.vector) for normal in mesh.corner_normals])

    copy = bake_copies(max_edge=0.4)[-1]
    fine = copy.data
    assert len(fine.polygons) == 2 * (3 * 3) + 4 * (5 * 3)
    place = world(copy)
    np.testing.assert_allclose(columns(fine.uv_layers["Map"].data, "uv", 2), place @ first + second, atol=1e-5)
    assert fine.uv_layers.active.name == mesh.uv_layers.active.name and "Other" in fine.uv_layers
    points = columns(fine.vertices, "co", 3)
    np.testing.assert_allclose(columns(fine.attributes["Heat"].data, "value", 1)[:, 0], points[:, 0], atol=1e-6)
    # The number tells which face each was; so does the material.
    numbers = np.zeros(len(fine.polygons), np.int32)
    fine.attributes["Number"].data.foreach_get("value", numbers)
    for polygon, face in zip(fine.polygons, numbers - 10, strict=True):
        assert polygon.material_index == face % 2
        np.testing.assert_allclose(polygon.normal, mesh.polygons[face].normal, atol=1e-5)
        assert polygon.use_smooth == mesh.polygons[face].use_smooth
    assert [material.name for material in fine.materials] == ["A", "B"]
    for name in ("use_edge_sharp", "use_seam"):
        marked = [edge for edge in fine.edges if getattr(edge, name)]
        (whole,) = [edge for edge in mesh.edges if getattr(edge, name)]
        ends = np.array([mesh.vertices[vertex].co for vertex in whole.vertices])
        length = np.linalg.norm(ends[0] - ends[1])
        assert len(marked) == (5 if length > 1.5 else 3)
        between = [np.array(fine.vertices[vertex].co) for edge in marked for vertex in edge.vertices]
        assert all(np.isclose(sum(np.linalg.norm(ends - point, axis=1)), length) for point in between)
    np.testing.assert_array_equal(colors(fine, "Paint")[:, :3], np.tile((1.0, 0.0, 0.0), (len(fine.loops), 1)))
    # Shaded as before, smoothly from corner to corner.
    shading = np.array([tuple(normal.vector) for normal in fine.corner_normals])
    for index, vertex in enumerate(loop.vertex_index for loop in fine.loops):
        if vertex < 8:
            here = [k for k, loop in enumerate(mesh.loops) if loop.vertex_index == vertex]
            assert np.abs(normals[here] - shading[index]).sum(axis=1).min() < 2e-3
    assert [name for name in mesh.color_attributes.keys()] == ["Paint"]


def test_modifiers_instances_linked_duplicates_and_text_have_light_of_their_own(bake_copies, scene, blender):
    _, floor = lit_floor(scene)
    duplicate = blender.data.objects.new("Dark", floor.data)
    duplicate.location.z = -1.0
    group = blender.data.collections.new("Group")
    add_square(scene, "Tile", size=0.2)
    group.objects.link(blender.data.objects["Tile"])
    scene.collection.objects.unlink(blender.data.objects["Tile"])
    for x in (0.3, 5.0):
        place = blender.data.objects.new("Place", None)
        place.instance_type, place.instance_collection, place.location = 'COLLECTION', group, (x, 0.3, 0.1)
        scene.collection.objects.link(place)
    array = add_square(scene, "Row", size=0.1)
    array.modifiers.new("Array", 'ARRAY').count = 3
    text = blender.data.objects.new("Text", blender.data.curves.new("Text", 'FONT'))
    text.data.body = "A"
    for obj in (duplicate, text):
        scene.collection.objects.link(obj)
    known = {obj.name for obj in blender.data.objects}
    copies = bake_copies()
    names = ["Lamp", "Floor", "Tile", "Tile", "Row", "Dark", "Text"]
    assert sorted(copy["radiosity_copy_of"] for copy in copies) == sorted(names)
    # Of seven copies only those that are too coarse for their light are told of.
    told = blender.context.window_manager.radiosity.warnings.splitlines()
    assert all("too large" in line or "sides differ" in line for line in told)
    by_name = {}
    for copy in copies:
        by_name.setdefault(copy["radiosity_copy_of"], []).append(copy)
    assert len(by_name["Row"][0].data.polygons) == 3
    assert colors(by_name["Floor"][0].data)[:, 0].min() > 4 * colors(by_name["Dark"][0].data)[:, 0].max()
    near, far = sorted(by_name["Tile"], key=lambda copy: copy.location.x)
    assert colors(near.data)[:, 0].min() > 10 * colors(far.data)[:, 0].max() and near.data != far.data
    assert all(copy.data.users == 1 for copy in copies)
    # Nothing but the copies is new; no base of a copy is left over.
    assert {obj.name for obj in blender.data.objects} - known == {copy.name for copy in copies}
    assert all(mesh.users for mesh in blender.data.meshes)


def test_a_stretched_parent_shears_the_copy_too(bake_copies, scene, blender):
    lit_floor(scene)
    parent = blender.data.objects.new("Parent", None)
    parent.scale = (1, 3, 1)
    scene.collection.objects.link(parent)
    child = add_square(scene, "Child", size=0.2)
    child.parent, child.rotation_euler = parent, (0.0, 0.0, 0.6)
    blender.context.view_layer.update()
    copy = next(copy for copy in bake_copies() if copy["radiosity_copy_of"] == "Child")
    np.testing.assert_allclose(world(copy), world(child), atol=1e-6)


def test_what_has_the_name_but_is_no_color_gives_way_on_the_copy_only(bake_copies, scene, blender):
    _, floor = lit_floor(scene)
    floor.data.attributes.new("Radiosity", 'FLOAT', 'POINT')
    copy = bake_copies(max_edge=0.5)[1]
    assert copy.data.attributes["Radiosity"].data_type == 'FLOAT_COLOR'
    assert floor.data.attributes["Radiosity"].data_type == 'FLOAT'
    (warning,) = blender.context.window_manager.radiosity.warnings.splitlines()
    assert "'Floor'" in warning and "'Radiosity'" in warning


def test_the_report_tells_what_was_read_and_what_was_chosen(addon, core, scene, blender):
    lit_floor(scene)
    scene.radiosity.target, scene.radiosity.max_edge = 'COPY', 0.25
    exhaust = core("progress").exhaust
    report = exhaust(addon("operators").start_bake(blender.context)).report
    assert report["scene"] == {"objects": 2, "faces": 2, "vertices": 8}
    assert report["patches"] == 16 + 32 and report["settings"]["max_edge"] == 0.25
    assert report["settings"]["target"] == 'COPY'
    assert report["objects"] == [
        {"name": "Lamp", "corners": 4, "written": True},
        {"name": "Floor", "corners": 4, "written": True},
    ]


@pytest.mark.parametrize("max_edge", [0.0, 0.4])
def test_faces_that_blender_takes_for_broken_do_no_harm(bake_copies, scene, max_edge):
    lit_floor(scene)
    points = [(0, 0, 0.1), (1, 0, 0.1), (1, 1, 0.1), (0, 1, 0.1), (3, 0, 0)]
    faces = [(0, 1, 1, 2), (0, 2, 0, 3), (1, 1, 1), (0, 1, 2, 3), (0, 1, 2, 3)]
    mesh = add_mesh(scene, "Broken", points, faces).data
    mesh.shade_smooth()
    copy = bake_copies(max_edge=max_edge)[-1]
    assert np.isfinite(colors(copy.data)).all() and colors(copy.data)[:, 0].max() > 0.0
    assert len(copy.data.polygons) == 5 if max_edge == 0.0 else len(copy.data.polygons) > 9
