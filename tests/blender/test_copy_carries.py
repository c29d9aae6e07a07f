# SPDX-License-Identifier: GPL-3.0-or-later
"""What baked copies have of their originals beside shape and light: groups, texts, weights of edges, properties."""

import numpy as np
import pytest

from tests.blender.building import add_mesh, add_square, colors, glowing, lit_floor

NAME = "Grüße" + 20 * "x"


@pytest.fixture
def bake(bake_copies):
    """Give a function that returns baked copies by their originals' names."""
    return lambda **settings: {copy["radiosity_copy_of"]: copy for copy in bake_copies(**settings)}


@pytest.fixture
def warnings(blender):
    """Give a function that returns what the panel warns of."""
    return lambda: blender.context.window_manager.radiosity.warnings.splitlines()


def floor(scene):
    """Add a glowing floor of 2 x 1 m in two faces, whose left one is a square."""
    points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)]
    return add_mesh(scene, "Floor", points, [(0, 1, 4, 3), (1, 2, 5, 4)], glowing())


def weights(obj, name):
    """Return the weight of each vertex in a group; NaN where it is not in it."""
    index = obj.vertex_groups[name].index
    found = [{group.group: group.weight for group in vertex.groups} for vertex in obj.data.vertices]
    return np.array([of.get(index, np.nan) for of in found])


@pytest.mark.parametrize("max_edge", [0.0, 0.25])
def test_vertex_groups_are_carried_with_weights_between(bake, scene, blender, warnings, max_edge):
    obj = floor(scene)
    for number in range(3):
        obj.vertex_groups.new(name=f"Other {number}")
    group = obj.vertex_groups.new(name=NAME)
    for vertex, (x, _, _) in enumerate([vertex.co for vertex in obj.data.vertices]):
        group.add([vertex], x / 2, 'REPLACE')
    obj.vertex_groups["Other 1"].add([0], 1.0, 'REPLACE')
    known = {kind: len(getattr(blender.data, kind)) for kind in ("objects", "meshes", "scenes", "node_groups")}
    copy = bake(max_edge=max_edge)["Floor"]
    assert copy.vertex_groups.keys() == obj.vertex_groups.keys()
    assert len(copy.data.vertices) == (6 if max_edge == 0.0 else 9 * 5)
    x = np.array([vertex.co.x for vertex in copy.data.vertices])
    np.testing.assert_allclose(np.nan_to_num(weights(copy, NAME)), x / 2, atol=1e-6)
    assert np.isnan(weights(copy, "Other 0")).all() and np.nanmax(weights(copy, "Other 1")) == 1.0
    if max_edge:
        # In no group, not with a weight of 0.
        assert np.isnan(weights(copy, "Other 1")[x > 1.0]).all()
        assert not [name for name in copy.data.attributes.keys() if "weight" in name]
    after = {kind: len(getattr(blender.data, kind)) for kind in known}
    assert after == known | {"objects": known["objects"] + 1, "meshes": known["meshes"] + 1}
    assert obj.data.attributes.keys() == floor(scene).data.attributes.keys() and warnings() == []


def test_what_groups_are_besides_is_carried_with_them(bake, scene):
    obj = floor(scene)
    obj.vertex_groups.new(name="Group").add([0, 1], 1.0, 'REPLACE')
    obj.data.uv_layers.new(name="Map")
    obj.data.polygons.foreach_set("use_smooth", [True, False])
    copy = bake(max_edge=0.5)["Floor"]
    assert [material.name for material in copy.data.materials] == ["Glowing"]
    assert copy.data.uv_layers.keys() == ["Map"]
    assert [polygon.use_smooth for polygon in copy.data.polygons] == [True] * 4 + [False] * 4
    assert np.ptp([vertex.co.x for vertex in copy.data.vertices]) == 2.0


def test_what_is_not_cut_stays_as_it_is_where_other_things_are_cut(bake, scene, blender, warnings):
    """A small thing that is mirrored, with a text that cuts would lose, stands on a floor that is cut."""
    lit_floor(scene)
    points = [(0, 0, 0), (0.02, 0, 0), (0.02, 0.02, 0), (0, 0.02, 0), (0, 0.04, 0)]
    small = add_mesh(scene, "Small", points, [(0, 1, 2, 3), (3, 2, 4)])
    small.location, small.scale.x = (0.5, 0.5, 0.05), -1.0
    small.data.attributes.new("Label", 'STRING', 'FACE').data[1].value = b"here"
    copies = bake(cut_large=True)
    assert len(copies["Floor"].data.polygons) > 20
    copy = copies["Small"].data
    assert [tuple(polygon.vertices) for polygon in copy.polygons] == [(0, 1, 2, 3), (3, 2, 4)]
    assert copy.attributes["Label"].data[1].value == b"here" and warnings() == []
    scene.radiosity.target = 'IN_PLACE'
    blender.ops.radiosity.bake()
    np.testing.assert_allclose(colors(copy), colors(small.data), rtol=0.1, atol=0.02)


def test_texts_stay_on_copies_that_are_not_cut_and_are_told_else(bake, scene, warnings):
    mesh = floor(scene).data
    for domain, name in (('FACE', "Label"), ('POINT', "Note")):
        mesh.attributes.new(name, 'STRING', domain).data[1].value = b"here"
    copy = bake()["Floor"]
    assert copy.data.attributes["Label"].data[1].value == b"here" and warnings() == []
    copy = bake(max_edge=0.5)["Floor"]
    assert "Label" not in copy.data.attributes
    (line,) = warnings()
    assert "'Floor'" in line and "'Label', 'Note' are left out" in line


def test_creases_bevels_and_what_uv_maps_are_for_are_carried(bake, scene):
    mesh = floor(scene).data
    values = np.linspace(0.1, 0.7, len(mesh.edges)).astype(np.float32)
    for name in ("crease_edge", "bevel_weight_edge"):
        mesh.attributes.new(name, 'FLOAT', 'EDGE').data.foreach_set("value", values)
    mesh.attributes.new("freestyle_edge", 'BOOLEAN', 'EDGE').data.foreach_set("value", [True] * len(values))
    for name in ("First", "Second", "Third"):
        mesh.uv_layers.new(name=name)
    mesh.uv_layers["Second"].active_render = True
    mesh.uv_layers.active = mesh.uv_layers["Third"]
    fine = bake(max_edge=0.5)["Floor"].data
    # Every part of an edge has the weight of its edge, edges inside of faces have none.
    parts = 2 * len(values)
    for name in ("crease_edge", "bevel_weight_edge"):
        found = np.zeros(len(fine.edges), np.float32)
        fine.attributes[name].data.foreach_get("value", found)
        np.testing.assert_allclose(np.sort(found)[-parts:], np.repeat(values, 2))
        assert (np.sort(found)[:-parts] == 0.0).all()
    assert sum(item.value for item in fine.attributes["freestyle_edge"].data) == parts
    assert fine.uv_layers.active.name == "Third"
    assert [layer.name for layer in fine.uv_layers if layer.active_render] == ["Second"]


@pytest.mark.parametrize("max_edge", [0.0, 0.5])
def test_shape_keys_are_applied_and_slots_of_the_object_show(bake, scene, blender, max_edge):
    obj = floor(scene)
    obj.shape_key_add(name="Basis")
    raised = obj.shape_key_add(name="Raised")
    for point in raised.data:
        point.co.z = 1.0
    raised.value = 0.5
    obj.material_slots[0].link = 'OBJECT'
    obj.material_slots[0].material = glowing(name="Mine")
    copy = bake(max_edge=max_edge)["Floor"]
    assert copy.data.shape_keys is None and {vertex.co.z for vertex in copy.data.vertices} == {0.5}
    assert [slot.material.name for slot in copy.material_slots] == ["Mine"]
    assert obj.data.shape_keys.key_blocks["Raised"].value == 0.5 and obj.material_slots[0].link == 'OBJECT'


def test_what_materials_ask_of_objects_is_carried(bake, scene, blender):
    obj = floor(scene)
    obj["tint"], obj["color"], obj["group"], obj["other"] = 0.25, [0.1, 0.2, 0.3], {"a": 1, "b": "text"}, obj
    obj.data["kind"] = "floor"
    obj.color, obj.pass_index, obj.visible_camera = (0.5, 0.25, 1.0, 1.0), 7, False
    # Where it stands by a parent and a constraint, it stands alone.
    parent = blender.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    obj.parent, parent.location = parent, (1, 2, 3)
    constraint = obj.constraints.new('LIMIT_LOCATION')
    constraint.use_max_z, constraint.max_z = True, 2.0
    text = blender.data.objects.new("Text", blender.data.curves.new("Text", 'FONT'))
    text.data.body, text["tint"], text.data["kind"] = "A", 0.75, "text"
    scene.collection.objects.link(text)
    tile = add_square(scene, "Tile", size=0.2)
    group = blender.data.collections.new("Group")
    group.objects.link(tile)
    scene.collection.objects.unlink(tile)
    tile["tint"] = 0.5
    place = blender.data.objects.new("Place", None)
    place.instance_type, place.instance_collection = 'COLLECTION', group
    scene.collection.objects.link(place)
    copies = bake()
    copy = copies["Floor"]
    assert copy["tint"] == 0.25 and list(copy["color"]) == [0.1, 0.2, 0.3] and copy.data["kind"] == "floor"
    assert copy["group"].to_dict() == {"a": 1, "b": "text"} and copy["other"] == obj
    assert tuple(copy.color) == (0.5, 0.25, 1.0, 1.0) and copy.pass_index == 7 and not copy.visible_camera
    assert {key for key in copy.keys() if "radiosity" in key} == {"radiosity_copy_of"}
    assert copy.parent is None and len(copy.constraints) == 0
    np.testing.assert_allclose(copy.matrix_world.translation, (1, 2, 2))
    assert copies["Text"]["tint"] == 0.75 and copies["Text"].data["kind"] == "text"
    assert copies["Tile"]["tint"] == 0.5


def with_wires(scene):
    """Add a floor with an edge from a corner of it, one that touches nothing, and a vertex alone, all with weights."""
    obj = floor(scene)
    mesh = obj.data
    mesh.vertices.add(4)
    mesh.edges.add(2)
    for index, place in enumerate([(0, 0, 1), (5, 0, 0), (5, 1, 0), (9, 9, 9)], 6):
        mesh.vertices[index].co = place
    mesh.edges[-2].vertices, mesh.edges[-1].vertices = (0, 6), (7, 8)
    mesh.update()
    obj.vertex_groups.new(name="Ends").add([6, 8, 9], 0.5, 'REPLACE')
    crease = mesh.attributes.new("crease_edge", 'FLOAT', 'EDGE')
    crease.data[len(mesh.edges) - 1].value = 0.75
    return obj


@pytest.mark.parametrize("domain", ['POINT', 'CORNER'])
@pytest.mark.parametrize("max_edge", [0.0, 0.25])
def test_edges_and_vertices_without_faces_stay(bake, scene, warnings, max_edge, domain):
    obj = with_wires(scene)
    copy = bake(max_edge=max_edge, domain=domain)["Floor"]
    place = [tuple(vertex.co) for vertex in copy.data.vertices]
    assert len(place) == len(set(place)) == (10 if max_edge == 0.0 else 9 * 5 + 4)
    wires = {
        tuple(sorted(place[end] for end in edge.vertices)): edge.index for edge in copy.data.edges if edge.is_loose
    }
    assert wires.keys() == {((0, 0, 0), (0, 0, 1)), ((5, 0, 0), (5, 1, 0))}
    assert (9, 9, 9) in place and not copy.data.validate()
    crease = copy.data.attributes["crease_edge"].data
    assert [crease[index].value for index in wires.values()] == [0.0, 0.75]
    ends = {place[index] for index in np.flatnonzero(weights(copy, "Ends") == 0.5)}
    assert ends == {(0, 0, 1), (5, 1, 0), (9, 9, 9)}
    assert warnings() == [] and len(obj.data.vertices) == 10
