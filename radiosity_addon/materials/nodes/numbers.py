# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that reckon with numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..network import Unreadable

if TYPE_CHECKING:
    from ..network import Array, Node, Place, Socket

_TINY = 1e-300


def divided(a: Array, b: Array) -> Array:
    """Return a / b, 0 where b is."""
    return np.where(b == 0.0, 0.0, a / np.where(b == 0.0, 1.0, b))


def _power(a: Array, b: Array) -> Array:
    whole = b == np.floor(b)
    base = np.where((a < 0.0) & ~whole, 0.0, a)
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.power(base, b), posinf=0.0, neginf=0.0)


def _logarithm(a: Array, b: Array) -> Array:
    good = (a > 0.0) & (b > 0.0)
    return np.where(good, divided(np.log(np.where(good, a, 1.0)), np.log(np.where(good, b, 2.0))), 0.0)


def _modulo(a: Array, b: Array) -> Array:
    return np.where(b == 0.0, 0.0, np.fmod(a, np.where(b == 0.0, 1.0, b)))


def _floored_modulo(a: Array, b: Array) -> Array:
    return np.where(b == 0.0, 0.0, np.mod(a, np.where(b == 0.0, 1.0, b)))


def _snap(a: Array, b: Array) -> Array:
    return np.floor(divided(a, b)) * b


def _wrap(a: Array, b: Array, c: Array) -> Array:
    span = b - c
    return np.where(span == 0.0, c, a - span * np.floor(divided(a - c, span)))


def _ping_pong(a: Array, b: Array) -> Array:
    share = divided(a - b, 2.0 * b)
    return np.where(b == 0.0, 0.0, np.abs((share - np.floor(share)) * b * 2.0 - b))


def _smooth_least(a: Array, b: Array, c: Array) -> Array:
    h = np.where(c != 0.0, np.maximum(c - np.abs(a - b), 0.0) / np.where(c != 0.0, c, 1.0), 0.0)
    return np.minimum(a, b) - h**3 * c / 6.0


_ONE: dict[str, Callable[[Array], Array]] = {
    'SQRT': lambda a: np.sqrt(np.maximum(a, 0.0)),
    'INVERSE_SQRT': lambda a: np.where(a > 0.0, 1.0 / np.sqrt(np.where(a > 0.0, a, 1.0)), 0.0),
    'ABSOLUTE': np.abs,
    'EXPONENT': lambda a: np.exp(np.minimum(a, 80.0)),
    'SIGN': np.sign,
    'ROUND': lambda a: np.floor(a + 0.5),
    'FLOOR': np.floor,
    'CEIL': np.ceil,
    'TRUNC': np.trunc,
    'FRACT': lambda a: a - np.floor(a),
    'SINE': np.sin,
    'COSINE': np.cos,
    'TANGENT': np.tan,
    'ARCSINE': lambda a: np.arcsin(a.clip(-1.0, 1.0)),
    'ARCCOSINE': lambda a: np.arccos(a.clip(-1.0, 1.0)),
    'ARCTANGENT': np.arctan,
    'SINH': lambda a: np.sinh(a.clip(-80.0, 80.0)),
    'COSH': lambda a: np.cosh(a.clip(-80.0, 80.0)),
    'TANH': np.tanh,
    'RADIANS': np.radians,
    'DEGREES': np.degrees,
}
_TWO: dict[str, Callable[[Array, Array], Array]] = {
    'ADD': np.add,
    'SUBTRACT': np.subtract,
    'MULTIPLY': np.multiply,
    'DIVIDE': divided,
    'POWER': _power,
    'LOGARITHM': _logarithm,
    'MINIMUM': np.minimum,
    'MAXIMUM': np.maximum,
    'LESS_THAN': lambda a, b: (a < b).astype(float),
    'GREATER_THAN': lambda a, b: (a > b).astype(float),
    'MODULO': _modulo,
    'FLOORED_MODULO': _floored_modulo,
    'SNAP': _snap,
    'PINGPONG': _ping_pong,
    'ARCTAN2': np.arctan2,
}
_THREE: dict[str, Callable[[Array, Array, Array], Array]] = {
    'MULTIPLY_ADD': lambda a, b, c: a * b + c,
    'COMPARE': lambda a, b, c: (np.abs(a - b) <= np.maximum(c, 1e-5)).astype(float),
    'WRAP': _wrap,
    'SMOOTH_MIN': _smooth_least,
    'SMOOTH_MAX': lambda a, b, c: -_smooth_least(-a, -b, c),
}


def _math(place: Place, node: Node, _output: Socket) -> Array:
    names = ("Value", "Value_001", "Value_002")
    for count, table in enumerate((_ONE, _TWO, _THREE), 1):
        if node.operation in table:
            result = table[node.operation](*(place.value(node, name) for name in names[:count]))
            return result.clip(0.0, 1.0) if node.use_clamp else result
    raise Unreadable(node.name)


def _clamp(place: Place, node: Node, _output: Socket) -> Array:
    value, low, high = (place.value(node, name) for name in ("Value", "Min", "Max"))
    if node.clamp_type == 'RANGE':
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.minimum(np.maximum(value, low), high)


def _map_range(place: Place, node: Node, _output: Socket) -> Array:
    vectors = node.data_type == 'FLOAT_VECTOR'
    if vectors:
        names = ("Vector", *(f"{name}_FLOAT3" for name in ("From_Min", "From_Max", "To_Min", "To_Max", "Steps")))
    else:
        names = ("Value", "From Min", "From Max", "To Min", "To Max", "Steps")
    value, low, high, first, last, steps = (place.value(node, name) for name in names)
    share = divided(value - low, high - low)
    if node.interpolation_type == 'STEPPED':
        share = np.where(steps > 0.0, divided(np.floor(share * (steps + 1.0)), steps), 0.0)
    elif node.interpolation_type in {'SMOOTHSTEP', 'SMOOTHERSTEP'}:
        share = share.clip(0.0, 1.0)
        smooth = node.interpolation_type == 'SMOOTHSTEP'
        share = share**2 * (3.0 - 2.0 * share) if smooth else share**3 * (share * (share * 6.0 - 15.0) + 10.0)
    result = first + share * (last - first)
    if node.clamp and node.interpolation_type in {'LINEAR', 'STEPPED'}:
        result = np.clip(result, np.minimum(first, last), np.maximum(first, last))
    return result


def _float_curve(place: Place, node: Node, _output: Socket) -> Array:
    factor, value = place.value(node, "Factor"), place.value(node, "Value")
    return value + factor * (curve_values(node.mapping, 0, value) - value)


def curve_values(mapping: object, index: int, values: Array) -> Array:
    """Return what a curve makes of values.

    Parameters
    ----------
    mapping : bpy.types.CurveMapping
    index : int
        Which of its curves.
    values : ndarray

    Returns
    -------
    ndarray of the same shape
    """
    mapping.initialize()
    curve = mapping.curves[index]
    ends = [point.location[0] for point in curve.points]
    places = np.linspace(min(0.0, *ends), max(1.0, *ends), 513)
    table = np.array([mapping.evaluate(curve, place) for place in places])
    result = np.interp(values, places, table)
    if mapping.extend == 'EXTRAPOLATED':
        step = places[1] - places[0]
        result += np.where(values > places[-1], (values - places[-1]) * (table[-1] - table[-2]) / step, 0.0)
        result += np.where(values < places[0], (values - places[0]) * (table[1] - table[0]) / step, 0.0)
    return result


READERS = {
    'ShaderNodeMath': _math,
    'ShaderNodeClamp': _clamp,
    'ShaderNodeMapRange': _map_range,
    'ShaderNodeFloatCurve': _float_curve,
}
