# SPDX-License-Identifier: GPL-3.0-or-later
"""What a Blender material reflects diffusely and what it emits, read from its node tree.

A shader is a pair of rows: what it reflects and the radiance it emits, each a linear color. Sums and mixes of shaders
are sums and mixes of such pairs. What cannot be read (textures, groups, glossy shaders) is replaced and told.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    Array = NDArray[np.float64]
    Socket = bpy.types.NodeSocket
    Node = bpy.types.Node

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # Rec. 709, as Blender turns a color into a number
DEFAULT_REFLECTANCE = 0.8  # of faces without a material, as Blender draws them


@dataclass(frozen=True, eq=False)
class Surface:
    """How a material takes part in radiosity.

    Attributes
    ----------
    reflectance : ndarray of shape (3,)
        Diffuse reflectance, not below 0; `core.scene.Scene` caps what is too bright.
    emission : ndarray of shape (3,)
        Radiant exitance [W/m^2], not below 0: pi times Blender's color times strength.
    warnings : tuple of str
        What was read otherwise than Blender would render it.
    """

    reflectance: Array
    emission: Array
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Tree:
    """A node tree while it is read: what there is to tell, and the shaders that were read already."""

    notes: dict[str, None] = field(default_factory=dict)  # a set that keeps its order
    known: dict[tuple[str, str], Array] = field(default_factory=dict)


def read_material(material: bpy.types.Material | None) -> Surface:
    """Read the diffuse reflectance and the emission of a material.

    Parameters
    ----------
    material : bpy.types.Material or None
        None stands for an empty slot.

    Returns
    -------
    Surface
        Its values, and warnings that name the material.
    """
    if material is None:
        return Surface(np.full(3, DEFAULT_REFLECTANCE), np.zeros(3))
    if not _uses_nodes(material):
        return Surface(np.array(material.diffuse_color[:3], dtype=float).clip(0.0), np.zeros(3))
    tree = _Tree()
    reflectance, radiance = _output_shader(material.node_tree, tree)
    if (reflectance < 0.0).any() or (radiance < 0.0).any():
        tree.notes["a negative color or strength counts as 0"] = None
    # A surface of radiance L has the exitance pi L.
    return Surface(
        reflectance.clip(0.0),
        np.pi * radiance.clip(0.0),
        tuple(f"Material '{material.name}': {note}" for note in tree.notes),
    )


def _uses_nodes(material: bpy.types.Material) -> bool:
    # From 5.0 on every material does, and asking for `use_nodes` warns that it will go.
    return material.node_tree is not None and (bpy.app.version >= (5, 0, 0) or material.use_nodes)


def _output_shader(node_tree: bpy.types.ShaderNodeTree, tree: _Tree) -> Array:
    """Read the surface of the active output, of the one for Cycles where renderers have their own."""
    output = node_tree.get_output_node('CYCLES') or node_tree.get_output_node('ALL')
    if output is None:
        output = node_tree.get_output_node('EEVEE')
    if output is None:
        tree.notes["it has no Material Output node and is black"] = None
        return np.zeros((2, 3))
    return _shader(output.inputs["Surface"], tree)


def _source(socket: Socket) -> Socket | None:
    """Return the output socket that feeds an input, past reroutes and muted nodes; None where nothing does."""
    seen = set()
    while True:
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None or link.from_socket in seen:
            return None
        output = link.from_socket
        seen.add(output)
        if output.node.bl_idname == 'NodeReroute':
            socket = output.node.inputs[0]
        elif output.node.mute:
            through = next((inner for inner in output.node.internal_links if inner.to_socket == output), None)
            if through is None:
                return None
            socket = through.from_socket
        else:
            return output


def _shader(socket: Socket, tree: _Tree) -> Array:
    """Read the shader that feeds a socket as [reflectance, radiance], of shape (2, 3)."""
    output = _source(socket)
    if output is None:
        return np.zeros((2, 3))
    key = (output.node.name, output.identifier)
    if key not in tree.known:
        read = _SHADERS.get(output.node.bl_idname, _unknown)
        tree.known[key] = read(output.node, tree)
    return tree.known[key]


def _value(node: Node, name: str, tree: _Tree, instead: float = 0.0) -> Array:
    """Return the constant value of a socket: shape (3,) for a color, () for a number.

    Sockets go by name: their order and number change between versions of Blender. `instead` stands for one that this
    version does not have.
    """
    socket = node.inputs.get(name)
    if socket is None:
        return np.array(instead)
    output = _source(socket)
    if output is not None:
        if output.node.bl_idname in {'ShaderNodeRGB', 'ShaderNodeValue'}:
            socket = output
        else:
            tree.notes[f"'{output.node.name}' is not read; {name} of '{node.name}' keeps its own value"] = None
    value = np.array(socket.default_value, dtype=float)
    if node.inputs[name].type == 'RGBA':
        return value[:3] if value.ndim else np.full(3, value)
    return value[:3] @ LUMINANCE if value.ndim else value


def _emission(node: Node, tree: _Tree) -> Array:
    return np.stack([np.zeros(3), _value(node, "Color", tree) * _value(node, "Strength", tree)])


def _diffuse(node: Node, tree: _Tree) -> Array:
    return np.stack([_value(node, "Color", tree), np.zeros(3)])


def _principled(node: Node, tree: _Tree) -> Array:
    """Read the base under the layers: what is neither metal, nor glass, nor transparent scatters diffusely."""
    alpha = _value(node, "Alpha", tree, 1.0)
    scattered = alpha * (1.0 - _value(node, "Metallic", tree)) * (1.0 - _value(node, "Transmission Weight", tree))
    if scattered < 1.0:
        tree.notes["only what it reflects diffusely is used; its metallic, transmission or alpha part is black"] = None
    strength = alpha * _value(node, "Emission Strength", tree)
    # A color that is switched off is not worth a warning.
    emitted = strength * _value(node, "Emission Color", tree) if strength != 0.0 else np.zeros(3)
    return np.stack([scattered * _value(node, "Base Color", tree), emitted])


def _add(node: Node, tree: _Tree) -> Array:
    return _shader(node.inputs[0], tree) + _shader(node.inputs[1], tree)


def _mix(node: Node, tree: _Tree) -> Array:
    # The factor is called "Fac" up to 4.5 and "Factor" from 5.0 on.
    factor = _value(node, node.inputs[0].name, tree).clip(0.0, 1.0)
    return (1.0 - factor) * _shader(node.inputs[1], tree) + factor * _shader(node.inputs[2], tree)


def _black(node: Node, tree: _Tree) -> Array:
    tree.notes[f"'{node.name}' reflects nothing diffusely and is black"] = None
    return np.zeros((2, 3))


def _unknown(node: Node, tree: _Tree) -> Array:
    tree.notes[f"'{node.name}' is not read; reflectance {DEFAULT_REFLECTANCE} is used"] = None
    return np.stack([np.full(3, DEFAULT_REFLECTANCE), np.zeros(3)])


_SHADERS: dict[str, Callable[[Node, _Tree], Array]] = {
    'ShaderNodeEmission': _emission,
    'ShaderNodeBsdfDiffuse': _diffuse,
    'ShaderNodeSubsurfaceScattering': _diffuse,
    'ShaderNodeBsdfPrincipled': _principled,
    'ShaderNodeAddShader': _add,
    'ShaderNodeMixShader': _mix,
    'ShaderNodeBsdfGlossy': _black,
    'ShaderNodeBsdfAnisotropic': _black,
    'ShaderNodeBsdfMetallic': _black,
    'ShaderNodeBsdfGlass': _black,
    'ShaderNodeBsdfRefraction': _black,
    'ShaderNodeBsdfTransparent': _black,
    'ShaderNodeHoldout': _black,
}
