# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surfaces of objects look like: each face by its slot, read without a trace, told where it cannot be."""

from pathlib import Path

import numpy as np

from tests.blender.building import add_mesh
from tests.blender.networks import Network, grid, noisy, square


def untouched(bpy):
    """Return what there is in the file, but for the picture that a render leaves."""
    kinds = ("scenes", "objects", "meshes", "materials", "node_groups", "images", "worlds", "cameras")
    return {kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in kinds}


def test_what_cycles_reads_leaves_nothing_behind(read_surfaces, blender, scene):
    material = noisy(Network(blender, "Noisy"))
    group = blender.data.node_groups.new("Unused inside", 'ShaderNodeTree')
    material.node_tree.nodes.new('ShaderNodeGroup').node_tree = group
    obj = square(scene, material)
    links, users = len(material.node_tree.links), (group.users, material.users)
    before, layers = untouched(blender), [layer.name for layer in obj.data.color_attributes]
    (surfaces,), notes = read_surfaces(obj)
    assert notes == [] and surfaces.paint.reflectance.std() > 0.05
    assert untouched(blender) == before and [layer.name for layer in obj.data.color_attributes] == layers
    assert len(material.node_tree.links) == links and scene.render.engine != 'CYCLES'
    # Blender 4.2 counts what is inside a material once too often when that is copied.
    assert material.users == users[1] and (group.users == users[0] or blender.app.version < (4, 5, 0))


def test_each_face_has_the_material_of_its_slot(read_surfaces, blender, scene):
    painted, plain = (Network(blender, name) for name in ("Painted", "Plain"))
    image = painted.diffuse(painted.image())
    obj = grid(scene, image, 4)
    plain.diffuse((0.1, 0.2, 0.3, 1))
    for material in (None, plain.material):
        obj.data.materials.append(material)
    obj.material_slots[2].link = 'OBJECT'
    other = Network(blender, "Other")
    obj.material_slots[2].material = other.diffuse((0.4, 0.5, 0.6, 1))
    # The last is beyond the last slot and has that one's.
    index = np.array([0, 1, 2, 7] * 4, np.int32)
    obj.data.polygons.foreach_set("material_index", index)
    (surfaces,), notes = read_surfaces(obj)
    assert notes == []
    rho = surfaces.reflectance.reshape(4, 4, 3)
    np.testing.assert_allclose(rho[:, 1], 0.8)
    np.testing.assert_allclose(rho[:, 2:], np.broadcast_to((0.4, 0.5, 0.6), (4, 2, 3)), rtol=1e-6)
    assert np.ptp(rho[:, 0], axis=0).max() > 0.1
    corner = surfaces.paint.corner_reflectance.reshape(4, 4, 4, 3)
    np.testing.assert_allclose(corner[:, 1], 0.8, rtol=1e-6)


def test_missing_maps_and_attributes_are_told(read_surfaces, blender, scene):
    network = Network(blender, "Bare")
    color = network.image(Vector=network('ShaderNodeUVMap', properties={"uv_map": "Gone"}))
    material = network.shown(network('ShaderNodeBsdfDiffuse', Color=color))
    other = Network(blender, "Lone")
    other.diffuse(other('ShaderNodeAttribute', "Color", {"attribute_name": "Away"}))
    _, notes = read_surfaces(square(scene, material), square(scene, other.material, "Second"))
    assert ["'Bare'" in notes[0] and "'Gone'" in notes[0], "'Lone'" in notes[1] and "'Away'" in notes[1]] == [True] * 2


def test_without_cycles_a_constant_stands_in_and_is_told(run_blender, extension):
    """Disabling Cycles cannot be undone in one process, so this one has its own."""
    root = str(Path(extension.__file__).resolve().parent)
    done = run_blender(
        f"""
import sys, importlib, pathlib
import bpy, addon_utils
addon_utils.disable("cycles")
root = pathlib.Path({root!r})
sys.path.insert(0, str(root.parent))
module = importlib.import_module(root.name + ".radiosity_addon.face_surfaces")
bpy.ops.mesh.primitive_plane_add()
obj = bpy.context.object
material = bpy.data.materials.new("Noisy")
if material.node_tree is None:
    material.use_nodes = True
tree = material.node_tree
principled = next(node for node in tree.nodes if node.bl_idname == 'ShaderNodeBsdfPrincipled')
principled.inputs["Base Color"].default_value = (0.1, 0.2, 0.3, 1.0)
tree.links.new(tree.nodes.new('ShaderNodeTexNoise').outputs[0], principled.inputs["Base Color"])
obj.data.materials.append(material)
reader, notes = module.SurfaceReader(), []
reader.add(obj.data, obj)
(surfaces,) = reader.finish(notes)
assert abs(surfaces.reflectance - (0.1, 0.2, 0.3)).max() < 1e-6, surfaces.reflectance
assert any("'Noisy'" in note and "Cycles" in note for note in notes), notes
"""
    )
    assert done.returncode == 0, done.stderr


def test_no_node_of_blender_stops_a_reading(read_surfaces, blender, scene):
    kinds = [kind for kind in dir(blender.types) if kind.startswith("ShaderNode") and kind not in {'ShaderNodeTree'}]
    objects = []
    for kind in kinds:
        network = Network(blender, kind)
        try:
            node = network.tree.nodes.new(kind)
        except RuntimeError:
            continue  # a base class, or of other trees
        for output in node.outputs:
            if output.type == 'SHADER':
                network.shown(output)
            else:
                network.principled(Base__Color=output)
        objects.append(square(scene, network.material, kind))
    surfaces, notes = read_surfaces(*objects)
    assert len(surfaces) == len(objects) > 70
    for each in surfaces:
        assert np.isfinite(each.reflectance).all() and np.isfinite(each.emission).all()
        assert (each.reflectance >= 0).all() and (each.emission >= 0).all()
    assert all(note.startswith(("Material '", "Node")) for note in notes)


def test_paint_follows_objects_that_are_moved_and_mirrored(addon, blender, scene):
    module = addon("scene_reader")
    network = Network(blender)
    obj = grid(scene, network.diffuse(network.paint()), 3)
    obj.location, obj.scale, obj.rotation_euler = (5.0, 1.0, -2.0), (-2.0, 3.0, 1.0), (0.3, 0.0, 1.0)
    glow = Network(blender, "Glow")
    add_mesh(scene, "Lamp", [(0, 0, 9), (1, 0, 9), (0, 1, 9)], [(0, 1, 2)], glow.shown(glow('ShaderNodeEmission')))
    depsgraph = blender.context.evaluated_depsgraph_get()
    surfaces = module.read_scene(scene, blender.context.view_layer, depsgraph).scene
    matrix = np.array(obj.matrix_world)
    corners = surfaces.face_object[surfaces.corner_face] == list(surfaces.object_names).index("Grid")
    at = (surfaces.vertices[surfaces.corner_vertex[corners]] - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
    # Inside the grid the mean around a vertex is what is painted there.
    inner = ((at[:, :2] > 0.1) & (at[:, :2] < 0.9)).all(axis=1)
    expected = np.stack([at[:, 0], at[:, 1] ** 2, 0.5 * at[:, 0] * at[:, 1]], axis=1)[inner]
    np.testing.assert_allclose(surfaces.corner_reflectance[corners][inner], expected, atol=0.03)
    face = surfaces.face_start[np.flatnonzero(surfaces.face_object == surfaces.face_object[0])]
    quads = surfaces.vertices[surfaces.corner_vertex[face[:, None] + np.arange(4)]]
    known, reflected, _ = surfaces.paint.means(quads, surfaces.corner_face[face])
    assert known.all()
    np.testing.assert_allclose(reflected, surfaces.reflectance[surfaces.corner_face[face]], atol=0.02)
