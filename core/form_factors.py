# SPDX-License-Identifier: GPL-3.0-or-later
"""Form factors of a point: to another patch's centre (T2) and to a whole polygon (T3), both without visibility.

F is the dimensionless share of the light leaving a small surface at the point (normal n) that reaches the polygon.
Lambert's formula is a sum over the polygon's edges a -> b, seen from the point::

    F = 1 / (2 pi) * sum  n . (b x a) / |a x b| * angle(a, b)

It holds for a polygon above the point's horizon; one that crosses the horizon is clipped there first.

References
----------
J. H. Lambert, Photometria, 1760.
D. R. Baum, H. E. Rushmeier, J. M. Winget, Improving radiosity solutions through the use of analytically determined
form-factors, SIGGRAPH 1989.
"""

import numpy as np
from numpy.typing import NDArray

# Pairs worked on at a time: their temporaries stay in a core's second-level cache.
BLOCK = 4096
# Edges seen under a wider angle than this cosine's are left to the careful kernel: the point is close to the edge.
WIDE_ANGLE = -0.9
# Sine of the elevation that still counts as touching the horizon.
HORIZON = {np.dtype(np.float32): 1e-6, np.dtype(np.float64): 1e-12}
# A point this close to the polygon's plane, relative to the polygon's size, is taken to lie in it.
IN_PLANE = 1e-8
TINY = 1e-300

Floats = NDArray[np.floating]


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

    Notes
    -----
    For a point in the polygon's plane the limit from the polygon's front is given: about 1/2 on the foot of a high
    perpendicular wall. Surfaces that lie back to back in one plane do not see each other.
    With float32 input the pairs close to each other are still computed in float64.
    """
    dtype = np.result_type(polygons.dtype, np.float32)
    factors = np.zeros(len(points), dtype)
    for start in range(0, len(points), BLOCK):
        block = slice(start, start + BLOCK)
        # Structure of arrays: (3, b) and (3, 4, b), so that every operation runs over contiguous numbers.
        x = np.ascontiguousarray(points[block].T, dtype)
        n = np.ascontiguousarray(normals[block].T, dtype)
        corners = np.ascontiguousarray(polygons[block].transpose(2, 1, 0), dtype)
        factors[block] = _block_factors(x, n, corners)
    return factors


def _block_factors(x: Floats, n: Floats, corners: Floats) -> Floats:
    """Return the factors of one block; x, n of shape (3, b), corners of shape (3, 4, b)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ax, ay, az = corners[0] - x[0], corners[1] - x[1], corners[2] - x[2]
        inverse = 1 / np.sqrt(ax * ax + ay * ay + az * az)
        elevation = (n[0] * ax + n[1] * ay + n[2] * az) * inverse
        bx, by, bz, inverse_b = (np.concatenate((c[1:], c[:1])) for c in (ax, ay, az, inverse))
        pair = inverse * inverse_b
        cosine = (ax * bx + ay * by + az * bz) * pair
        triple = n[0] * (by * az - bz * ay) + n[1] * (bz * ax - bx * az) + n[2] * (bx * ay - by * ax)
        lowest, highest = elevation.min(axis=0), elevation.max(axis=0)
        # A corner at the point itself gives NaN here, which also asks for care.
        careful = ~(cosine.min(axis=0) > WIDE_ANGLE)
        # angle / sin(angle) is smooth where the cosine reaches 1.
        cosine = np.minimum(cosine, 1 - np.finfo(x.dtype).epsneg)
        ratio = np.arccos(cosine) / np.sqrt((1 - cosine) * (1 + cosine))
        # From behind the sum is negative, so no plane test is needed.
        factors = np.maximum((triple * pair * ratio).sum(axis=0) / (2 * np.pi), 0)
    horizon = HORIZON[x.dtype]
    factors[~(highest > horizon)] = 0
    careful |= lowest < -horizon
    careful &= ~(highest <= horizon)
    where = np.flatnonzero(careful)
    if len(where):
        factors[where] = _careful_factors(
            x[:, where].astype(float), n[:, where].astype(float), corners[:, :, where].astype(float)
        )
    return factors


def _careful_factors(x: Floats, n: Floats, corners: Floats) -> Floats:
    """Return the factors of pairs that cross the horizon or come close; shapes as in `_block_factors`, float64."""
    factors = np.zeros(x.shape[1])
    seen, x = _lift_off_plane(x, n, corners)
    x, n, corners = x[:, seen], n[:, seen], corners[:, :, seen]
    a = corners - x[:, None]
    b = np.roll(a, -1, axis=1)
    height_a = _dot(n[:, None], a)
    height_b = np.roll(height_a, -1, axis=0)
    below_a, below_b = height_a < 0, height_b < 0
    crosses = below_a != below_b
    share = np.where(crosses, height_a / np.where(crosses, height_a - height_b, 1), 0)
    crossing = a + share * (b - a)
    # Keep what is above; the horizon itself closes the polygon, from where it goes down to where it comes up.
    leave = np.where(crosses & below_b, crossing, 0).sum(axis=1)
    enter = np.where(crosses & below_a, crossing, 0).sum(axis=1)
    start = np.concatenate((np.where(below_a, crossing, a), leave[:, None]), axis=1)
    end = np.concatenate((np.where(below_b, crossing, b), enter[:, None]), axis=1)
    kept = np.concatenate((~(below_a & below_b), crosses.any(axis=0)[None]))
    normal = _cross(end, start)
    sine = np.sqrt(_dot(normal, normal))
    angle = np.where(kept, np.arctan2(sine, _dot(start, end)), 0)
    terms = _dot(n[:, None], normal) * angle / np.maximum(sine, TINY)
    factors[seen] = np.clip(terms.sum(axis=0) / (2 * np.pi), 0, 1)
    return factors


def _lift_off_plane(x: Floats, n: Floats, corners: Floats) -> tuple[NDArray[np.bool_], Floats]:
    """Return which points see the polygon's front, and the points with those in its plane lifted off it a little."""
    diagonal, other = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    plane = _cross(diagonal, other)
    plane = plane / np.maximum(np.sqrt(_dot(plane, plane)), TINY)
    # The mid-plane of a quadrilateral that is not quite flat.
    distance = _dot(plane, x - (corners[:, 0] + corners[:, 1]) / 2)
    near = IN_PLANE * np.sqrt(np.maximum(_dot(diagonal, diagonal), _dot(other, other)))
    in_plane = np.abs(distance) < near
    back_to_back = in_plane & (_dot(n, plane) < -1 + 1e-9)
    lifted = x + np.where(in_plane, near - distance, 0) * plane
    return (distance > -near) & ~back_to_back, lifted


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])))
