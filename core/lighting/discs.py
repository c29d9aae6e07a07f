# SPDX-License-Identifier: GPL-3.0-or-later
"""Discs in the sky of a receiver: how much light one brings, and points spread evenly over it.

References
----------
J. M. Snyder, Area light sources for real-time graphics, Microsoft Research MSR-TR-96-11, 1996.
S. Lagarde, C. de Rousiers, Moving Frostbite to physically based rendering, SIGGRAPH course notes, 2014.
"""

from collections.abc import Iterator

import numpy as np

from ..arrays import FloatArray
from ..sequences import GOLDEN

# Points of a lattice that a lamp is averaged with.
_LATTICE = 377


def disc_form(sine: FloatArray, cosine: FloatArray) -> FloatArray:
    """Return the irradiance of a receiver under a disc of even radiance, relative to one that faces the disc.

    Parameters
    ----------
    sine : ndarray of shape (n,)
        Of the disc's angular radius.
    cosine : ndarray of shape (n,)
        Of the angle between the receiver's normal and the disc's middle.

    Returns
    -------
    ndarray of shape (n,)
        0 to 1: the cosine where all of the disc is above the horizon.
    """
    form = np.maximum(cosine, 0)
    cut = np.flatnonzero((np.abs(cosine) < sine) & (sine > 0))
    s, c = sine[cut], cosine[cut]
    x = np.sqrt(np.maximum(1 / (s * s) - 1, 0))
    high = np.sqrt(1 - c * c)
    y = np.clip(-x * c / high, -1, 1)
    w = high * np.sqrt(1 - y * y)
    # Of a whole hemisphere x is 0, and the last term a right angle.
    form[cut] = np.maximum((c * np.arccos(y) - x * w + np.arctan2(w, x) / (s * s)) / np.pi, 0)
    return form


def disc_directions(way: FloatArray, sine: FloatArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return directions spread evenly over discs in the sky, shape (n, 3), and 1 minus their cosines to the middle."""
    whole = sine * sine / (1 + np.sqrt(np.maximum(1 - sine * sine, 0)))
    x, y = square_to_disc(u, v)
    drop = (x * x + y * y) * whole
    # The map keeps areas, and so does the cap of a sphere by its height.
    across = np.sqrt(whole * (2 - drop))
    first, second = frame(way)
    x, y = x * across, y * across
    out = x[:, None] * first + y[:, None] * second + (1 - drop)[:, None] * way
    return np.asarray(out), drop


def frame(way: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors across each unit vector, shape (n, 3), and across each other.

    The basis of Duff et al., Building an orthonormal basis, revisited, JCGT 2017.
    """
    x, y, z = way.T
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1 / (sign + z)
    b = x * y * a
    return np.stack((1 + sign * x * x * a, sign * b, -sign * x), axis=1), np.stack((b, sign + y * y * a, -y), axis=1)


def lattice(count: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the points of a golden lattice in the unit square, each as two arrays of shape (count,)."""
    for index in range(_LATTICE):
        yield np.full(count, (index + 0.5) / _LATTICE), np.full(count, (index * GOLDEN + 0.5) % 1)


def square_to_disc(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points of the unit square as points of the unit disc; neighbours stay neighbours (Shirley, Chiu 1997)."""
    a, b = 2 * u - 1, 2 * v - 1
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    safe = np.where(radius == 0, 1, radius)
    turn = np.where(wide, np.pi / 4 * (b / safe), np.pi / 2 - np.pi / 4 * (a / safe))
    return radius * np.cos(turn), radius * np.sin(turn)
