# SPDX-License-Identifier: GPL-3.0-or-later
"""Unobstructed exchange between polygons as a double integral along their contours.

Stokes' theorem, used twice, turns the four-fold integral of T3 into one over both contours::

    A_i F_ij = 1 / (2 pi) * sum over edges of i and j of  (integral of ln r) dx_i . dx_j

It holds for polygons that lie entirely in front of each other's planes. The integral along j's edge is known in closed
form; the one along i's is done by Gauss quadrature, cut where its integrand is not smooth and graded towards the cuts,
so that edges may touch, coincide or cross.

References
----------
E. M. Sparrow, A new and simpler formulation for radiative angle factors, Journal of Heat Transfer 85, 1963.
S. Mazumder, M. Ravishankar, General procedure for calculation of diffuse view factors between arbitrary planar
polygons, International Journal of Heat and Mass Transfer 55, 2012.
"""

import numpy as np

from ..arrays import FloatArray, IntArray

# Edge pairs worked on at a time.
CHUNK = 4096
# Gauss points on each part of an edge: relative errors are below 1e-9 for edges that touch as for those that do not.
NEAR_POINTS, FAR_POINTS = 28, 12
# Edges further apart than this share of the longer one need no cuts.
FAR = 0.75


def exchange_areas(first: list[FloatArray], second: list[FloatArray]) -> FloatArray:
    """Return A_i F_ij = A_j F_ji of pairs of polygons that nothing stands between.

    Parameters
    ----------
    first, second : list of ndarray of shape (k, 3)
        Corners [m], counter-clockwise seen from the radiating side. Each polygon lies in front of the other's plane.

    Returns
    -------
    ndarray of shape (len(first),)
        Exchange areas [m^2].
    """
    sums = np.zeros(len(first))
    pending: list[tuple[IntArray, FloatArray, FloatArray]] = []
    count = 0
    for pair, (p, q) in enumerate(zip(first, second, strict=True)):
        a = np.stack((p, np.roll(p, -1, axis=0)), axis=1)
        b = np.stack((q, np.roll(q, -1, axis=0)), axis=1)
        rows, columns = (grid.ravel() for grid in np.indices((len(p), len(q))))
        pending.append((np.full(len(rows), pair), a[rows], b[columns]))
        count += len(rows)
        if count >= CHUNK or pair == len(first) - 1:
            owner, a, b = (np.concatenate(parts) for parts in zip(*pending, strict=True))
            sums += np.bincount(owner, _edge_integrals(a, b), minlength=len(first))
            pending, count = [], 0
    return np.maximum(sums / (2 * np.pi), 0)


def _edge_integrals(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the integral of ln r da . db over pairs of edges, arrays of shape (e, 2, 3)."""
    along_a, along_b = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0]
    length_a, length_b = _norm(along_a), _norm(along_b)
    apart = _norm(a.mean(axis=1) - b.mean(axis=1)) - (length_a + length_b) / 2
    far = apart > FAR * np.maximum(length_a, length_b)
    # Perpendicular edges exchange nothing.
    turned = np.abs(np.sum(along_a * along_b, axis=1)) > 1e-15 * length_a * length_b
    sums = np.zeros(len(a))
    for rows, n_points, graded in ((turned & far, FAR_POINTS, False), (turned & ~far, NEAR_POINTS, True)):
        where = np.flatnonzero(rows)
        for start in range(0, len(where), CHUNK):
            some = where[start : start + CHUNK]
            cuts = _cuts(a[some], b[some]) if graded else np.tile([0.0, 1.0], (len(some), 1))
            sums[some] = _outer_integral(a[some], b[some], cuts, *_rule(n_points, graded))
    return sums


def _rule(n_points: int, graded: bool) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights on [0, 1], graded towards both ends against logarithms and square roots there."""
    t, w = np.polynomial.legendre.leggauss(n_points)
    t, w = (t + 1) / 2, w / 2
    if graded:
        return t**3 * (10 - 15 * t + 6 * t**2), w * 30 * (t * (1 - t)) ** 2
    return t, w


def _cuts(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return where the edges a are cut, as ascending shares of their length, shape (e, 5).

    These are the points closest to b's ends and to the line through b: there the distance is not smooth, or nearly so.
    """
    along_a, along_b = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0]
    aa, ab, bb = (np.sum(u * v, axis=1) for u, v in ((along_a, along_a), (along_a, along_b), (along_b, along_b)))
    start, end = (np.sum((b[:, k] - a[:, 0]) * along_a, axis=1) / aa for k in (0, 1))
    offset = b[:, 0] - a[:, 0]
    skew = aa * bb - ab * ab
    parallel = skew <= 1e-12 * aa * bb
    line = np.sum(offset * along_a, axis=1) * bb - np.sum(offset * along_b, axis=1) * ab
    closest = np.where(parallel, 0, line / np.where(parallel, 1, skew))
    inner = np.stack((np.zeros(len(a)), start, end, closest, np.ones(len(a))), axis=1)
    return np.sort(np.clip(inner, 0, 1), axis=1)


def _outer_integral(
    a: FloatArray, b: FloatArray, cuts: FloatArray, nodes: FloatArray, weights: FloatArray
) -> FloatArray:
    """Return the integrals over a of the inner ones over b, part by part between the cuts."""
    along_a, along_b = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0]
    length_b = _norm(along_b)
    unit_b = along_b / length_b[:, None]
    sums = np.zeros(len(a))
    for low, high in zip(cuts.T[:-1], cuts.T[1:], strict=True):
        some = np.flatnonzero(high > low)
        share = low[some, None] + (high - low)[some, None] * nodes
        x, y, z = ((a[some, 0, k] - b[some, 0, k])[:, None] + share * along_a[some, None, k] for k in range(3))
        u, v, w = (unit_b[some, None, k] for k in range(3))
        along = x * u + y * v + z * w
        # The distance from b's line by its components: no digits are lost close to it.
        x -= along * u
        y -= along * v
        z -= along * w
        distance = np.sqrt(x * x + y * y + z * z)
        inner = _antiderivative(length_b[some, None] - along, distance) - _antiderivative(-along, distance)
        sums[some] += (inner @ weights) * (high - low)[some]
    return sums * np.asarray(np.sum(along_a * unit_b, axis=1))


def _antiderivative(t: FloatArray, distance: FloatArray) -> FloatArray:
    """Return the integral of ln sqrt(t^2 + d^2) over t."""
    squared = t * t + distance * distance
    logarithm = np.log(np.where(squared > 0, squared, 1))
    return np.asarray(t * (0.5 * logarithm - 1) + distance * np.arctan2(t, distance))


def _norm(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors along the last axis."""
    return np.sqrt(np.sum(vectors * vectors, axis=-1))
