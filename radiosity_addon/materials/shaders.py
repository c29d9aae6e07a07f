# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaders as what they reflect diffusely, the radiance they emit, and what they let through.

Sums and mixes of shaders are sums and mixes of these. What a shader reflects otherwise is lost, and told.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .network import Place, Unreadable, Varies, convert
from .nodes.inputs import from_above

if TYPE_CHECKING:
    from .network import Array, Node, Socket

DEFAULT_REFLECTANCE = 0.8  # of faces without a material, as Blender draws them
_NONE = np.zeros(3)


class Shading(NamedTuple):
    """What a shader does with light; arrays of shape (3,), or (n, 3) at n points.

    Attributes
    ----------
    reflectance : ndarray
        Diffuse.
    radiance : ndarray
        That it emits.
    passed : ndarray
        Share of light that goes straight on behind it.
    transmittance : ndarray
        Share that leaves diffusely on its other side.
    specular : ndarray
        Share that its clear part, which is a share itself, reflects of light that comes straight down.
    """

    reflectance: Array = _NONE
    radiance: Array = _NONE
    passed: Array = _NONE
    transmittance: Array = _NONE
    specular: Array = _NONE

    def scaled(self, factor: Array) -> Shading:
        """Return a share of this."""
        return Shading(*(factor * part for part in self))

    def plus(self, other: Shading) -> Shading:
        """Return both together."""
        return Shading(*(one + two for one, two in zip(self, other, strict=True)))


_BLACK = Shading()
_STRAIGHT = "light that it lets through goes straight on; only that of lamps and the world takes on its color"


def read_shader(place: Place, socket: Socket) -> Shading:
    """Read the shader that feeds a socket.

    Parameters
    ----------
    place : Place
    socket : NodeSocket
        An input.

    Returns
    -------
    Shading

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


def _bare_color(place: Place, output: Socket) -> Shading:
    """Read a color that goes straight into a surface: Blender makes light of it."""
    try:
        return Shading(radiance=convert(place.output(output), output.type, 'RGBA'))
    except (Unreadable, Varies):
        if place.network.strict:
            raise
        return _unknown(place, output.node)


def _emission(place: Place, node: Node) -> Shading:
    strength = place.value(node, "Strength")
    return Shading(radiance=_scaled(strength, lambda: place.value(node, "Color")))


def _diffuse(place: Place, node: Node) -> Shading:
    return Shading(reflectance=place.value(node, "Color"))


def _principled(place: Place, node: Node) -> Shading:
    """Read the base under the layers: what is neither metal, nor glass, nor transparent scatters diffusely."""
    alpha = place.value(node, "Alpha", 1.0).clip(0.0, 1.0)
    metallic = place.value(node, "Metallic").clip(0.0, 1.0)
    transmission = place.value(node, "Transmission Weight").clip(0.0, 1.0)
    scattered = alpha * (1.0 - metallic) * (1.0 - transmission)
    clear = alpha * (1.0 - metallic) * transmission
    if (alpha * metallic > 0.0).any():
        place.network.note("only what it reflects diffusely is used; its metallic part is black")
    if (alpha < 1.0).any() or clear.any():
        place.network.note(_STRAIGHT)
    coat = place.value(node, "Coat Weight").clip(0.0, 1.0)
    # Seen from above, as much light passes the coat as its tint says, but for what its surface reflects.
    tint = 1.0 + coat * (place.value(node, "Coat Tint", 1.0) - 1.0) if coat.any() else 1.0
    below = 1.0 - coat * from_above(place.value(node, "Coat IOR", 1.5))
    through = _through_thin_wall(place, node)
    reflected = _scaled(scattered * (1.0 - through), lambda: tint * place.value(node, "Base Color"))
    translucent = _scaled(scattered * through, lambda: tint * place.value(node, "Base Color"))
    strength = alpha * place.value(node, "Emission Strength")
    emitted = _scaled(strength, lambda: below * tint * place.value(node, "Emission Color"))
    glass = _scaled(clear, lambda: _glass_color(place, node))
    # A thin wall has no inside: its two surfaces are one.
    solid = glass * (1.0 - place.value(node, "Thin Wall").clip(0.0, 1.0))
    specular = _scaled(solid, lambda: from_above(place.value(node, "IOR", 1.5)))
    return Shading(reflected, emitted, 1.0 - alpha + glass, translucent, specular)


def _glass_color(place: Place, node: Node) -> Array:
    """Return what the glass of a Principled node multiplies light with: on its way in and out, or once if thin."""
    color = place.value(node, "Base Color").clip(0.0)
    thin = place.value(node, "Thin Wall").clip(0.0, 1.0)
    return thin * color + (1.0 - thin) * np.sqrt(color)


def _through_thin_wall(place: Place, node: Node) -> Array:
    """Return the share of what scatters that leaves on the other side: of a thin wall's subsurface, half or so."""
    thin = place.value(node, "Thin Wall").clip(0.0, 1.0)
    if not thin.any():
        return np.zeros(1)
    forwards = place.value(node, "Subsurface Anisotropy").clip(-1.0, 1.0)
    return thin * place.value(node, "Subsurface Weight").clip(0.0, 1.0) * 0.5 * (1.0 + forwards)


def _specular(place: Place, node: Node) -> Shading:
    clear = place.value(node, "Transparency").clip(0.0, 1.0)
    if clear.any():
        place.network.note(_STRAIGHT)
    return Shading(
        (1.0 - clear) * place.value(node, "Base Color"), (1.0 - clear) * place.value(node, "Emissive Color"), clear
    )


def _add(place: Place, node: Node) -> Shading:
    one, other = (read_shader(place, socket) for socket in node.inputs[:2])
    return one.plus(other)


def _mix(place: Place, node: Node) -> Shading:
    factor = place.value(node, node.inputs[0].identifier).clip(0.0, 1.0)
    # A shader that is not there at all need not be readable.
    one = _BLACK if (factor == 1.0).all() else read_shader(place, node.inputs[1])
    other = _BLACK if (factor == 0.0).all() else read_shader(place, node.inputs[2])
    return one.scaled(1.0 - factor).plus(other.scaled(factor))


def _translucent(place: Place, node: Node) -> Shading:
    return Shading(transmittance=place.value(node, "Color"))


def _clear(place: Place, node: Node) -> Shading:
    """Read what light passes, bent or not: it goes straight on."""
    place.network.note(_STRAIGHT)
    return Shading(passed=place.value(node, "Color").clip(0.0, 1.0))


def _glass(place: Place, node: Node) -> Shading:
    clear = _clear(place, node)
    return clear._replace(specular=clear.passed * from_above(place.value(node, "IOR")))


def _black(place: Place, node: Node) -> Shading:
    place.network.note(f"'{node.name}' reflects nothing diffusely and is black")
    return _BLACK


def _unknown(place: Place, node: Node) -> Shading:
    if place.network.strict:
        raise Unreadable(node.name)
    place.network.note(f"'{node.name}' is not read; reflectance {DEFAULT_REFLECTANCE} is used")
    return Shading(reflectance=np.full(3, DEFAULT_REFLECTANCE))


def _scaled(factor: Array, color: Callable[[], Array]) -> Array:
    """Return a color times a factor; one that is switched off is not worth a warning, and not asked for."""
    return factor * color() if factor.any() else np.zeros(3)


_SHADERS: dict[str, Callable[[Place, Node], Shading]] = {
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
    'ShaderNodeBsdfGlass': _glass,
    'ShaderNodeBsdfRefraction': _clear,
    'ShaderNodeBsdfTransparent': _clear,
    'ShaderNodeHoldout': _black,
}
