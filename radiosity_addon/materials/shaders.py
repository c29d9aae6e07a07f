# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaders as pairs of what they reflect diffusely and the radiance they emit.

Sums and mixes of shaders are sums and mixes of such pairs. What a shader reflects or lets through otherwise is lost,
and told.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from .network import Place, Unreadable, Varies, convert

if TYPE_CHECKING:
    from .network import Array, Node, Socket

    Pair = tuple[Array, Array]

DEFAULT_REFLECTANCE = 0.8  # of faces without a material, as Blender draws them
_BLACK = (np.zeros(3), np.zeros(3))


def read_shader(place: Place, socket: Socket) -> Pair:
    """Read the shader that feeds a socket.

    Parameters
    ----------
    place : Place
    socket : NodeSocket
        An input.

    Returns
    -------
    reflectance, radiance : ndarray of shape (3,) or (n, 3)

    Raises
    ------
    Unreadable
        When the network is strict and only Blender can tell.
    """
    output, _, where = place.source(socket)
    if output is None:
        return _BLACK
    key = (*where.path, output.node.name, output.identifier)
    known = where.network.known
    if key not in known:
        if output.type == 'SHADER':
            known[key] = _SHADERS.get(output.node.bl_idname, _unknown)(where, output.node)
        else:
            known[key] = _bare_color(where, output)
    return known[key]


def _bare_color(place: Place, output: Socket) -> Pair:
    """Read a color that goes straight into a surface: Blender makes light of it."""
    try:
        return np.zeros(3), convert(place.output(output), output.type, 'RGBA')
    except (Unreadable, Varies):
        if place.network.strict:
            raise
        return _unknown(place, output.node)


def _emission(place: Place, node: Node) -> Pair:
    strength = place.value(node, "Strength")
    return np.zeros(3), _scaled(strength, lambda: place.value(node, "Color"))


def _diffuse(place: Place, node: Node) -> Pair:
    return place.value(node, "Color"), np.zeros(3)


def _principled(place: Place, node: Node) -> Pair:
    """Read the base under the layers: what is neither metal, nor glass, nor transparent scatters diffusely."""
    alpha = place.value(node, "Alpha", 1.0).clip(0.0, 1.0)
    metallic = place.value(node, "Metallic").clip(0.0, 1.0)
    transmission = place.value(node, "Transmission Weight").clip(0.0, 1.0)
    scattered = alpha * (1.0 - metallic) * (1.0 - transmission)
    if (scattered < 1.0).any():
        place.network.note("only what it reflects diffusely is used; its metallic, transmission or alpha part is black")
    coat = place.value(node, "Coat Weight").clip(0.0, 1.0)
    # Seen from above, as much light passes the coat as its tint says, but for what its surface reflects.
    tint = 1.0 + coat * (place.value(node, "Coat Tint", 1.0) - 1.0) if coat.any() else 1.0
    ior = place.value(node, "Coat IOR", 1.5)
    passed = 1.0 - coat * ((ior - 1.0) / np.maximum(ior + 1.0, 1e-6)) ** 2
    reflected = _scaled(scattered, lambda: tint * place.value(node, "Base Color"))
    strength = alpha * place.value(node, "Emission Strength")
    return reflected, _scaled(strength, lambda: passed * tint * place.value(node, "Emission Color"))


def _specular(place: Place, node: Node) -> Pair:
    shown = 1.0 - place.value(node, "Transparency").clip(0.0, 1.0)
    return shown * place.value(node, "Base Color"), shown * place.value(node, "Emissive Color")


def _add(place: Place, node: Node) -> Pair:
    one, other = (read_shader(place, socket) for socket in node.inputs[:2])
    return one[0] + other[0], one[1] + other[1]


def _mix(place: Place, node: Node) -> Pair:
    factor = place.value(node, node.inputs[0].identifier).clip(0.0, 1.0)
    # A shader that is not there at all need not be readable.
    one = _BLACK if (factor == 1.0).all() else read_shader(place, node.inputs[1])
    other = _BLACK if (factor == 0.0).all() else read_shader(place, node.inputs[2])
    return (1.0 - factor) * one[0] + factor * other[0], (1.0 - factor) * one[1] + factor * other[1]


def _translucent(place: Place, node: Node) -> Pair:
    place.network.note(f"'{node.name}' lets no light through; it reflects it instead")
    return _diffuse(place, node)


def _black(place: Place, node: Node) -> Pair:
    place.network.note(f"'{node.name}' reflects nothing diffusely and is black")
    return _BLACK


def _unknown(place: Place, node: Node) -> Pair:
    if place.network.strict:
        raise Unreadable(node.name)
    place.network.note(f"'{node.name}' is not read; reflectance {DEFAULT_REFLECTANCE} is used")
    return np.full(3, DEFAULT_REFLECTANCE), np.zeros(3)


def _scaled(factor: Array, color: Callable[[], Array]) -> Array:
    """Return a color times a factor; one that is switched off is not worth a warning, and not asked for."""
    return factor * color() if factor.any() else np.zeros(3)


_SHADERS: dict[str, Callable[[Place, Node], Pair]] = {
    'ShaderNodeEmission': _emission,
    'ShaderNodeBackground': _emission,
    'ShaderNodeBsdfDiffuse': _diffuse,
    'ShaderNodeSubsurfaceScattering': _diffuse,
    'ShaderNodeBsdfPrincipled': _principled,
    'ShaderNodeEeveeSpecular': _specular,
    'ShaderNodeAddShader': _add,
    'ShaderNodeMixShader': _mix,
    'ShaderNodeBsdfTranslucent': _translucent,
    'ShaderNodeBsdfGlossy': _black,
    'ShaderNodeBsdfAnisotropic': _black,
    'ShaderNodeBsdfMetallic': _black,
    'ShaderNodeBsdfGlass': _black,
    'ShaderNodeBsdfRefraction': _black,
    'ShaderNodeBsdfTransparent': _black,
    'ShaderNodeHoldout': _black,
}
