# SPDX-License-Identifier: GPL-3.0-or-later
"""Lambert's form factor of a point and a polygon, for a whole block of pairs at once.

It is a sum over the polygon's edges, from corner a to corner b as seen from the point with normal n::

    F = 1 / (2 pi) * sum  n . (b x a) / |a x b| * angle(a, b)

It holds for a polygon above the point's horizon; one that crosses the horizon is clipped there first. Vectors have
their components along the first axis: every operation runs over contiguous numbers.

References
----------
J. H. Lambert, Photometria, 1760.
D. R. Baum, H. E. Rushmeier, J. M. Winget, Improving radiosity solutions through the use of analytically determined
form-factors, SIGGRAPH 1989.
"""

import numpy as np
from numpy.typing import NDArray

from .arrays import BoolArray

Floats = NDArray[np.floating]

# Edges seen under a wider angle than this cosine's are left to the careful kernel: the point is close to the edge.
WIDE_ANGLE = -0.99
# Sine of the elevation that still counts as touching the horizon, so that a wall's foot needs no clipping.
HORIZON = {np.dtype(np.float32): 1e-6, np.dtype(np.float64): 1e-12}
# A point closer to the polygon's plane than this share of the polygon's size is taken to lie in it.
IN_PLANE = {np.dtype(np.float32): 1e-5, np.dtype(np.float64): 1e-8}
TINY = 1e-300


def edge_sums(squared: Floats, height: Floats, dots: Floats, triple: Floats) -> tuple[Floats, BoolArray]:
    """Return Lambert's sum and which pairs it is not good enough for, because they cross the horizon or are close.

    Parameters
    ----------
    squared, height, dots, triple : ndarray of shape (4, b)
        |a|^2, n . a, a . b and n . (a x b) of the four edges a -> b, seen from the point; overwritten.

    Returns
    -------
    sums : ndarray of shape (b,)
        Form factors; 0 from behind.
    careful : ndarray of shape (b,)
        Whether `careful_factors` has to do it.
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


def careful_factors(x: Floats, n: Floats, corners: Floats, in_plane: float) -> Floats:
    """Return the factors of pairs that cross the horizon or come close, in float64.

    Parameters
    ----------
    x, n : ndarray of shape (3, b)
    corners : ndarray of shape (3, 4, b)
    in_plane : float
        Distance from the polygon's plane that counts as none, relative to the polygon's size.

    Returns
    -------
    ndarray of shape (b,)
        Form factors.
    """
    x, n, corners = x.astype(float), n.astype(float), corners.astype(float)
    factors = np.zeros(x.shape[1])
    seen, x = _lift_off_plane(x, n, corners, in_plane)
    x, n, corners = x[:, seen], n[:, seen], corners[:, :, seen]
    factors[seen] = _above_horizon(n, corners - x[:, None])
    return np.clip(factors, 0, 1)


def _above_horizon(n: Floats, corners: Floats) -> Floats:
    """Return Lambert's sums of polygons seen from the origin, shape (3, 4, b), for what is above the horizon.

    Two opposite corners of a quadrilateral that is not quite flat may be above and the others below: rounding does so
    to coplanar ones. That is two pieces, and no single line closes them: such are taken as two triangles.
    """
    above = dot(n[:, None], corners) >= 0
    split = np.flatnonzero((above != above[[1, 2, 3, 0]]).all(axis=0))
    factors = _clipped_sums(n, corners)
    if len(split):
        n, corners = n[:, split], corners[:, :, split]
        factors[split] = sum(_clipped_sums(n, corners[:, half]) for half in ([0, 1, 2, 2], [2, 3, 0, 0]))
    return factors


def _clipped_sums(n: Floats, corners: Floats) -> Floats:
    """Return Lambert's sums of polygons that cross the horizon twice at most, otherwise as `_above_horizon`."""
    start, end, kept = _clip_at_horizon(n, corners)
    normal = cross(end, start)
    sine = np.sqrt(dot(normal, normal))
    angle = np.where(kept, np.arctan2(sine, dot(start, end)), 0)
    terms = dot(n[:, None], normal) * angle / np.maximum(sine, TINY)
    sums: Floats = terms.sum(axis=0) / (2 * np.pi)
    return sums


def _clip_at_horizon(n: Floats, a: Floats) -> tuple[Floats, Floats, BoolArray]:
    """Return the edges of polygons clipped at the horizon: starts and ends of shape (3, 5, b), and which there are."""
    b = a[:, [1, 2, 3, 0]]
    height_a = dot(n[:, None], a)
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


def _lift_off_plane(x: Floats, n: Floats, corners: Floats, in_plane: float) -> tuple[BoolArray, Floats]:
    """Return which points see the polygon's front, and the points with those in its plane lifted off it a little."""
    diagonal, other = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    plane = cross(diagonal, other)
    plane = plane / np.maximum(np.sqrt(dot(plane, plane)), TINY)
    # The mid-plane of a quadrilateral that is not quite flat.
    distance = dot(plane, x - (corners[:, 0] + corners[:, 1]) / 2)
    near = in_plane * np.sqrt(np.maximum(dot(diagonal, diagonal), dot(other, other)))
    lying = np.abs(distance) < near
    back_to_back = lying & (dot(n, plane) < -1 + 1e-9)
    return (distance > -near) & ~back_to_back, x + np.where(lying, near - distance, 0) * plane


def dot(a: Floats, b: Floats) -> Floats:
    """Return dot products over the first axis."""
    product = a * b
    total = product[0] + product[1]
    total += product[2]
    return np.asarray(total)


def cross(a: Floats, b: Floats) -> Floats:
    """Return cross products over the first axis."""
    return np.asarray(np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])))
