# SPDX-License-Identifier: GPL-3.0-or-later
"""What the example scenes consist of in Blender: materials, objects, lamps, a camera."""

from collections.abc import Sequence
from math import radians

import bpy
import numpy as np
from grids import Grid
from mathutils import Vector


def diffuse(name: str, color: Sequence[float]) -> bpy.types.Material:
    """Make a material that reflects this share of the light."""
    return _material(name, 'ShaderNodeBsdfDiffuse', {"Color": (*color, 1.0)})


def emission(name: str, color: Sequence[float], strength: float = 1.0) -> bpy.types.Material:
    """Make a material that shines with a radiance of color times strength [W/m^2/sr]."""
    return _material(name, 'ShaderNodeEmission', {"Color": (*color, 1.0), "Strength": strength})


def _material(name: str, node: str, values: dict[str, object]) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # always there from Blender 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(node)
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    shader.location, output.location = (0, 0), (220, 0)
    for socket, value in values.items():
        shader.inputs[socket].default_value = value
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    material.diffuse_color = values["Color"]
    return material


def add(name: str, material: bpy.types.Material, *parts: Grid, smooth: bool = False) -> bpy.types.Object:
    """Add one object made of grids, welded where their vertices coincide."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    faces = np.concatenate([faces + start for (_, faces), start in zip(parts, starts, strict=False)])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    used, faces = np.unique(faces, return_inverse=True)  # a hole leaves vertices behind
    _, first, weld = np.unique(vertices[used].round(6), axis=0, return_index=True, return_inverse=True)
    mesh = bpy.data.meshes.new(name)
    # A quad that touches an axis it was turned about has become a triangle.
    quads = weld.reshape(-1)[faces.reshape(-1, 4)].tolist()
    mesh.from_pydata(vertices[used][first].tolist(), [], [list(dict.fromkeys(quad)) for quad in quads])
    mesh.materials.append(material)
    if smooth:
        mesh.shade_smooth()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def camera(
    location: Sequence[float],
    lens: float,
    size: tuple[int, int],
    *,
    sensor: float = 36.0,
    clip: float = 0.01,
    shift: float = 0.0,
) -> None:
    """Add a camera that looks along +Y and is level, so that uprights stay upright.

    Parameters
    ----------
    clip : float
        Where its view begins [m]: a camera outside a closed room looks in past the near wall.
    shift : float
        How far the picture is shifted up, in widths of the picture.
    """
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width, data.clip_start, data.shift_y = lens, sensor, clip, shift
    obj = bpy.data.objects.new("Camera", data)
    obj.location, obj.rotation_euler = location, (radians(90.0), 0.0, 0.0)
    scene = bpy.context.scene
    scene.collection.objects.link(obj)
    scene.camera = obj
    scene.render.resolution_x, scene.render.resolution_y = size


def lamp(kind: str, name: str, location: Sequence[float], target: Sequence[float], power: float) -> bpy.types.Light:
    """Add a lamp that shines from one point towards another, and that the camera does not see; return its data."""
    data = bpy.data.lights.new(name, kind)
    data.energy = power
    obj = bpy.data.objects.new(name, data)
    obj.location = location
    obj.rotation_euler = (Vector(target) - Vector(location)).to_track_quat('-Z', 'Y').to_euler()
    # A bake shows surfaces only, so neither may the picture that is compared with it.
    obj.visible_camera = False
    bpy.context.scene.collection.objects.link(obj)
    return data


def sky(color: Sequence[float], strength: float) -> None:
    """Let the world shine with one color all round, with a radiance of color times strength [W/m^2/sr]."""
    world = bpy.data.worlds.new("Sky")
    if world.node_tree is None:  # always there from Blender 5.0 on
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    shines, output = tree.nodes.new('ShaderNodeBackground'), tree.nodes.new('ShaderNodeOutputWorld')
    shines.inputs["Color"].default_value, shines.inputs["Strength"].default_value = (*color, 1.0), strength
    tree.links.new(shines.outputs[0], output.inputs["Surface"])
    bpy.context.scene.world = world
