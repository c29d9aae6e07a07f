# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that show a color attribute, whatever light falls on them."""

from collections.abc import Iterable

import bpy

from .base_textures import base_texture

_NAME = "radiosity-material"


def unlit_materials(
    sources: Iterable[bpy.types.Material | None],
    attribute: str,
    see_through: bool,
    made: list[bpy.types.ID],
    *,
    textured: bool = False,
) -> dict[str | None, bpy.types.Material]:
    """Make one unlit material for each of the user's, and one for faces without any.

    Parameters
    ----------
    sources : iterable of bpy.types.Material or None
        The user's materials, as often as they are used.
    attribute : str
        Name of the color attribute to show.
    see_through : bool
        Whether renders show no face from behind, even where the user's material does.
    made : list
        What is made is added to it.
    textured : bool
        Whether the color is multiplied with the image that the user's material has its own from.

    Returns
    -------
    dict
        The materials by the name of the user's, or by None.
    """
    copies: dict[str | None, bpy.types.Material] = {}
    for source in sources:
        name = source.name_full if source else None
        if name not in copies:
            texture = base_texture(source) if textured else None
            # With all that decides where on the surface the image is.
            copy = bpy.data.materials.new(_NAME) if texture is None else source.copy()
            made.append(copy)
            copy.name, copies[name] = _NAME, copy
            copy.use_backface_culling = bool(source and source.use_backface_culling)
            image = None
            if texture is None:
                if copy.node_tree is None:
                    copy.use_nodes = True
                copy.node_tree.nodes.clear()
            else:
                image = copy.node_tree.nodes[texture.node.name].outputs["Color"]
            _show_attribute(copy, attribute, see_through, image)
    return copies


def _show_attribute(
    material: bpy.types.Material, attribute: str, see_through: bool, image: bpy.types.NodeSocket | None
) -> None:
    """Let a material show a color attribute, whatever light falls on it.

    A color that goes straight into the surface is what the glTF exporter takes for KHR_materials_unlit, and what Cycles
    takes for emission of that radiance; an Emission node in between would make the exporter write white. Of products it
    understands that of an image and an attribute.
    """
    nodes, links = material.node_tree.nodes, material.node_tree.links
    for node in [node for node in nodes if node.type == 'OUTPUT_MATERIAL']:
        nodes.remove(node)
    output = nodes.new('ShaderNodeOutputMaterial')
    shown = nodes.new('ShaderNodeVertexColor')
    shown.layer_name = attribute
    surface = shown.outputs["Color"]
    if image is not None:
        product = nodes.new('ShaderNodeMix')
        product.data_type, product.blend_type = 'RGBA', 'MULTIPLY'
        # Sockets of one name for each data type: by number, which is the same in all versions.
        product.inputs[0].default_value = 1.0
        links.new(image, product.inputs[6])
        links.new(surface, product.inputs[7])
        surface = product.outputs[2]
    if see_through:
        # Cycles knows culling only as nodes; the exporter would not understand them.
        mix = nodes.new('ShaderNodeMixShader')
        links.new(nodes.new('ShaderNodeNewGeometry').outputs["Backfacing"], mix.inputs[0])
        links.new(surface, mix.inputs[1])
        links.new(nodes.new('ShaderNodeBsdfTransparent').outputs["BSDF"], mix.inputs[2])
        surface = mix.outputs["Shader"]
    links.new(surface, output.inputs["Surface"])
