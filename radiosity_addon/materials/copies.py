# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of what has nodes, for Cycles to show as it would be read: without gloss, seen by diffuse light."""

from __future__ import annotations

from typing import TypeVar

import bpy

from .images import NEUTRAL

Shown = TypeVar("Shown", bpy.types.Material, bpy.types.World, bpy.types.Light)
_IMAGES = {'ShaderNodeTexImage', 'ShaderNodeTexEnvironment'}
# What a ray of diffuse light is; everything else is 0.
_SEEN = {'Is Diffuse Ray', 'Is Reflection Ray', 'Ray Depth', 'Diffuse Depth'}


def readable_copy(block: Shown, made: list[bpy.types.ID]) -> Shown:
    """Copy a material, a world or a light with all groups in it.

    Parameters
    ----------
    block : bpy.types.Material, bpy.types.World or bpy.types.Light
        It has nodes.
    made : list
        The copies are added to it.

    Returns
    -------
    bpy.types.Material, bpy.types.World or bpy.types.Light
    """
    copy = block.copy()
    made.append(copy)
    _prepare(copy.node_tree, made)
    return copy


def _prepare(tree: bpy.types.NodeTree, made: list[bpy.types.ID]) -> None:
    for node in list(tree.nodes):
        if node.bl_idname == 'ShaderNodeGroup' and node.node_tree is not None:
            node.node_tree = node.node_tree.copy()
            made.append(node.node_tree)
            _prepare(node.node_tree, made)
        elif node.bl_idname == 'ShaderNodeOutputMaterial':
            # Displaced points would be elsewhere.
            for name in ("Displacement", "Volume"):
                _cut(tree, node.inputs[name])
        elif node.bl_idname == 'ShaderNodeOutputWorld':
            # A fog without end would hide the sky.
            _cut(tree, node.inputs["Volume"])
        elif node.bl_idname == 'ShaderNodeBsdfPrincipled':
            # What the gloss above the base takes away comes back as gloss.
            gloss = node.inputs["Specular IOR Level"]
            _cut(tree, gloss)
            gloss.default_value = 0.0
        elif node.bl_idname == 'ShaderNodeLightPath':
            for output in node.outputs:
                _replace(tree, output, 1.0 if output.identifier in _SEEN else 0.0)
        elif node.bl_idname in _IMAGES and _lacks_image(node):
            # Cycles would show pink.
            _replace(tree, node.outputs["Color"], NEUTRAL)
            for alpha in node.outputs[1:]:
                _replace(tree, alpha, 1.0)


def lacking_images(tree: bpy.types.NodeTree) -> list[str]:
    """Tell which images a node tree wants to show but has not, those of its groups included, one line each."""
    lines: dict[str, None] = {}
    for node in tree.nodes:
        if node.bl_idname == 'ShaderNodeGroup' and node.node_tree is not None:
            lines |= dict.fromkeys(lacking_images(node.node_tree))
        elif node.bl_idname in _IMAGES and _lacks_image(node) and any(output.is_linked for output in node.outputs):
            image = node.image
            line = f"'{node.name}' has no image" if image is None else f"image '{image.name_full}' is missing"
            lines[line] = None
    return list(lines)


def _lacks_image(node: bpy.types.ShaderNode) -> bool:
    """Tell whether a node has no image, or one whose file is missing."""
    return node.image is None or 0 in node.image.size[:]


def _cut(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> None:
    for link in list(socket.links):
        tree.links.remove(link)


def _replace(tree: bpy.types.NodeTree, output: bpy.types.NodeSocket, value: float) -> None:
    """Let an output give a constant."""
    targets = [link.to_socket for link in output.links]
    if not targets:
        return
    constant = tree.nodes.new('ShaderNodeValue')
    constant.outputs[0].default_value = value
    for target in targets:
        tree.links.new(constant.outputs[0], target)
