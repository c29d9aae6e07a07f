# SPDX-License-Identifier: GPL-3.0-or-later
"""Form factors of a point: to another patch's centre (T2) and to a whole polygon (T3), both without visibility.

F is the dimensionless share of the light leaving a small surface at the point (normal n) that reaches the polygon.
The sum over edges that gives it exactly is in `lambert`; here it is laid out for many pairs at a time.
"""

import numpy as np
from numpy.typing import NDArray

from .lambert import IN_PLANE, careful_factors, cross, dot, edge_sums

Floats = NDArray[np.floating]
FloatType = type[np.float32] | type[np.float64]

# Pairs worked on at a time: their temporaries stay in a core's own cache.
BLOCK = 8192


def centre_to_centre(
    centres_i: Floats, normals_i: Floats, centres_j: Floats, normals_j: Floats, areas_j: Floats
) -> Floats:
    """Return the form factor of pairs of patches as if all light went between their centres.

    Parameters
    ----------
    centres_i, centres_j : ndarray of shape (..., 3)
        Patch centres [m]; leading axes broadcast, so `(n, 1, 3)` against `(m, 3)` gives all pairs.
    normals_i, normals_j : ndarray of shape (..., 3)
        Unit normals.
    areas_j : ndarray of shape (...,)
        Areas of the patches j [m^2].

    Returns
    -------
    ndarray of shape (...,)
        F_ij; 0 where either patch is behind the other's plane or the centres coincide. Visibility is not looked at.

    Notes
    -----
    T2: cos(theta_i) cos(theta_j) A_j / (pi r^2). It may exceed 1 for patches closer than their size.
    """
    x, y, z = (centres_j[..., k] - centres_i[..., k] for k in range(3))
    squared = x * x + y * y + z * z
    # Both cosines still carry one length r each.
    facing_i = normals_i[..., 0] * x + normals_i[..., 1] * y + normals_i[..., 2] * z
    facing_j = -(normals_j[..., 0] * x + normals_j[..., 1] * y + normals_j[..., 2] * z)
    shown = np.maximum(facing_i, 0) * np.maximum(facing_j, 0)
    apart = np.where(squared > 0, squared, 1)
    return np.asarray(shown * areas_j / (np.pi * apart * apart))


def point_to_polygon(points: Floats, normals: Floats, polygons: Floats) -> Floats:
    """Return the exact form factor from points to polygons, pair by pair, clipped at each point's horizon.

    Parameters
    ----------
    points : ndarray of shape (m, 3)
        Receivers [m].
    normals : ndarray of shape (m, 3)
        Their unit normals.
    polygons : ndarray of shape (m, 4, 3)
        Convex quadrilaterals [m], counter-clockwise seen from their radiating side; a triangle repeats its last corner.

    Returns
    -------
    ndarray of shape (m,)
        Form factors, of the dtype of `polygons`; 0 for points behind a polygon. Visibility is not looked at.

    See Also
    --------
    points_to_polygons : Every point with every polygon, twice as fast.

    Notes
    -----
    For a point in the polygon's plane the limit from the polygon's front is given: about 1/2 on the foot of a high
    perpendicular wall. Surfaces that lie back to back in one plane do not see each other.
    Half the time goes with float32; pairs close to each other are then still computed in float64.
    """
    dtype = np.result_type(polygons.dtype, np.float32)
    factors = np.zeros(len(points), dtype)
    for start in range(0, len(points), BLOCK):
        block = slice(start, start + BLOCK)
        # Structure of arrays: every operation runs over contiguous numbers.
        x = np.ascontiguousarray(points[block].T, dtype)
        n = np.ascontiguousarray(normals[block].T, dtype)
        sums, careful = edge_sums(*_edge_terms(x, n, polygons[block]))
        where = np.flatnonzero(careful)
        corners = polygons[block][where].transpose(2, 1, 0)
        sums[where] = careful_factors(x[:, where], n[:, where], corners, IN_PLANE[dtype])
        factors[block] = sums
    return factors


def points_to_polygons(points: Floats, normals: Floats, polygons: Floats, dtype: FloatType = np.float64) -> Floats:
    """Return the exact form factor from every point to every polygon, clipped at each point's horizon.

    Parameters
    ----------
    points, normals : ndarray of shape (r, 3)
        Receivers [m] and their unit normals.
    polygons : ndarray of shape (k, 4, 3)
        As in `point_to_polygon`.
    dtype : type
        Of the result and of most of the work: `np.float32` takes half the time of `np.float64`.

    Returns
    -------
    ndarray of shape (r, k)
        Form factors, as `point_to_polygon` gives them.

    Notes
    -----
    Squared distances, heights, dot and triple products are all linear in a few numbers of the receiver and a few of
    the edge, so matrix products make them. These stay in float64, which the differences need.
    """
    factors = np.zeros((len(points), len(polygons)), dtype)
    if factors.size == 0:
        return factors
    # Near the origin the differences lose least.
    origin = polygons.mean(axis=(0, 1), dtype=float)
    x, n = (points - origin).astype(float), normals.astype(float)
    receivers, edges = _receiver_numbers(x, n), _edge_numbers((polygons - origin).astype(float))
    corners = np.ascontiguousarray((polygons - origin).transpose(2, 1, 0), float)
    rows = max(1, BLOCK // len(polygons))
    in_plane = IN_PLANE[np.result_type(points, polygons, np.float32)]
    for start in range(0, len(x), rows):
        block = slice(start, start + rows)
        terms: list[Floats] = []
        for numbers, edge in zip(receivers, edges, strict=True):
            terms.append((numbers[block] @ edge).reshape(4, -1).astype(dtype, copy=False))
        sums, careful = edge_sums(*terms)
        row, column = np.divmod(np.flatnonzero(careful), len(polygons))
        sums[careful] = careful_factors(x[block][row].T, n[block][row].T, corners[:, :, column], in_plane)
        factors[block] = sums.reshape(-1, len(polygons))
    return factors


def _edge_terms(x: Floats, n: Floats, polygons: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return what `edge_sums` takes, for points and normals of shape (3, b) and polygons of shape (b, 4, 3)."""
    corners = np.zeros((3, 5, x.shape[1]), x.dtype)
    np.subtract(polygons.transpose(2, 1, 0), x[:, None], out=corners[:, :4])
    corners[:, 4] = corners[:, 0]
    a, b = corners[:, :4], corners[:, 1:]
    # The edge itself, not its far end, keeps the triple product's digits when the polygon is small and far.
    edge = b - a
    triple = a[0] * (edge[1] * n[2] - edge[2] * n[1])
    triple += a[1] * (edge[2] * n[0] - edge[0] * n[2])
    triple += a[2] * (edge[0] * n[1] - edge[1] * n[0])
    return dot(a, a), dot(a, n[:, None]), dot(a, b), triple


def _receiver_numbers(x: Floats, n: Floats) -> tuple[Floats, ...]:
    """Return the receivers' side of the products that `points_to_polygons` forms: four arrays of shape (r, ...)."""
    one, squared = np.ones((len(x), 1)), dot(x.T, x.T)[:, None]
    return (
        np.hstack((-2 * x, squared, one)),
        np.hstack((n, -dot(n.T, x.T)[:, None])),
        np.hstack((-x, squared, one)),
        np.hstack((n, cross(n.T, x.T).T)),
    )


def _edge_numbers(polygons: Floats) -> tuple[Floats, ...]:
    """Return the edges' side of the products that `points_to_polygons` forms: four arrays of shape (4, ..., k)."""
    p = np.ascontiguousarray(polygons.transpose(1, 2, 0))
    q = np.roll(p, -1, axis=0)
    p_first, q_first = p.swapaxes(0, 1), q.swapaxes(0, 1)
    one = np.ones((4, 1, p.shape[2]))
    return (
        np.concatenate((p, one, dot(p_first, p_first)[:, None]), axis=1),
        np.concatenate((p, one), axis=1),
        np.concatenate((p + q, one, dot(p_first, q_first)[:, None]), axis=1),
        np.concatenate((cross(p_first, q_first).swapaxes(0, 1), p - q), axis=1),
    )
