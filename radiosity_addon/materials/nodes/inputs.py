# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that bring in values: constants, coordinates, attributes, and what light looks at."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..network import LUMINANCE, Unreadable, own_value

if TYPE_CHECKING:
    from ..network import Array, Node, Place, Socket


def _constant(_place: Place, _node: Node, output: Socket) -> Array:
    return own_value(output, output.type)


def _uv_map(place: Place, node: Node, _output: Socket) -> Array:
    return _uv(place, node.uv_map)


def _uv(place: Place, name: str) -> Array:
    ground = place.network.at.ground
    if (name or ground.active_uv) not in ground.uv_maps:
        place.network.note(f"UV map '{name}' is missing" if name else "there is no UV map")
    return place.network.at.uv(name)


def _coordinates(place: Place, node: Node, output: Socket) -> Array:
    points = place.network.at
    kind = output.identifier
    if kind == 'UV' and not node.from_instancer:
        return _uv(place, "")
    if kind == 'Generated':
        return generated(place)
    if kind == 'Object' and node.object is None and not node.from_instancer:
        return points.position
    if kind == 'Normal':
        return points.normal
    raise Unreadable(node.name)


def generated(place: Place) -> Array:
    """Return coordinates from 0 to 1 over the box around the mesh, shape (n, 3)."""
    middle, half = place.network.at.ground.space
    return 0.5 + 0.5 * (place.network.at.position - middle) / np.where(half == 0.0, 1.0, half)


def _vertex_color(place: Place, node: Node, output: Socket) -> Array:
    return _attribute_named(place, node.layer_name or place.network.at.ground.active_color, output)


def _attribute(place: Place, node: Node, output: Socket) -> Array:
    if node.attribute_type != 'GEOMETRY':
        raise Unreadable(node.name)
    return _attribute_named(place, node.attribute_name, output)


def _attribute_named(place: Place, name: str, output: Socket) -> Array:
    points = place.network.at
    if name in points.ground.uv_maps:
        values = np.column_stack([points.uv(name), np.ones(len(points.samples.triangle))])
    else:
        found = points.attribute(name)
        if found is None:
            place.network.note(f"attribute '{name}' is missing and counts as 0")
            return np.zeros(1 if output.identifier in {'Fac', 'Alpha'} else 3)
        values = found
    if output.identifier == 'Alpha':
        return values[:, 3:]
    if output.identifier == 'Fac':
        return values[:, :3] @ LUMINANCE[:, None] if _is_color(points, name) else values[:, :3].mean(1, keepdims=True)
    return values[:, :3]


def _is_color(points: object, name: str) -> bool:
    layer = points.ground.attributes.get(name)
    return layer is not None and layer.values.shape[1] == 4


def _geometry(place: Place, node: Node, output: Socket) -> Array:
    points = place.network.at
    matrix = points.ground.matrix
    if output.identifier == 'Position':
        return points.position @ matrix[:3, :3].T + matrix[:3, 3]
    if output.identifier == 'True Normal':
        normal = points.normal @ np.linalg.pinv(matrix[:3, :3])
        return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    if output.identifier == 'Backfacing':
        return np.zeros(1)
    raise Unreadable(node.name)


def _object(place: Place, node: Node, output: Socket) -> Array:
    ground = place.network.at.ground
    if output.identifier == 'Location':
        return ground.matrix[:3, 3].copy()
    if output.identifier == 'Color':
        return ground.color
    raise Unreadable(node.name)


def _light_path(_place: Place, node: Node, output: Socket) -> Array:
    """Read it as light that comes from a diffuse surface sees it: that is what lights the scene."""
    seen = {'Is Diffuse Ray', 'Is Reflection Ray', 'Ray Depth', 'Diffuse Depth'}
    if output.identifier == 'Ray Length':
        raise Unreadable(node.name)
    return np.ones(1) if output.identifier in seen else np.zeros(1)


def _light_falloff(place: Place, node: Node, output: Socket) -> Array:
    """Read it where it lets light weaken as light does; smoothing, which only tames what is very near, is left out."""
    if output.identifier != 'Quadratic':
        raise Unreadable(node.name)
    return place.value(node, "Strength")


def _fresnel(place: Place, node: Node, _output: Socket) -> Array:
    return from_above(place.value(node, "IOR"))


def _layer_weight(place: Place, node: Node, output: Socket) -> Array:
    if output.identifier == 'Facing':
        return np.zeros(1)
    return from_above(1.0 / np.maximum(1.0 - place.value(node, "Blend"), 1e-5))


def from_above(ior: Array) -> Array:
    """Return what a clear surface reflects of light that comes straight down."""
    eta = np.maximum(ior, 1e-5)
    return ((eta - 1.0) / (eta + 1.0)) ** 2


READERS = {
    'ShaderNodeRGB': _constant,
    'ShaderNodeValue': _constant,
    'ShaderNodeUVMap': _uv_map,
    'ShaderNodeTexCoord': _coordinates,
    'ShaderNodeVertexColor': _vertex_color,
    'ShaderNodeAttribute': _attribute,
    'ShaderNodeNewGeometry': _geometry,
    'ShaderNodeObjectInfo': _object,
    'ShaderNodeLightPath': _light_path,
    'ShaderNodeLightFalloff': _light_falloff,
    'ShaderNodeFresnel': _fresnel,
    'ShaderNodeLayerWeight': _layer_weight,
}
