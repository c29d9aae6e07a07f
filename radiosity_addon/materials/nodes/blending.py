# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to mix two colors, and colors as hue, saturation, and value or lightness."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def blend(mode: str, factor: Array, a: Array, b: Array) -> Array:
    """Mix two colors.

    Parameters
    ----------
    mode : str
        Blender's name of the blend type, such as 'MIX' or 'MULTIPLY'.
    factor : ndarray of shape (..., 1) or (..., 3)
    a, b : ndarray of shape (..., 3) or (..., 1)

    Returns
    -------
    ndarray of shape (..., 3) or (..., 1)
    """
    if mode in {'HUE', 'SATURATION', 'VALUE', 'COLOR'}:
        mixed = _blend_hsv(mode, factor, a, b)
    else:
        mixed = _BLENDS[mode](a, b, factor)
    if mode in {'ADD', 'SUBTRACT', 'LIGHTEN', 'DODGE', 'BURN', 'LINEAR_LIGHT', 'OVERLAY', 'SCREEN', 'DIVIDE'}:
        return mixed  # the factor is in it already
    return a + factor * (mixed - a)


def _overlay(a: Array, b: Array, t: Array) -> Array:
    rest = 1.0 - t
    return np.where(a < 0.5, a * (rest + 2.0 * t * b), 1.0 - (rest + 2.0 * t * (1.0 - b)) * (1.0 - a))


def _dodge(a: Array, b: Array, t: Array) -> Array:
    left = 1.0 - t * b
    return np.where(a == 0.0, a, np.where(left <= 0.0, 1.0, np.minimum(a / np.where(left <= 0.0, 1.0, left), 1.0)))


def _burn(a: Array, b: Array, t: Array) -> Array:
    left = 1.0 - t + t * b
    return np.where(left <= 0.0, 0.0, (1.0 - (1.0 - a) / np.where(left <= 0.0, 1.0, left)).clip(0.0, 1.0))


def _soft_light(a: Array, b: Array, _t: Array) -> Array:
    return (1.0 - a) * b * a + a * (1.0 - (1.0 - b) * (1.0 - a))


def _divide(a: Array, b: Array, t: Array) -> Array:
    return np.where(b == 0.0, a, (1.0 - t) * a + t * a / np.where(b == 0.0, 1.0, b))


_BLENDS: dict[str, Callable[[Array, Array, Array], Array]] = {
    'MIX': lambda a, b, t: b,
    'DARKEN': lambda a, b, t: np.minimum(a, b),
    'MULTIPLY': lambda a, b, t: a * b,
    'BURN': _burn,
    'LIGHTEN': lambda a, b, t: a + t * (np.maximum(a, b) - a),
    'SCREEN': lambda a, b, t: 1.0 - (1.0 - t + t * (1.0 - b)) * (1.0 - a),
    'DODGE': _dodge,
    'ADD': lambda a, b, t: a + t * b,
    'OVERLAY': _overlay,
    'SOFT_LIGHT': _soft_light,
    'LINEAR_LIGHT': lambda a, b, t: a + t * (2.0 * b - 1.0),
    'DIFFERENCE': lambda a, b, t: np.abs(a - b),
    'EXCLUSION': lambda a, b, t: np.maximum(a + b - 2.0 * a * b, 0.0),
    'SUBTRACT': lambda a, b, t: a - t * b,
    'DIVIDE': _divide,
}


def _blend_hsv(mode: str, factor: Array, a: Array, b: Array) -> Array:
    one, other = np.broadcast_arrays(to_hsv(a), to_hsv(b))
    mixed = one.copy()
    if mode == 'VALUE':
        mixed[..., 2] = other[..., 2]
        return from_hsv(mixed)
    if mode == 'SATURATION':
        mixed[..., 1] = np.where(one[..., 1] != 0.0, other[..., 1], one[..., 1])
        return from_hsv(mixed)
    mixed[..., 0] = other[..., 0]
    if mode == 'COLOR':
        mixed[..., 1] = other[..., 1]
    # Grey has no hue to give.
    return np.where(other[..., 1:2] != 0.0, from_hsv(mixed), a)


def to_hsv(color: Array) -> Array:
    """Return hue, saturation and value, 0 to 1, of colors of shape (..., 3)."""
    high, low = color.max(axis=-1), color.min(axis=-1)
    span = high - low
    saturation = np.where(high != 0.0, span / np.where(high != 0.0, high, 1.0), 0.0)
    return np.stack([_hue(color, high, span), saturation, high], axis=-1)


def from_hsv(color: Array) -> Array:
    """Return the colors of hue, saturation and value; the inverse of `to_hsv`."""
    hue, saturation, value = np.moveaxis(color, -1, 0)
    sixth = (hue[..., None] * 6.0 + np.array([5.0, 3.0, 1.0])) % 6.0
    fall = np.minimum(sixth, 4.0 - sixth).clip(0.0, 1.0)
    return value[..., None] * (1.0 - saturation[..., None] * fall)


def to_hsl(color: Array) -> Array:
    """Return hue, saturation and lightness, 0 to 1, of colors of shape (..., 3)."""
    high, low = color.max(axis=-1), color.min(axis=-1)
    span, light = high - low, 0.5 * (high + low)
    room = np.where(light > 0.5, 2.0 - high - low, high + low)
    saturation = np.where(span != 0.0, span / np.where(room != 0.0, room, 1.0), 0.0)
    return np.stack([_hue(color, high, span), saturation, light], axis=-1)


def from_hsl(color: Array) -> Array:
    """Return the colors of hue, saturation and lightness; the inverse of `to_hsl`."""
    hue, saturation, light = np.moveaxis(color, -1, 0)
    pure = from_hsv(np.stack([hue, np.ones_like(hue), np.ones_like(hue)], axis=-1))
    chroma = (1.0 - np.abs(2.0 * light - 1.0)) * saturation
    return (pure - 0.5) * chroma[..., None] + light[..., None]


def _hue(color: Array, high: Array, span: Array) -> Array:
    safe = np.where(span != 0.0, span, 1.0)
    red, green, blue = np.moveaxis(color, -1, 0)
    sixths = np.where(
        red == high,
        (green - blue) / safe,
        np.where(green == high, 2.0 + (blue - red) / safe, 4.0 + (red - green) / safe),
    )
    return np.where(span != 0.0, sixths / 6.0 % 1.0, 0.0)
