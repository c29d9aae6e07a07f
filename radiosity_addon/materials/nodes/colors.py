# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that mix and change colors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..network import LUMINANCE, Unreadable
from .blackbody import blackbody
from .blending import blend, from_hsl, from_hsv, to_hsl, to_hsv
from .numbers import curve_values

if TYPE_CHECKING:
    from ..network import Array, Node, Place, Socket


def _mix_rgb(place: Place, node: Node, _output: Socket) -> Array:
    factor = place.value(node, "Fac").clip(0.0, 1.0)
    result = blend(node.blend_type, factor, *_sides(place, node, factor, node.blend_type, "Color1", "Color2"))
    return result.clip(0.0, 1.0) if node.use_clamp else result


def _mix(place: Place, node: Node, output: Socket) -> Array:
    kind = output.identifier.removeprefix("Result_")
    per_axis = kind == 'Vector' and node.factor_mode == 'NON_UNIFORM'
    factor = place.value(node, "Factor_Vector" if per_axis else "Factor_Float")
    if node.clamp_factor:
        factor = factor.clip(0.0, 1.0)
    if kind == 'Rotation':
        raise Unreadable(node.name)
    mode = node.blend_type if kind == 'Color' else 'MIX'
    result = blend(mode, factor, *_sides(place, node, factor, mode, f"A_{kind}", f"B_{kind}"))
    return result.clip(0.0, 1.0) if kind == 'Color' and node.clamp_result else result


def _sides(place: Place, node: Node, factor: Array, mode: str, first: str, second: str) -> tuple[Array, Array]:
    """Return both colors of a mix; one that does not show need not be readable."""
    if mode == 'MIX' and (factor == 1.0).all():
        other = place.value(node, second)
        return other, other
    one = place.value(node, first)
    return one, one if (factor == 0.0).all() else place.value(node, second)


def _ramp(place: Place, node: Node, output: Socket) -> Array:
    ramp = node.color_ramp
    # Like Cycles' own table.
    table = np.array([ramp.evaluate(index / 255.0) for index in range(256)])
    at = place.value(node, "Fac")[..., 0].clip(0.0, 1.0) * 255.0
    if ramp.interpolation == 'CONSTANT':
        values = table[at.astype(np.int64)]
    else:
        low = np.minimum(at.astype(np.int64), 254)
        share = (at - low)[..., None]
        values = (1.0 - share) * table[low] + share * table[low + 1]
    return values[..., 3:] if output.identifier == 'Alpha' else values[..., :3]


def _curves(place: Place, node: Node, _output: Socket) -> Array:
    factor, color = place.value(node, "Fac"), place.value(node, "Color")
    # All channels by the last curve, then each by its own.
    common = curve_values(node.mapping, 3, color)
    curved = np.stack([curve_values(node.mapping, index, common[..., index]) for index in range(3)], axis=-1)
    return color + factor * (curved - color)


def _hue_saturation(place: Place, node: Node, _output: Socket) -> Array:
    hue, saturation, value, factor = (place.value(node, name) for name in ("Hue", "Saturation", "Value", "Fac"))
    color = place.value(node, "Color")
    h, s, v = np.split(to_hsv(color), 3, axis=-1)
    turned = (h + hue + 0.5) % 1.0
    parts = np.broadcast_arrays(turned, (s * saturation).clip(0.0, 1.0), v * value)
    changed = np.maximum(from_hsv(np.concatenate(parts, axis=-1)), 0.0)
    return color + factor * (changed - color)


def _bright_contrast(place: Place, node: Node, _output: Socket) -> Array:
    color, bright, contrast = (place.value(node, name) for name in ("Color", "Bright", "Contrast"))
    return np.maximum((1.0 + contrast) * color + bright - 0.5 * contrast, 0.0)


def _gamma(place: Place, node: Node, _output: Socket) -> Array:
    color, gamma = place.value(node, "Color"), place.value(node, "Gamma")
    return np.where(color > 0.0, np.power(np.where(color > 0.0, color, 1.0), gamma), color)


def _invert(place: Place, node: Node, _output: Socket) -> Array:
    color, factor = place.value(node, "Color"), place.value(node, "Fac")
    return color + factor * (1.0 - 2.0 * color)


def _grey(place: Place, node: Node, _output: Socket) -> Array:
    return (place.value(node, "Color") @ LUMINANCE)[..., None]


def _separate(place: Place, node: Node, output: Socket) -> Array:
    color = place.value(node, node.inputs[0].identifier)
    color = _TO.get(_space(node), lambda same: same)(color)
    index = list(node.outputs).index(output)
    return color[..., index : index + 1]


def _combine(place: Place, node: Node, _output: Socket) -> Array:
    parts = np.broadcast_arrays(*(place.value(node, socket.identifier) for socket in node.inputs[:3]))
    return _FROM.get(_space(node), lambda same: same)(np.concatenate(parts, axis=-1))


def _space(node: Node) -> str:
    """Return what a node takes a color apart into: by its mode, or by its name in old versions."""
    return getattr(node, "mode", 'HSV' if node.bl_idname.endswith("HSV") else 'RGB')


def _blackbody(place: Place, node: Node, _output: Socket) -> Array:
    return blackbody(place.value(node, "Temperature"))


_TO = {'HSV': to_hsv, 'HSL': to_hsl}
_FROM = {'HSV': from_hsv, 'HSL': from_hsl}

READERS = {
    'ShaderNodeMixRGB': _mix_rgb,
    'ShaderNodeMix': _mix,
    'ShaderNodeValToRGB': _ramp,
    'ShaderNodeRGBCurve': _curves,
    'ShaderNodeHueSaturation': _hue_saturation,
    'ShaderNodeBrightContrast': _bright_contrast,
    'ShaderNodeGamma': _gamma,
    'ShaderNodeInvert': _invert,
    'ShaderNodeRGBToBW': _grey,
    'ShaderNodeSeparateColor': _separate,
    'ShaderNodeSeparateRGB': _separate,
    'ShaderNodeSeparateHSV': _separate,
    'ShaderNodeCombineColor': _combine,
    'ShaderNodeCombineRGB': _combine,
    'ShaderNodeCombineHSV': _combine,
    'ShaderNodeBlackbody': _blackbody,
}
