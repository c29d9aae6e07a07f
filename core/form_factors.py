# SPDX-License-Identifier: GPL-3.0-or-later
"""Form factors of a point: to another patch's centre (T2) and to a whole polygon (T3), both without visibility.

F is the dimensionless share of the light leaving a small surface at the point (normal n) that reaches the polygon.
Lambert's formula is a sum over the polygon's edges, from corner a to corner b as seen from the point::

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

Floats = NDArray[np.floating]
FloatType = type[np.float32] | type[np.float64]

# Pairs worked on at a time: their temporaries stay in a core's own cache.
BLOCK = 8192
# Edges seen under a wider angle than this cosine's are left to the careful kernel: the point is close to the edge.
WIDE_ANGLE = -0.99
# Sine of the elevation that still counts as touching the horizon, so that a wall's foot needs no clipping.
HORIZON = {np.dtype(np.float32): 1e-6, np.dtype(np.float64): 1e-12}
# A point closer to the polygon's plane than this share of the polygon's size is taken to lie in it.
IN_PLANE = {np.dtype(np.float32): 1e-5, np.dtype(np.float64): 1e-8}
TINY = 1e-300


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
        sums, careful = _edge_sums(*_edge_terms(x, n, polygons[block]))
        where = np.flatnonzero(careful)
        corners = polygons[block][where].transpose(2, 1, 0)
        sums[where] = _careful_factors(x[:, where], n[:, where], corners, IN_PLANE[dtype])
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
        sums, careful = _edge_sums(*terms)
        row, column = np.divmod(np.flatnonzero(careful), len(polygons))
        sums[careful] = _careful_factors(x[block][row].T, n[block][row].T, corners[:, :, column], in_plane)
        factors[block] = sums.reshape(-1, len(polygons))
    return factors


def _edge_terms(x: Floats, n: Floats, polygons: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return what `_edge_sums` takes, for points and normals of shape (3, b) and polygons of shape (b, 4, 3)."""
    corners = np.zeros((3, 5, x.shape[1]), x.dtype)
    np.subtract(polygons.transpose(2, 1, 0), x[:, None], out=corners[:, :4])
    corners[:, 4] = corners[:, 0]
    a, b = corners[:, :4], corners[:, 1:]
    # The edge itself, not its far end, keeps the triple product's digits when the polygon is small and far.
    edge = b - a
    triple = a[0] * (edge[1] * n[2] - edge[2] * n[1])
    triple += a[1] * (edge[2] * n[0] - edge[0] * n[2])
    triple += a[2] * (edge[0] * n[1] - edge[1] * n[0])
    return _dot(a, a), _dot(a, n[:, None]), _dot(a, b), triple


def _receiver_numbers(x: Floats, n: Floats) -> tuple[Floats, ...]:
    """Return the receivers' side of the products that `points_to_polygons` forms: four arrays of shape (r, ...)."""
    one, squared = np.ones((len(x), 1)), _dot(x.T, x.T)[:, None]
    return (
        np.hstack((-2 * x, squared, one)),
        np.hstack((n, -_dot(n.T, x.T)[:, None])),
        np.hstack((-x, squared, one)),
        np.hstack((n, _cross(n.T, x.T).T)),
    )


def _edge_numbers(polygons: Floats) -> tuple[Floats, ...]:
    """Return the edges' side of the products that `points_to_polygons` forms: four arrays of shape (4, ..., k)."""
    p = np.ascontiguousarray(polygons.transpose(1, 2, 0))
    q = np.roll(p, -1, axis=0)
    p_first, q_first = p.swapaxes(0, 1), q.swapaxes(0, 1)
    one = np.ones((4, 1, p.shape[2]))
    return (
        np.concatenate((p, one, _dot(p_first, p_first)[:, None]), axis=1),
        np.concatenate((p, one), axis=1),
        np.concatenate((p + q, one, _dot(p_first, q_first)[:, None]), axis=1),
        np.concatenate((_cross(p_first, q_first).swapaxes(0, 1), p - q), axis=1),
    )


def _edge_sums(squared: Floats, height: Floats, dots: Floats, triple: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return Lambert's sum and which pairs it is not good enough for, because they cross the horizon or are close.

    Parameters
    ----------
    squared, height, dots, triple : ndarray of shape (4, b)
        |a|^2, n . a, a . b and n . (a x b) of the four edges a -> b, seen from the point; overwritten.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = np.sqrt(squared, out=squared)
        np.divide(1, inverse, out=inverse)
        height *= inverse
        lowest, highest = height.min(axis=0), height.max(axis=0)
        pair = np.multiply(inverse, inverse[[1, 2, 3, 0]], out=height)
        dots *= pair
        triple *= pair
        # A corner at the point itself gives NaN here, which also asks for care.
        careful = ~(dots.min(axis=0) > WIDE_ANGLE)
        triple *= _angle_over_sine(dots)
    # From behind the sum is negative, so no plane test is needed.
    sums = triple.sum(axis=0) / triple.dtype.type(-2 * np.pi)
    np.maximum(sums, 0, out=sums)
    horizon = HORIZON[sums.dtype]
    hidden = highest <= horizon
    sums[hidden] = 0
    careful |= lowest < -horizon
    careful &= ~hidden
    return sums, careful


def _ratio_polynomial(degree: int) -> list[float]:
    """Return the coefficients, highest first, of x / sin(x) in t = 1 - cos(x), x to a quarter of the widest."""
    widest = 1 - np.cos(np.arccos(WIDE_ANGLE) / 4)
    chebyshev = np.polynomial.Chebyshev.interpolate(
        lambda t: np.arccos(1 - t) / np.sqrt(t * (2 - t)), degree, domain=[0, widest]
    )
    return [float(c) for c in chebyshev.convert(kind=np.polynomial.Polynomial).coef[::-1]]


# Errors 5e-8 and 4e-15: about one rounding each.
RATIO = {np.dtype(np.float32): _ratio_polynomial(4), np.dtype(np.float64): _ratio_polynomial(10)}


def _angle_over_sine(cosine: Floats) -> Floats:
    """Return angle / sin(angle) where the cosine is over WIDE_ANGLE; overwrites the cosine.

    Halving the angle twice leaves a function so smooth that a short polynomial gives it: half the time of arccos where
    that is vectorised, a tenth where it is not.
    """
    half = cosine.dtype.type(0.5)
    cosine *= half
    cosine += half
    half_angle = np.sqrt(cosine, out=cosine)
    quarter_angle = half_angle * half
    quarter_angle += half
    np.sqrt(quarter_angle, out=quarter_angle)
    # sin(x) = 4 sin(x/4) cos(x/4) cos(x/2)
    half_angle *= quarter_angle
    t = np.subtract(1, quarter_angle, out=quarter_angle)
    first, second, *rest = (cosine.dtype.type(c) for c in RATIO[cosine.dtype])
    ratio = t * first
    ratio += second
    for coefficient in rest:
        ratio *= t
        ratio += coefficient
    ratio /= half_angle
    return ratio


def _careful_factors(x: Floats, n: Floats, corners: Floats, in_plane: float) -> Floats:
    """Return the factors of pairs that cross the horizon or come close, in float64.

    Parameters
    ----------
    x, n : ndarray of shape (3, b)
    corners : ndarray of shape (3, 4, b)
    in_plane : float
        Distance from the polygon's plane that counts as none, relative to the polygon's size.
    """
    x, n, corners = x.astype(float), n.astype(float), corners.astype(float)
    factors = np.zeros(x.shape[1])
    seen, x = _lift_off_plane(x, n, corners, in_plane)
    x, n, corners = x[:, seen], n[:, seen], corners[:, :, seen]
    start, end, kept = _clip_at_horizon(n, corners - x[:, None])
    normal = _cross(end, start)
    sine = np.sqrt(_dot(normal, normal))
    angle = np.where(kept, np.arctan2(sine, _dot(start, end)), 0)
    terms = _dot(n[:, None], normal) * angle / np.maximum(sine, TINY)
    factors[seen] = np.clip(terms.sum(axis=0) / (2 * np.pi), 0, 1)
    return factors


def _clip_at_horizon(n: Floats, a: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return the edges of polygons clipped at the horizon: starts and ends of shape (3, 5, b), and which there are."""
    b = a[:, [1, 2, 3, 0]]
    height_a = _dot(n[:, None], a)
    height_b = height_a[[1, 2, 3, 0]]
    below_a, below_b = height_a < 0, height_b < 0
    crosses = below_a != below_b
    crossing = a + np.where(crosses, height_a / np.where(crosses, height_a - height_b, 1), 0) * (b - a)
    # The horizon itself closes the polygon, from where it goes down to where it comes up.
    down = np.where(crosses & below_b, crossing, 0).sum(axis=1)
    up = np.where(crosses & below_a, crossing, 0).sum(axis=1)
    start = np.concatenate((np.where(below_a, crossing, a), down[:, None]), axis=1)
    end = np.concatenate((np.where(below_b, crossing, b), up[:, None]), axis=1)
    return start, end, np.concatenate((~(below_a & below_b), crosses.any(axis=0)[None]))


def _lift_off_plane(x: Floats, n: Floats, corners: Floats, in_plane: float) -> tuple[NDArray[np.bool_], Floats]:
    """Return which points see the polygon's front, and the points with those in its plane lifted off it a little."""
    diagonal, other = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    plane = _cross(diagonal, other)
    plane = plane / np.maximum(np.sqrt(_dot(plane, plane)), TINY)
    # The mid-plane of a quadrilateral that is not quite flat.
    distance = _dot(plane, x - (corners[:, 0] + corners[:, 1]) / 2)
    near = in_plane * np.sqrt(np.maximum(_dot(diagonal, diagonal), _dot(other, other)))
    lying = np.abs(distance) < near
    back_to_back = lying & (_dot(n, plane) < -1 + 1e-9)
    return (distance > -near) & ~back_to_back, x + np.where(lying, near - distance, 0) * plane


def _dot(a: Floats, b: Floats) -> Floats:
    """Return dot products over the first axis."""
    product = a * b
    total = product[0] + product[1]
    total += product[2]
    return np.asarray(total)


def _cross(a: Floats, b: Floats) -> Floats:
    """Return cross products over the first axis."""
    return np.asarray(np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])))
