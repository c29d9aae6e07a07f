# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light patches exchange: blocks of the symmetric matrix A_i F_ij, visibility included.

Both centre-to-centre factors (T2) and factors between areas (T3) are computed for two compact groups of patches at a
time, so that every step is arithmetic on small dense blocks and visibility is decided for whole blocks:

- far pairs: the mean of the kernel cos cos / (pi r^2) over eight pairs of points, exact to the third order; each pair
  of points is tested for visibility by itself, so that what is near and what is visible are integrated together;
- pairs closer than `NEAR` times their radii: Lambert's exact factor from points of the smaller patch to the whole of
  the larger one, times the visible share.

A F is symmetric by reciprocity, so every pair of groups is computed once.
"""

from typing import TypeVar

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray, SingleArray
from ..form_factors import point_to_polygon
from .exchange import ROUNDING, Exchange, meeting
from .quadrature import gauss_points
from .visible_share import visible_share

AnyFloat = TypeVar("AnyFloat", FloatArray, SingleArray)

# Centre distance over the sum of both radii below which patches may touch.
TOUCHING = 1.1
# Points along each side of the receiver for the exact factor of near and of touching pairs.
NEAR_ORDER, TOUCHING_ORDER = 3, 8


def block(x: Exchange, i: IntArray, j: IntArray) -> tuple[FloatArray | None, int]:
    """Compute A_i F_ij between two groups of patches.

    Parameters
    ----------
    x : Exchange
    i, j : ndarray of shape (m,), (k,)
        Patches.

    Returns
    -------
    exchanged : ndarray of shape (m, k) or None
        [m^2]; None when no patch of one group faces any of the other.
    segments : int
        How many were tested for visibility.
    """
    kernel = _kernel(x, i, j)
    rows, columns = _close(x, i, j)
    if kernel is None:
        if not len(rows):
            return None, 0
        kernel = np.zeros((len(x.of_i), len(i), len(j)), dtype=np.float32)
    # The pairs of points are part of all q x q.
    whole = kernel.sum(axis=0, dtype=np.float64) * (x.points.shape[1] ** 2 / (len(x.of_i) * np.pi) * x.size**2)
    # A patch does not see itself, though the points of a bent one may.
    whole[i[:, None] == j] = 0.0
    whole[rows, columns] = _exact(x, i[rows], j[columns])
    close = np.zeros(whole.shape, dtype=bool)
    close[rows, columns] = True
    share, segments = visible_share(x, i, j, kernel, whole, close)
    return np.asarray(whole * share), segments


def _kernel(x: Exchange, i: IntArray, j: IntArray) -> SingleArray | None:
    """Return cos cos / r^2 times both areas for each pair of points, shape (s, m, k).

    Lengths are shares of the scene's size and places are taken from the middle of the block, so that single precision
    is enough.
    """
    origin = x.patches.centre[i].mean(axis=0)
    p, q = (((meeting(x, *of) - origin) / x.size).astype(np.float32) for of in ((i, x.of_i), (j, x.of_j)))
    w, v = (x.weights[i].T[x.of_i] / x.size**2)[..., None], (x.weights[j].T[x.of_j] / x.size**2)[:, None]
    n, m = x.patches.normal[i], x.patches.normal[j]
    over_j = _heights(p, m, (m * (x.patches.centre[j] - origin)).sum(axis=1) / x.size)
    over_i = _heights(q, n, (n * (x.patches.centre[i] - origin)).sum(axis=1) / x.size)
    if not (over_j.any() and over_i.any()):
        return None
    over_j *= w.astype(np.float32)
    over_i *= v.transpose(0, 2, 1).astype(np.float32)
    squared = np.maximum(_squared_distances(p, q), np.float32(ROUNDING**2))
    over_j *= over_i.transpose(0, 2, 1)
    over_j /= squared
    over_j /= squared
    return over_j


def _heights(points: SingleArray, normals: FloatArray, offsets: FloatArray) -> SingleArray:
    """Return how far points (s, m, 3) lie above planes (k, 3), (k,), shape (s, m, k); 0 below or in them."""
    planes = np.vstack((normals.T, -offsets - ROUNDING)).astype(np.float32)
    ones = np.ones((*points.shape[:2], 1), dtype=np.float32)
    height = np.concatenate((points, ones), axis=2) @ planes
    return np.asarray(np.maximum(height, 0.0, out=height))


def _squared_distances(p: AnyFloat, q: AnyFloat) -> AnyFloat:
    """Return the squared distances of points p (..., m, 3) and q (..., k, 3), shape (..., m, k)."""
    # One product of matrices: p.p - 2 p.q + q.q.
    of_p = np.square(p).sum(axis=-1, keepdims=True)
    of_q = np.square(q).sum(axis=-1, keepdims=True)
    left = np.concatenate((-2 * p, of_p, np.ones_like(of_p)), axis=-1)
    right = np.concatenate((q, np.ones_like(of_q), of_q), axis=-1)
    squared: AnyFloat = left @ right.swapaxes(-1, -2)
    return squared


def _close(x: Exchange, i: IntArray, j: IntArray) -> tuple[IntArray, IntArray]:
    """Return rows and columns of the pairs that are near each other for their size, and partly face each other."""
    c, d, r, s = x.patches.centre[i], x.patches.centre[j], x.radius[i], x.radius[j]
    middle, other = c.mean(axis=0), d.mean(axis=0)
    reach = x.near * (float(np.max(r)) + float(np.max(s)))
    reach += float(np.max(np.linalg.norm(c - middle, axis=1))) + float(np.max(np.linalg.norm(d - other, axis=1)))
    none = np.zeros(0, dtype=np.int64)
    if x.near == 0.0 or np.linalg.norm(other - middle) > reach:
        return none, none
    squared = _squared_distances(c - middle, d - middle)
    rows, columns = np.nonzero((squared < np.square(x.near * (r[:, None] + s))) & (i[:, None] != j))
    sees = _rise(x, i[rows], j[columns])[1] & _rise(x, j[columns], i[rows])[1]
    return rows[sees], columns[sees]


def _exact(x: Exchange, i: IntArray, j: IntArray) -> FloatArray:
    """Return A_i F_ij of pairs of patches, shape (p,), as if nothing stood between them [m^2]."""
    # The smaller patch receives: the factor changes least over it. But one that the other's plane cuts is the source:
    # Lambert's formula clips it exactly, while points on it would meet a step.
    cut_i, cut_j = np.logical_and(*_rise(x, i, j)), np.logical_and(*_rise(x, j, i))
    to_i = np.where(cut_i == cut_j, x.radius[i] < x.radius[j], cut_j)
    receiver, source = np.where(to_i, i, j), np.where(to_i, j, i)
    patches = x.patches
    apart = np.linalg.norm(patches.centre[receiver] - patches.centre[source], axis=1)
    touching = apart < TOUCHING * (x.radius[receiver] + x.radius[source])
    result = np.zeros(len(i))
    for order, chosen in ((NEAR_ORDER, ~touching), (TOUCHING_ORDER, touching)):
        if not chosen.any():
            continue
        to, of = receiver[chosen], source[chosen]
        points, weights = gauss_points(patches.corners[to], order)
        factors = point_to_polygon(
            points.reshape(-1, 3),
            np.repeat(patches.normal[to], order**2, axis=0),
            np.repeat(patches.corners[of], order**2, axis=0),
        )
        result[chosen] = patches.area[to] * (weights * factors.reshape(weights.shape)).sum(axis=1)
    return result


def _rise(x: Exchange, i: IntArray, j: IntArray) -> tuple[BoolArray, BoolArray]:
    """Return which patches i have a corner below the planes of patches j, and which have one above, shape (p,)."""
    height = ((x.patches.corners[i] - x.patches.centre[j][:, None]) * x.patches.normal[j][:, None]).sum(axis=2)
    least = 1e-4 * x.radius[i]
    return height.min(axis=1) < -least, height.max(axis=1) > least
