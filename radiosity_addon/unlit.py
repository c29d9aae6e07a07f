# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that show a color attribute, whatever light falls on them."""

from collections.abc import Iterable

import bpy

_NAME = "radiosity-material"


def unlit_materials(
    sources: Iterable[bpy.types.Material | None], attribute: str, see_through: bool, made: list[bpy.types.ID]
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

    Returns
    -------
    dict
        The materials by the name of the user's, or by None.
    """
    copies: dict[str | None, bpy.types.Material] = {}
    for source in sources:
        name = source.name_full if source else None
        if name not in copies:
            copies[name] = bpy.data.materials.new(_NAME)
            made.append(copies[name])
            copies[name].use_backface_culling = bool(source and source.use_backface_culling)
            _show_attribute(copies[name], attribute, see_through)
    return copies


def _show_attribute(material: bpy.types.Material, attribute: str, see_through: bool) -> None:
    """Let a material show a color attribute, whatever light falls on it.

    A color that goes straight into the surface is what the glTF exporter takes for KHR_materials_unlit, and what Cycles
    takes for emission of that radiance; an Emission node in between would make the exporter write white.
    """
    if material.node_tree is None:
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new('ShaderNodeOutputMaterial')
    shown = nodes.new('ShaderNodeVertexColor')
    shown.layer_name = attribute
    surface = shown.outputs["Color"]
    if see_through:
        # Cycles knows culling only as nodes; the exporter would not understand them.
        mix = nodes.new('ShaderNodeMixShader')
        links.new(nodes.new('ShaderNodeNewGeometry').outputs["Backfacing"], mix.inputs[0])
        links.new(surface, mix.inputs[1])
        links.new(nodes.new('ShaderNodeBsdfTransparent').outputs["BSDF"], mix.inputs[2])
        surface = mix.outputs["Shader"]
    links.new(surface, output.inputs["Surface"])
