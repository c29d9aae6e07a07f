# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of materials that Cycles bakes as the network would be read: without gloss, seen by diffuse light."""

from __future__ import annotations

import bpy

from .images import NEUTRAL

# What a ray of diffuse light is; everything else is 0.
_SEEN = {'Is Diffuse Ray', 'Is Reflection Ray', 'Ray Depth', 'Diffuse Depth'}


def readable_copy(material: bpy.types.Material, made: list[bpy.types.ID]) -> bpy.types.Material:
    """Copy a material with all groups in it.

    Parameters
    ----------
    material : bpy.types.Material
        It has nodes.
    made : list
        The copies are added to it.

    Returns
    -------
    bpy.types.Material
    """
    copy = material.copy()
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
        elif node.bl_idname == 'ShaderNodeBsdfPrincipled':
            # What the gloss above the base takes away comes back as gloss.
            gloss = node.inputs["Specular IOR Level"]
            _cut(tree, gloss)
            gloss.default_value = 0.0
        elif node.bl_idname == 'ShaderNodeLightPath':
            for output in node.outputs:
                _replace(tree, output, 1.0 if output.identifier in _SEEN else 0.0)
        elif node.bl_idname == 'ShaderNodeTexImage' and (node.image is None or 0 in node.image.size[:]):
            # Cycles would show pink.
            _replace(tree, node.outputs["Color"], NEUTRAL)
            _replace(tree, node.outputs["Alpha"], 1.0)


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
