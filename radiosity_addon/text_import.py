# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's scene file (T11) as Blender objects: every rectangle is a grid of quads, whose colors show light."""

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.rectangles import Rectangle, rectangles_to_scene
from ..core.scene import Scene
from .camera import fit_camera

# Where the file's axes go, one a column: as they are, or y upwards as OpenGL has it (and so the thesis) to Blender's z.
AXES = {
    'Z': np.eye(3),
    'Y': np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}


def build_objects(
    scene: bpy.types.Scene,
    rectangles: Sequence[Rectangle],
    subdivide: int = 1,
    *,
    name: str = "Radiosity Scene",
    up: str = 'Z',
) -> tuple[bpy.types.Object, ...]:
    """Build Blender objects from rectangles.

    Parameters
    ----------
    scene : bpy.types.Scene
        Gets a new collection with the objects, and a camera if it has none.
    rectangles : sequence of Rectangle
        Surfaces and emitters [m].
    subdivide : int
        Factor on the divisions of every rectangle.
    name : str
        Name of the collection.
    up : {'Z', 'Y'}
        The file's axis that points upwards; 'Z' keeps the coordinates as they are.

    Returns
    -------
    tuple of bpy.types.Object
        One object with n x n quads for each rectangle, named as in `rectangles_to_scene`.
    """
    surfaces = rectangles_to_scene(rectangles, subdivide)
    surfaces = replace(surfaces, vertices=surfaces.vertices @ AXES[up].T, corner_normals=None)
    collection = bpy.data.collections.new(name)
    scene.collection.children.link(collection)
    metres = 1.0 if scene.unit_settings.system == 'NONE' else scene.unit_settings.scale_length
    corners = (surfaces.vertices / metres)[surfaces.corner_vertex].reshape(-1, 4, 3)
    materials: dict[tuple[float, ...], bpy.types.Material] = {}
    objects = []
    for index, title in enumerate(surfaces.object_names):
        mesh = grid_mesh(title, corners[index], int(surfaces.divisions[index]))
        light = (*surfaces.reflectance[index], *surfaces.emission[index])
        if light not in materials:
            materials[light] = _material(surfaces.reflectance[index], surfaces.emission[index])
        mesh.materials.append(materials[light])
        obj = bpy.data.objects.new(title, mesh)
        collection.objects.link(obj)
        objects.append(obj)
    if scene.camera is None:
        fit_camera(scene, surfaces, _upwards(surfaces))
    return tuple(objects)


def grid_mesh(name: str, corners: NDArray[np.float64], n: int) -> bpy.types.Mesh:
    """Make a mesh of n x n quads over a quadrilateral.

    Parameters
    ----------
    name : str
        Name of the mesh.
    corners : ndarray of shape (4, 3)
        Counter-clockwise seen from the front; the first is the first corner of the first face.
    n : int
        Quads along each side.

    Returns
    -------
    bpy.types.Mesh
        The mesh, its faces in rows.
    """
    u, v = np.meshgrid(np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, 1.0, n + 1))
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=-1).reshape(-1, 4)
    start = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    faces = start + np.array([0, 1, n + 2, n + 1])
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(weights))
    mesh.vertices.foreach_set("co", (weights @ corners).astype(np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.astype(np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


def _material(reflectance: NDArray[np.float64], emission: NDArray[np.float64]) -> bpy.types.Material:
    """Make a material that reflects or emits; Blender's strength 1 is radiance 1, so exitance pi."""
    emits = bool(emission.any())
    material = bpy.data.materials.new("Emitter" if emits else "Surface")
    if material.node_tree is None:  # up to 4.5
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new('ShaderNodeOutputMaterial')
    shader = nodes.new('ShaderNodeEmission' if emits else 'ShaderNodeBsdfDiffuse')
    shader.location.x = output.location.x - 200.0
    strength = float(emission.max())
    color = emission / strength if emits else reflectance
    shader.inputs["Color"].default_value = (*color, 1.0)
    if emits:
        shader.inputs["Strength"].default_value = strength / np.pi
    links.new(shader.outputs[0], output.inputs["Surface"])
    material.diffuse_color = (*color, 1.0)
    return material


def _upwards(surfaces: Scene) -> tuple[float, float, float]:
    """Return the axis that looks upwards: z, unless the lamps shine along y."""
    down = surfaces.area_vector[surfaces.emission.any(axis=1)].sum(axis=0)
    along_y = down.any() and int(np.abs(down).argmax()) == 1
    return (0.0, 1.0, 0.0) if along_y else (0.0, 0.0, 1.0)
