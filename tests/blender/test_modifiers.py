# SPDX-License-Identifier: GPL-3.0-or-later
"""Modifiers: what they make gives, blocks and gets light, and the light finds its way back to the mesh they change."""

import numpy as np
import pytest

from tests.blender.building import CUBE_FACES, CUBE_VERTICES, add_mesh, add_room, add_square, colors, glowing

# Faces of three, four and five corners, one of them not convex, one edge and one vertex without faces.
VERTICES = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (-1, 1, 0.5), (4, 0, 0), (4, 2, 0), (9, 9, 9), (3.5, 1, 0)]
FACES = [(0, 1, 2, 3), (0, 3, 4), (1, 5, 8, 6, 2)]


def modify(obj, kind, **settings):
    modifier = obj.modifiers.new(kind.title(), kind)
    for name, value in settings.items():
        setattr(modifier, name, value)
    return modifier


def applied(blender, obj):
    """Replace an object's mesh by what its modifiers make of it."""
    depsgraph = blender.context.evaluated_depsgraph_get()
    mesh = blender.data.meshes.new_from_object(obj.evaluated_get(depsgraph), depsgraph=depsgraph)
    obj.modifiers.clear()
    obj.data = mesh


def corner_positions(reading, target):
    return reading.scene.vertices[reading.scene.corner_vertex[target.scene_corner]]


def own_corners(obj):
    return np.array([obj.matrix_world @ obj.data.vertices[loop.vertex_index].co for loop in obj.data.loops])


def test_copies_of_an_array_are_lit_and_cast_shadows_like_a_mesh_with_all_of_them(bake, scene, blender):
    add_room(scene, material=glowing())
    board = add_mesh(
        scene, "Board", [(0.1, 0.1, 0.5), (0.4, 0.1, 0.5), (0.4, 0.4, 0.6)], [(0, 1, 2)], glowing(0.3, 0.0)
    )
    modify(board, 'ARRAY', count=3, relative_offset_displace=(0.8, 0.9, 0.0))
    bake()
    room, own = colors(scene.objects["Room"].data), colors(board.data)
    applied(blender, board)
    assert len(board.data.polygons) == 3
    bake()
    np.testing.assert_array_equal(colors(scene.objects["Room"].data), room)
    np.testing.assert_array_equal(colors(board.data)[:3], own)


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ('ARRAY', {"count": 3}),
        ('MIRROR', {}),
        ('SOLIDIFY', {}),
        ('EDGE_SPLIT', {"split_angle": 0.0}),
        ('TRIANGULATE', {}),
        ('SUBSURF', {"subdivision_type": 'SIMPLE', "levels": 2}),
    ],
)
def test_each_corner_finds_itself_behind_a_modifier(read, scene, kind, settings):
    obj = add_mesh(scene, "Mesh", VERTICES, FACES)
    obj.scale, obj.location = (-1, 2, 1), (3, 0, 1)  # mirrored
    modify(obj, kind, **settings)
    reading = read()
    (target,) = reading.targets
    assert target.carried.name == 'FOUND'
    assert len(target.evaluated.corner_vertex) >= len(target.corner_vertex) == 12
    np.testing.assert_allclose(corner_positions(reading, target), own_corners(obj), atol=1e-5)
    found, starts = reading.scene, reading.scene.face_start
    middles = np.add.reduceat(found.vertices[found.corner_vertex], starts[:-1], axis=0) / np.diff(starts)[:, None]
    own = np.repeat([obj.matrix_world @ face.center for face in obj.data.polygons], (4, 3, 5), axis=0)
    # The evaluated face lies on that side of the corner on which its own face lies; a notch is not that clear.
    way = middles[found.corner_face[target.scene_corner]] - own_corners(obj)
    assert (np.einsum("ij,ij->i", way, own - own_corners(obj)) > -0.1).all()


@pytest.mark.parametrize(("vertices", "faces"), [(VERTICES, FACES), (CUBE_VERTICES, CUBE_FACES)])
@pytest.mark.parametrize("levels", [1, 3])
def test_each_corner_finds_its_part_of_a_smooth_subdivided_face(read, scene, vertices, faces, levels):
    obj = add_mesh(scene, "Mesh", vertices, faces)
    modify(obj, 'SUBSURF', levels=levels)
    modify(obj, 'ARRAY', count=2)
    (target,) = read().targets
    assert target.carried.name == 'FOUND'
    assert (target.evaluated.corner_vertex[target.scene_corner] == target.corner_vertex).all()
    sizes = np.array([len(face) for face in faces])
    parts = np.where(sizes == 4, 4**levels, sizes * 4 ** (levels - 1))
    face = np.searchsorted(np.cumsum(parts), target.scene_corner // 4, side="right")
    assert face.tolist() == np.repeat(np.arange(len(faces)), sizes).tolist()


@pytest.mark.parametrize(
    ("kind", "settings"),
    [('BEVEL', {"width": 0.05}), ('REMESH', {"octree_depth": 6}), ('WIREFRAME', {"thickness": 0.02})],
)
def test_what_nothing_is_known_of_takes_the_light_of_the_nearest_corners(read, scene, kind, settings):
    obj = add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES)
    modify(obj, kind, **settings)
    reading = read()
    (target,) = reading.targets
    assert target.carried.name == 'NEAREST'
    away = np.linalg.norm(corner_positions(reading, target) - own_corners(obj), axis=1)
    assert away.max() < 0.12
    normals = np.repeat([polygon.normal for polygon in obj.data.polygons], 4, axis=0)
    found = reading.scene.corner_normals[target.scene_corner]
    assert (np.einsum("ij,ij->i", found, normals) > 0.5).all()


def test_of_too_many_corners_some_that_lie_close_are_searched(read, addon, scene, monkeypatch):
    obj = add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES)
    modify(obj, 'REMESH', octree_depth=6)
    monkeypatch.setattr(addon("objects.corner_maps"), "_MOST_PLACES", 500)
    reading = read()
    (target,) = reading.targets
    assert len(target.evaluated.corner_vertex) > 2000
    assert np.linalg.norm(corner_positions(reading, target) - own_corners(obj), axis=1).max() < 0.25


def test_neighbours_in_one_plane_keep_their_materials_apart(read, scene):
    dark, bright = glowing(0.1, 0.0, "Dark"), glowing(0.9, 0.0, "Bright")
    obj = add_mesh(scene, "Strip", [(x, y, 0) for x in range(3) for y in range(2)], [(0, 2, 3, 1), (2, 4, 5, 3)], dark)
    obj.data.materials.append(bright)
    obj.data.polygons[1].material_index = 1
    modify(obj, 'BEVEL', affect='VERTICES', width=0.1)
    reading = read()
    reflectance = reading.scene.reflectance[reading.scene.corner_face[reading.targets[0].scene_corner], 0]
    np.testing.assert_allclose(reflectance, np.repeat([0.1, 0.9], 4), rtol=1e-6)


def test_what_was_carried_back_is_told_once_for_each_object(bake, scene, blender):
    add_room(scene, material=glowing())
    for name, kind in (("Arrayed", 'ARRAY'), ("Bevelled", 'BEVEL')):
        modify(add_mesh(scene, name, np.array(CUBE_VERTICES) * 0.2 + 0.3, CUBE_FACES), kind)
    bake()
    warnings = blender.context.window_manager.radiosity.warnings.splitlines()
    assert [line for line in warnings if "modifiers" in line] == [
        "Object 'Arrayed': its modifiers change the faces; colors are carried back to the original corners; choose "
        "Baked Copy to keep them all",
        "Object 'Bevelled': its modifiers change the faces; colors are brought from the nearest corners to the "
        "original corners; choose Baked Copy to keep them all",
    ]


def test_modifiers_that_take_the_colors_away_again_are_told(bake, scene, blender):
    add_room(scene, material=glowing())
    for name, kind, chosen in (("Voxels", 'REMESH', {"voxel_size": 0.05}), ("Bevelled", 'BEVEL', {})):
        modify(add_mesh(scene, name, np.array(CUBE_VERTICES) * 0.2 + 0.3, CUBE_FACES), kind, **chosen)
    bake()
    warnings = blender.context.window_manager.radiosity.warnings.splitlines()
    assert [line for line in warnings if "none show" in line] == [
        "Object 'Voxels': its modifiers take colors away again, so none show; choose Baked Copy"
    ]


def test_faces_that_modifiers_take_away_or_make_are_told(read, addon, scene, blender):
    gone = add_square(scene, "Gone")
    modify(gone, 'MASK', vertex_group=gone.vertex_groups.new(name="Nothing").name)
    ribbon = add_mesh(scene, "Ribbon", [(0, 0, 0), (1, 0, 0)], [])
    ribbon.data.edges.add(1)
    ribbon.data.edges[0].vertices = (0, 1)
    modify(ribbon, 'SCREW', angle=0.0, screw_offset=1.0, steps=2, render_steps=2)
    reading = read()
    assert [target.object_name for target in reading.targets] == ["Ribbon"] and len(reading.scene.face_area) > 0
    assert [line for line in reading.scene.warnings if "'Gone'" in line] == [
        "Object 'Gone': its modifiers leave none of its faces"
    ]
    chosen, warnings = addon("objects.targets").stored_in_place(reading.targets)
    assert not chosen
    assert warnings == ["1 object with faces by modifiers only ('Ribbon') gets no colors in place; choose Baked Copy"]


def test_shape_keys_armatures_and_multires_are_read_as_they_look(read, scene, blender):
    keyed = add_square(scene, "Keyed")
    keyed.shape_key_add(name="Basis")
    key = keyed.shape_key_add(name="Up")
    for point in key.data:
        point.co.z += 2.0
    key.value = 0.5
    bones = blender.data.armatures.new("Bones")
    rig = blender.data.objects.new("Rig", bones)
    scene.collection.objects.link(rig)
    blender.context.view_layer.objects.active = rig
    blender.ops.object.mode_set(mode='EDIT')
    bones.edit_bones.new("Bone").tail = (0, 0, 1)
    blender.ops.object.mode_set(mode='OBJECT')
    posed = add_square(scene, "Posed")
    posed.vertex_groups.new(name="Bone").add(range(4), 1.0, 'REPLACE')
    modify(posed, 'ARMATURE', object=rig)
    rig.pose.bones["Bone"].location = (0, 3, 0)
    sculpted = add_square(scene, "Sculpted")
    modify(sculpted, 'MULTIRES')
    blender.context.view_layer.objects.active = sculpted
    blender.ops.object.multires_subdivide(modifier="Multires", mode='SIMPLE')
    reading = read()
    heights = [corner_positions(reading, target)[:, 2] for target in reading.targets]
    np.testing.assert_allclose(heights, [[1.0] * 4, [3.0] * 4, [0.0] * 4], atol=1e-6)
    assert [target.carried.name for target in reading.targets] == ['SAME', 'SAME', 'FOUND']
    assert len(reading.scene.face_area) == 1 + 1 + 4
