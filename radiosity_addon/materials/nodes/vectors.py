# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that move and reckon with vectors."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..network import Unreadable
from .numbers import divided

if TYPE_CHECKING:
    from ..network import Array, Node, Place, Socket


def _mapping(place: Place, node: Node, _output: Socket) -> Array:
    vector, turn, scale = (place.value(node, name) for name in ("Vector", "Rotation", "Scale"))
    if turn.ndim > 1:
        raise Unreadable(node.name)
    matrix = _turned(turn)
    if node.vector_type == 'NORMAL':
        turned = divided(vector, scale) @ matrix.T
        return divided(turned, np.linalg.norm(turned, axis=-1, keepdims=True))
    if node.vector_type == 'VECTOR':
        return (vector * scale) @ matrix.T
    location = place.value(node, "Location")
    if node.vector_type == 'TEXTURE':
        return divided((vector - location) @ matrix, scale)
    return (vector * scale) @ matrix.T + location


def _turned(angles: Array) -> Array:
    """Return the matrix of Euler angles, x first."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return z @ y @ x


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=-1, keepdims=True)


def _unit(a: Array) -> Array:
    return divided(a, np.sqrt(_dot(a, a)))


_ONE: dict[str, Callable[[Array], Array]] = {
    'NORMALIZE': _unit,
    'LENGTH': lambda a: np.sqrt(_dot(a, a)),
    'ABSOLUTE': np.abs,
    'FLOOR': np.floor,
    'CEIL': np.ceil,
    'FRACTION': lambda a: a - np.floor(a),
    'SINE': np.sin,
    'COSINE': np.cos,
    'TANGENT': np.tan,
}
_TWO: dict[str, Callable[[Array, Array], Array]] = {
    'ADD': np.add,
    'SUBTRACT': np.subtract,
    'MULTIPLY': np.multiply,
    'DIVIDE': divided,
    'CROSS_PRODUCT': lambda a, b: np.cross(*np.broadcast_arrays(a, b)),
    'DOT_PRODUCT': _dot,
    'DISTANCE': lambda a, b: np.sqrt(_dot(a - b, a - b)),
    'PROJECT': lambda a, b: divided(_dot(a, b), _dot(b, b)) * b,
    'REFLECT': lambda a, b: a - 2.0 * _dot(a, _unit(b)) * _unit(b),
    'MINIMUM': np.minimum,
    'MAXIMUM': np.maximum,
    'MODULO': lambda a, b: np.where(b == 0.0, 0.0, np.fmod(a, np.where(b == 0.0, 1.0, b))),
    'SNAP': lambda a, b: np.floor(divided(a, b)) * b,
}


def _vector_math(place: Place, node: Node, _output: Socket) -> Array:
    first = place.value(node, "Vector")
    if node.operation in _ONE:
        return _ONE[node.operation](first)
    if node.operation == 'SCALE':
        return first * place.value(node, "Scale")
    second = place.value(node, "Vector_001")
    if node.operation in _TWO:
        return _TWO[node.operation](first, second)
    if node.operation == 'MULTIPLY_ADD':
        return first * second + place.value(node, "Vector_002")
    raise Unreadable(node.name)


def _separate(place: Place, node: Node, output: Socket) -> Array:
    index = ('X', 'Y', 'Z').index(output.identifier)
    return place.value(node, "Vector")[..., index : index + 1]


def _combine(place: Place, node: Node, _output: Socket) -> Array:
    return np.concatenate(np.broadcast_arrays(*(place.value(node, name) for name in ("X", "Y", "Z"))), axis=-1)


READERS = {
    'ShaderNodeMapping': _mapping,
    'ShaderNodeVectorMath': _vector_math,
    'ShaderNodeSeparateXYZ': _separate,
    'ShaderNodeCombineXYZ': _combine,
}
