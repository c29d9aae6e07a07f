# SPDX-License-Identifier: GPL-3.0-or-later
"""Put a benchmark scene into Blender, read its corners and bake it with Cycles to a colour attribute."""

import math
import time
from collections.abc import Iterable

import bpy
import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry
from .scenes import Item, Part

ATTRIBUTE = "Cycles"


def build(items: Iterable[Item]) -> list[bpy.types.Object]:
    """Empty Blender and link one mesh object per item; nothing but their materials gives light."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = None
    objects = []
    for item in items:
        mesh = bpy.data.meshes.new(item.name)
        vertices: list[NDArray[np.float64]] = []
        faces: list[list[int]] = []
        slots: list[int] = []
        for slot, part in enumerate(item.parts):
            mesh.materials.append(_material(f"{item.name} {slot}", part, item.front_only))
            if not vertices or vertices[-1] is not part.mesh.vertices:
                vertices.append(part.mesh.vertices)
            start = sum(map(len, vertices[:-1]))
            faces += [[start + corner for corner in face if corner >= 0] for face in part.mesh.faces.tolist()]
            slots += [slot] * len(part.mesh.faces)
        mesh.from_pydata(np.concatenate(vertices).tolist(), [], faces)
        mesh.polygons.foreach_set("material_index", slots)
        mesh.polygons.foreach_set("use_smooth", [item.smooth] * len(faces))
        add_attribute(mesh)
        mesh.update()
        objects.append(bpy.data.objects.new(item.name, mesh))
        scene.collection.objects.link(objects[-1])
    return objects


def add_attribute(mesh: bpy.types.Mesh, domain: str = 'CORNER') -> None:
    """Give a mesh the attribute that `bake` writes to."""
    mesh.color_attributes.active_color = mesh.color_attributes.new(ATTRIBUTE, 'FLOAT_COLOR', domain)


def _material(name: str, part: Part, front_only: bool) -> bpy.types.Material:
    """Return a material that is an emitter (on its front only, when wanted) or a diffuse reflector."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    glows = max(part.radiance) > 0
    shader = nodes.new("ShaderNodeEmission" if glows else "ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*(part.radiance if glows else part.reflectance), 1.0)
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    if glows and front_only:
        front = nodes.new("ShaderNodeMath")
        front.operation = 'SUBTRACT'
        front.inputs[0].default_value = 1.0
        backfacing = nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
        material.node_tree.links.new(backfacing, front.inputs[1])
        material.node_tree.links.new(front.outputs[0], shader.inputs["Strength"])
    return material


def read(items: Iterable[Item], objects: Iterable[bpy.types.Object]) -> Geometry:
    """Read the objects back as arrays, corners in Blender's order."""
    parts: dict[str, list[NDArray[np.generic]]] = {}
    names = []
    vertex_count = corner_count = 0
    for index, (item, obj) in enumerate(zip(items, objects, strict=True)):
        mesh = obj.data
        names.append(obj.name)
        slot = _numbers(mesh.polygons, "material_index", 1, np.int32)[:, 0]
        found = {
            "vertices": _numbers(mesh.vertices, "co", 3, np.float32),
            "corner_vertex": _numbers(mesh.loops, "vertex_index", 1, np.int32)[:, 0] + vertex_count,
            "face_start": _numbers(mesh.polygons, "loop_start", 1, np.int32)[:, 0] + corner_count,
            "corner_normals": _numbers(mesh.corner_normals, "vector", 3, np.float32),
            "reflectance": np.array([part.reflectance for part in item.parts])[slot],
            "emission": math.pi * np.array([part.radiance for part in item.parts])[slot],
            "face_object": np.full(len(slot), index),
            "sides": np.full(len(slot), 3 if item.both_sides else 1, dtype=np.uint8),
        }
        vertex_count += len(mesh.vertices)
        corner_count += len(mesh.loops)
        for key, values in found.items():
            parts.setdefault(key, []).append(values)
    arrays = {key: np.concatenate(values) for key, values in parts.items()}
    arrays["face_start"] = np.append(arrays["face_start"], corner_count)
    return Geometry(object_names=tuple(names), **arrays)


def _numbers(collection: bpy.types.bpy_prop_collection, name: str, width: int, dtype: type) -> NDArray[np.generic]:
    """Return one property of all elements as an array of shape (n, width)."""
    values = np.zeros(len(collection) * width, dtype=dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def bake(
    objects: list[bpy.types.Object], samples: int, seed: int, threads: int = 0, bounces: int = 128
) -> tuple[NDArray[np.float64], float]:
    """Bake outgoing radiance with Cycles.

    Parameters
    ----------
    objects : list of bpy.types.Object
        What to bake, each with what `add_attribute` adds.
    samples, seed : int
        Paths a corner, without adaptive sampling, and where their random numbers start.
    threads : int
        Threads to use; 0 leaves it to Blender.
    bounces : int
        At most; 0 is direct light.

    Returns
    -------
    radiance : ndarray of shape (c, 3)
        At their face corners, or vertices if that is the attribute's domain [W/m^2/sr].
    seconds : float
        Time of the bake alone.
    """
    scene = bpy.context.scene
    scene.render.engine = 'CYCLES'
    scene.render.threads_mode = 'FIXED' if threads else 'AUTO'
    if threads:
        scene.render.threads = threads
    settings = scene.cycles
    settings.device = 'CPU'
    settings.samples, settings.seed = samples, seed
    settings.use_adaptive_sampling = False
    # The denoiser would take the list of corners for a picture and smear unrelated corners into each other.
    settings.use_denoising = False
    settings.sample_clamp_direct = settings.sample_clamp_indirect = 0.0
    settings.max_bounces = settings.diffuse_bounces = settings.transmission_bounces = bounces
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    start = time.perf_counter()
    bpy.ops.object.bake(type='COMBINED', target='VERTEX_COLORS')
    seconds = time.perf_counter() - start
    colours = [_numbers(obj.data.color_attributes[ATTRIBUTE].data, "color", 4, np.float32)[:, :3] for obj in objects]
    return np.concatenate(colours).astype(np.float64), seconds
