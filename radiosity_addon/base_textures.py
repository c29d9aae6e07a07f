# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that give materials their color: what baked lighting is to be multiplied with."""

from __future__ import annotations

import bpy

from .materials.reading import output_node, read_material, uses_nodes

# The input that says which color a surface has.
_COLOR = {'BSDF_PRINCIPLED': "Base Color", 'BSDF_DIFFUSE': "Color"}


def base_texture(material: bpy.types.Material | None) -> bpy.types.NodeSocket | None:
    """Find the image that a material has its color from.

    Parameters
    ----------
    material : bpy.types.Material or None

    Returns
    -------
    bpy.types.NodeSocket or None
        The output of the image's node; None where the color is no image, or the material emits light of its own.
    """
    if material is None or not uses_nodes(material) or read_material(material).emission.any():
        return None
    output = output_node(material.node_tree)
    shader = _feeding(output.inputs["Surface"]) if output is not None else None
    if shader is None or shader.node.type not in _COLOR:
        return None
    socket = _feeding(shader.node.inputs[_COLOR[shader.node.type]])
    if socket is None or socket.node.type != 'TEX_IMAGE' or socket.name != "Color":
        return None
    image = socket.node.image
    # A missing image is pink in Blender and nothing elsewhere; data is no color.
    known = image is not None and image.size[0] > 0 and not image.colorspace_settings.is_data
    return socket if known else None


def _feeding(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the output that is linked to an input, behind any reroutes."""
    while socket.is_linked:
        socket = socket.links[0].from_socket
        if socket.node.type != 'REROUTE':
            return socket
        socket = socket.node.inputs[0]
    return None
