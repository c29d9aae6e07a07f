# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures: images, and the few patterns that are told in a line. Cycles reads the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...wording import counted
from ..images import NEUTRAL
from ..network import Unreadable, Varies
from .inputs import generated

if TYPE_CHECKING:
    import bpy

    from ..network import Array, Node, Place, Socket

# Of what 8 bits hold, nearly.
_FILE_GAMMA = 2.2
_KNOWN_SPACES = ("sRGB", "sRGB OETF")


def _image(place: Place, node: Node, output: Socket) -> Array:
    network, image = place.network, node.image
    if image is None:
        network.note(f"'{node.name}' has no image; {NEUTRAL} is used in its place")
        return _missing(output)
    if node.projection != 'FLAT' or image.source not in {'FILE', 'GENERATED'} or moved(node):
        raise Unreadable(node.name)
    if network.points is None:
        raise Varies
    picture = network.images.get(image)
    if picture is None:
        network.note(f"image '{image.name_full}' is missing; {NEUTRAL} is used in its place")
        return _missing(output)
    if picture.encoded and image.colorspace_settings.name not in _KNOWN_SPACES:
        network.note(f"image '{image.name_full}' is read as sRGB, not as {image.colorspace_settings.name}")
    if picture.broken:
        pixels = counted(picture.broken, "pixel")
        network.note(f"{pixels} of image '{image.name_full}' with infinite values or none at all count as 0 there")
    key = (*place.path, node.name, "pixels")
    if key not in network.known:
        # Without coordinates it takes those of the active UV map.
        uv = place.value(node, "Vector") if place.linked(node, "Vector") else network.at.uv("")
        uv, closest = np.atleast_2d(uv)[:, :2], node.interpolation == 'Closest'
        if not np.isfinite(uv).all():
            network.note(f"coordinates that are no finite numbers count as 0 for image '{image.name_full}'")
            uv = np.nan_to_num(uv, posinf=0.0, neginf=0.0)
        network.known[key] = picture.at(uv, node.extension, closest)
    values = network.known[key]
    alpha = values[:, 3:]
    if output.identifier == 'Alpha':
        return alpha
    if picture.packed or (alpha == 1.0).all():
        return values[:, :3]
    color = np.where(alpha > 0.0, values[:, :3] / np.where(alpha > 0.0, alpha, 1.0), 0.0)
    # Cycles keeps color and alpha apart only where alpha is used; else it multiplies them as they are in the file.
    if any(socket.links for socket in node.outputs[1:]):
        return color
    return color * alpha**_FILE_GAMMA if picture.encoded else values[:, :3]


def _missing(output: Socket) -> Array:
    return np.ones(1) if output.identifier == 'Alpha' else np.full(3, NEUTRAL)


def moved(node: Node) -> bool:
    """Tell whether a texture has a mapping of its own, as those of old files may."""
    mapping: bpy.types.TexMapping = node.texture_mapping
    return (
        tuple(mapping.translation) != (0.0, 0.0, 0.0)
        or tuple(mapping.rotation) != (0.0, 0.0, 0.0)
        or tuple(mapping.scale) != (1.0, 1.0, 1.0)
        or (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z) != ('X', 'Y', 'Z')
        or mapping.use_min
        or mapping.use_max
    )


def _vector(place: Place, node: Node) -> Array:
    """Return where a pattern is looked at: without coordinates, in the box around the mesh."""
    if moved(node):
        raise Unreadable(node.name)
    return place.value(node, "Vector") if place.linked(node, "Vector") else generated(place)


def _checker(place: Place, node: Node, output: Socket) -> Array:
    at = _vector(place, node) * place.value(node, "Scale")
    cell = np.abs(np.floor((at + 1e-6) * 0.999999)).astype(np.int64)
    odd = (cell.sum(axis=-1, keepdims=True) % 2 == 1).astype(float)
    if output.identifier == 'Fac':
        return odd
    return odd * place.value(node, "Color1") + (1.0 - odd) * place.value(node, "Color2")


def _gradient(place: Place, node: Node, output: Socket) -> Array:
    x, y, z = np.split(_vector(place, node), 3, axis=-1)
    ball = np.maximum(0.999999 - np.sqrt(x * x + y * y + z * z), 0.0)
    kinds = {
        'LINEAR': lambda: x,
        'QUADRATIC': lambda: np.maximum(x, 0.0) ** 2,
        'EASING': lambda: x.clip(0.0, 1.0) ** 2 * (3.0 - 2.0 * x.clip(0.0, 1.0)),
        'DIAGONAL': lambda: 0.5 * (x + y),
        'RADIAL': lambda: np.arctan2(y, x) / (2.0 * np.pi) + 0.5,
        'QUADRATIC_SPHERE': lambda: ball**2,
        'SPHERICAL': lambda: ball,
    }
    value = kinds[node.gradient_type]().clip(0.0, 1.0)
    return value if output.identifier == 'Fac' else np.repeat(value, 3, axis=-1)


READERS = {
    'ShaderNodeTexImage': _image,
    'ShaderNodeTexChecker': _checker,
    'ShaderNodeTexGradient': _gradient,
}
