# SPDX-License-Identifier: GPL-3.0-or-later
"""Points on elements as a receiver close by sees them: most of the light comes from the end next to it."""

import numpy as np

from .tree import Float
from .vectors import crosses, dots

_TINY = 1e-300
# Heights over an element below this share of its size make no difference.
_LEAST = 1e-4
# Nearest points this near to an edge, as a share of the way across, have nothing beyond them.
_RIM = 1e-3


def nearest_points(point: Float, corners: Float, normal: Float) -> Float:
    """Return the point of each polygon that is nearest to a point, pair by pair.

    Parameters
    ----------
    point : ndarray of shape (k, 3)
        [m].
    corners : ndarray of shape (k, 4, 3)
        Of convex polygons [m]; a triangle repeats its last corner.
    normal : ndarray of shape (k, 3)
        Their unit normals.

    Returns
    -------
    ndarray of shape (k, 3)
        [m].
    """
    foot = point - dots(point - corners[:, 0], normal)[:, None] * normal
    inside = np.ones(len(point), bool)
    nearest, least = foot.copy(), np.full(len(point), np.inf)
    for a, b in zip(range(4), (1, 2, 3, 0), strict=True):
        start, along = corners[:, a], corners[:, b] - corners[:, a]
        share = dots(point - start, along) / np.maximum(dots(along, along), _TINY)
        at = start + np.clip(share, 0, 1)[:, None] * along
        gap = _squared(point - at)
        nearest = np.where((gap < least)[:, None], at, nearest)
        least = np.minimum(gap, least)
        inside &= dots(crosses(along, foot - start), normal) >= 0
    return np.where(inside[:, None], foot, nearest)


def draw_near(point: Float, u: Float, v: Float, corners: Float, normal: Float) -> tuple[Float, Float]:
    """Draw points on polygons where a receiver close by sees most of them, pair by pair.

    On every line from the nearest point they have the density of the form factor of a receiver that looks straight at
    the polygon, ``h^2 / (r^2 + h^2)^2``: even over its solid angle there, and its inverse is closed.

    Parameters
    ----------
    point : ndarray of shape (k, 3)
        Receivers [m].
    u, v : ndarray of shape (k,)
        Numbers in [0, 1).
    corners, normal
        See `nearest_points`.

    Returns
    -------
    drawn : ndarray of shape (k, 3)
        [m].
    weight : ndarray of shape (k,)
        Density of points spread evenly, over that of these.
    """
    nearest = nearest_points(point, corners, normal)
    even, weight = _spread(u, v, corners, normal, nearest)
    to = even - nearest
    height = _squared(point - nearest)
    height = np.maximum(height, _LEAST**2 * _squared(corners[:, 2] - corners[:, 0]))
    distance = dots(to, to)
    rim = distance / _towards_rim(to, nearest, corners, normal) ** 2
    shrunk = np.sqrt(height / (rim - distance + height))
    moved = distance * shrunk * shrunk
    weight *= (moved + height) ** 2 / (height * (rim + height))
    return nearest + shrunk[:, None] * to, weight


def _squared(vector: Float) -> Float:
    """Return the squared lengths of vectors, shape (k,)."""
    return dots(vector, vector)


def _spread(u: Float, v: Float, corners: Float, normal: Float, nearest: Float) -> tuple[Float, Float]:
    """Return points of the polygons, as many on all sides of the nearest one however narrow those are; see above."""
    a, b, c, d = corners.transpose(1, 0, 2)
    along, across = b - a, d - a
    aa, ab, bb = (dots(x, y) for x, y in ((along, along), (along, across), (across, across)))
    offset = nearest - a
    oa, ob = dots(offset, along), dots(offset, across)
    determinant = np.maximum(aa * bb - ab * ab, _TINY)
    beside_u, weight_u = _either_side(u, (oa * bb - ob * ab) / determinant)
    beside_v, weight_v = _either_side(v, (ob * aa - oa * ab) / determinant)
    share_u, share_v = beside_u[:, None], beside_v[:, None]
    point, weight = a + share_u * along + share_v * across + share_u * share_v * (a - b + c - d), weight_u * weight_v
    three = np.flatnonzero((c == d).all(axis=1))
    point[three], weight[three] = _fan(u[three], v[three], corners[three, :3], normal[three], nearest[three])
    return point, weight


def _fan(u: Float, v: Float, corners: Float, normal: Float, nearest: Float) -> tuple[Float, Float]:
    """Return points of triangles, as many towards each edge that the nearest point is not on, as `_spread` does."""
    to = corners - nearest[:, None]
    area = np.stack([dots(crosses(to[:, k], to[:, (k + 1) % 3]), normal) for k in range(3)], axis=1)
    area = np.where(area > _RIM * area.max(axis=1, keepdims=True), area, 0)
    open_, count = area > 0, np.maximum(np.count_nonzero(area, axis=1), 1)
    turn = np.minimum((u * count).astype(np.int64), count - 1)
    edge = ((np.cumsum(open_, axis=1) == turn[:, None] + 1) & open_).argmax(axis=1)
    row, far = np.arange(len(u)), (u * count - turn)[:, None]
    # Never the nearest point itself, which is on no line from there.
    share = np.sqrt(np.maximum(v, _RIM * _RIM))[:, None]
    point = nearest + share * ((1 - far) * to[row, edge] + far * to[row, (edge + 1) % 3])
    return point, count * area[row, edge] / np.maximum(area.sum(axis=1), _TINY)


def _either_side(u: Float, at: Float) -> tuple[Float, Float]:
    """Spread numbers in [0, 1) so that half are below `at`; return with them even density over theirs."""
    between = (at > _RIM) & (at < 1 - _RIM)
    low = u < 0.5
    split = np.where(low, 2 * u * at, at + (2 * u - 1) * (1 - at))
    return np.where(between, split, u), np.where(between, 2 * np.where(low, at, 1 - at), 1)


def _towards_rim(to: Float, nearest: Float, corners: Float, normal: Float) -> Float:
    """Return which part of the way from the nearest point to the polygon's rim each vector is, shape (k,)."""
    part = np.full(len(to), 1e-6)
    for a, b in zip(range(4), (1, 2, 3, 0), strict=True):
        inward = crosses(normal, corners[:, b] - corners[:, a])
        room = np.maximum(dots(nearest - corners[:, a], inward), 0)
        used = np.clip(-dots(to, inward), 0, room)
        part = np.maximum(part, np.where(used < room, used / np.maximum(room, _TINY), used > 0))
    return part
