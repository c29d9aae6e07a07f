# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids with a baked attribute, the triangles of glTF files, and all data of a file, for tests of the export."""

import numpy as np


def light_at(positions):
    """Colors that say where they are, from 0 to far above 1."""
    return np.stack([positions[:, 0] / 2, positions[:, 1], 0.5 * positions[:, 0] * positions[:, 1]], axis=1)


def light_of(faces):
    """Colors that say which face they are of."""
    return np.stack([0.1 * faces, 1.3 - 0.2 * faces, np.full(len(faces), 0.25)], axis=1)


def add_grid(bpy, scene, domain, name="Wall", slots=("Plaster", None, "Paint")):
    """Add a row of four unit quads in the xy plane, with a baked attribute and a material slot for each name."""
    mesh = bpy.data.meshes.new(f"{name} mesh")
    points = [(x, y, 0.0) for y in (0.0, 1.0) for x in range(5)]
    mesh.from_pydata(points, [], [(x, x + 1, x + 6, x + 5) for x in range(4)])
    for slot in slots:
        mesh.materials.append(slot and (bpy.data.materials.get(slot) or bpy.data.materials.new(slot)))
    mesh.polygons.foreach_set("material_index", [number % max(len(slots), 1) for number in range(4)])
    layer = mesh.color_attributes.new("Radiosity", 'FLOAT_COLOR', domain)
    colors = np.ones((len(layer.data), 4), np.float32)
    colors[:, :3] = light_at(np.array(points)) if domain == 'POINT' else light_of(np.repeat(np.arange(4), 4))
    layer.data.foreach_set("color", colors.ravel())
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def depsgraph(bpy):
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def triangles(glb, path):
    """Return all triangles of a file: positions in Blender's axes (t, 3, 3) and colors (t, 3, 4)."""
    primitives = list(glb.mesh_primitives(glb.read_glb(path)))
    x, y, z = np.concatenate([primitive.positions for primitive in primitives]).transpose(2, 0, 1)
    return np.stack([x, -z, y], axis=-1), np.concatenate([primitive.colors for primitive in primitives])


def data_of(bpy):
    """Return everything in the file by kind, with how often it is used."""
    kinds = ("objects", "meshes", "materials", "scenes", "cameras", "images", "collections", "node_groups", "worlds")
    found = {kind: [(item.name, item.users) for item in getattr(bpy.data, kind)] for kind in kinds}
    found["nodes"] = [len(material.node_tree.nodes) if material.node_tree else 0 for material in bpy.data.materials]
    found["slots"] = [[slot.material for slot in obj.material_slots] for obj in bpy.data.objects]
    found["selected"] = [obj.name for obj in bpy.context.view_layer.objects if obj.select_get()]
    found["active"] = bpy.context.view_layer.objects.active
    found["scene"] = (bpy.context.window.scene, bpy.context.window.view_layer)
    found["layers"] = [
        ([layer.name for layer in mesh.color_attributes], mesh.color_attributes.render_color_index)
        for mesh in bpy.data.meshes
    ]
    return found
