# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light patches exchange: blocks of the symmetric matrix A_i F_ij, visibility included.

Both centre-to-centre factors (T2) and factors between areas (T3) are computed for two compact groups of patches at a
time, so that every step is arithmetic on small dense blocks and visibility is decided for whole blocks (`shafts`):

- far pairs: the mean of the kernel cos cos / (pi r^2) over eight pairs of points, exact to the third order; each pair
  of points is tested for visibility by itself, so that what is near and what is visible are integrated together;
- pairs closer than `NEAR` times their radii: Lambert's exact factor from points of the smaller patch to the whole of
  the larger one, times the visible share;
- pairs that much light goes between, where something could stand in the way: the visible share of many segments.

A F is symmetric by reciprocity, so every pair of groups is computed once.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .form_factors import point_to_polygon
from .meshing import Patches
from .quadrature import gauss_points, spread_points, surface_points, turned_points
from .shadows import hidden, hidden_pairs
from .shafts import Blockers, as_blockers, between, compact_groups
from .surfaces import Occluding
from .visibility import Occluders

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
AnyFloat = TypeVar("AnyFloat", FloatArray, SingleArray)

# Centre distance over the sum of both radii below which eight pairs of points are not enough, and patches may touch.
NEAR, TOUCHING = 3.0, 1.1
# Points along each side of the receiver for the exact factor of near and of touching pairs.
NEAR_ORDER, TOUCHING_ORDER = 3, 8
# With more blockers than this in a shaft, rays are cheaper than testing each.
FEW = 200
# A pair with a larger factor than this, either way, may count on more looks: so many segments decide what it sees.
LARGE, LOOKS = 0.01, 128
# Heights above a plane up to this share of the scene's size are single precision's rounding.
ROUNDING = 2e-7

# Which of the four points round either patch meet: half of all sixteen pairs, those of unlike parity, by which every
# product of up to three coordinates is still averaged exactly (a fractional factorial design of resolution IV). The
# same pairs meet whichever patch comes first.
OF_I = np.array([0, 0, 1, 1, 2, 2, 3, 3])
OF_J = np.array([1, 3, 0, 2, 1, 3, 0, 2])


@dataclass(frozen=True, eq=False)
class Exchange:
    """All that a block of A F is computed from.

    Attributes
    ----------
    patches : Patches
    points : ndarray of shape (n, q, 3)
        What stands for each patch [m]: its centre, or four points round it.
    weights : ndarray of shape (n, q)
        Area that each point stands for [m^2].
    of_i, of_j : ndarray of shape (s,)
        Which points of two patches meet.
    radius : ndarray of shape (n,)
        Distance from a patch's centre to its farthest corner [m].
    near : float
        Pairs closer than this times their radii get the exact factor; 0 for none.
    occluders : Occluders or None
        Who casts rays; None when nothing blocks.
    blockers : Blockers or None
        The surfaces that block, where known.
    groups : list of ndarray
        Patches that are close together and look the same way.
    size : float
        The scene's diagonal [m].
    """

    patches: Patches
    points: FloatArray
    weights: FloatArray
    of_i: IntArray
    of_j: IntArray
    radius: FloatArray
    near: float
    occluders: Occluders | None
    blockers: Blockers | None
    groups: list[IntArray]
    size: float


def exchange(
    patches: Patches, occluders: Occluders | None, surfaces: Occluding | None, *, exact: bool = True
) -> Exchange:
    """Prepare to compute who lights whom.

    Parameters
    ----------
    patches : Patches
    occluders : Occluders or None
        Who casts rays; None when nothing blocks.
    surfaces : Occluding or None
        The same surfaces as triangles, which save most of the rays; None when they are not known.
    exact : bool
        Factors between areas (T3); else between centres (T2), one ray a pair (T14).

    Returns
    -------
    Exchange
    """
    points, share = patches.centre[:, None], np.ones((len(patches.area), 1))
    if exact:
        points, share = turned_points(patches.corners)
    reach = np.linalg.norm(patches.corners - patches.centre[:, None], axis=2).max(axis=1, initial=0.0)
    span = np.ptp(patches.corners.reshape(-1, 3), axis=0) if len(reach) else np.zeros(3)
    return Exchange(
        patches=patches,
        points=points,
        weights=share * patches.area[:, None],
        of_i=OF_I if exact else np.zeros(1, dtype=np.int64),
        of_j=OF_J if exact else np.zeros(1, dtype=np.int64),
        radius=reach,
        near=NEAR if exact else 0.0,
        occluders=occluders,
        blockers=None if surfaces is None or occluders is None else as_blockers(surfaces),
        groups=compact_groups(patches.centre, patches.normal),
        size=float(np.linalg.norm(span)) or 1.0,
    )


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
    share, segments = _visible_share(x, i, j, kernel, whole, close)
    return np.asarray(whole * share), segments


def _visible_share(
    x: Exchange, i: IntArray, j: IntArray, kernel: SingleArray, whole: FloatArray, close: BoolArray
) -> tuple[FloatArray, int]:
    """Return the visible share of all pairs, shape (m, k), and how many segments were tested for it.

    `kernel` is used up.
    """
    if x.occluders is None:
        return np.ones_like(whole), 0
    blockers = x.blockers
    if blockers is None:
        return _share_by_rays(x, x.occluders, i, j, kernel, close)
    inside = between(_cloud(x, i), _cloud(x, j), blockers)
    if not len(inside):
        return np.ones_like(whole), 0
    if len(inside) > FEW:
        return _share_by_rays(x, x.occluders, i, j, kernel, close)
    total = kernel.sum(axis=0)
    kernel[hidden(blockers, inside, _meeting(x, i, x.of_i), _meeting(x, j, x.of_j))] = 0.0
    share = kernel.sum(axis=0, dtype=np.float64) / np.where(total > 0.0, total, 1.0)
    area = np.minimum(x.patches.area[i][:, None], x.patches.area[j])
    rows, columns = np.nonzero(((whole > LARGE * area) & (x.near > 0.0)) | (close & (total == 0.0)))
    share[rows, columns] = _look_again(
        x, lambda p, q: hidden_pairs(blockers, inside, p, q), i[rows], j[columns]
    )
    return share, kernel.size + LOOKS * len(rows)


def _kernel(x: Exchange, i: IntArray, j: IntArray) -> SingleArray | None:
    """Return cos cos / r^2 times both areas for each pair of points, shape (s, m, k).

    Lengths are shares of the scene's size and places are taken from the middle of the block, so that single precision
    is enough.
    """
    origin = x.patches.centre[i].mean(axis=0)
    p, q = (((_meeting(x, *of) - origin) / x.size).astype(np.float32) for of in ((i, x.of_i), (j, x.of_j)))
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


def _look_again(
    x: Exchange, blocked: Callable[[FloatArray, FloatArray], BoolArray], i: IntArray, j: IntArray
) -> FloatArray:
    """Return the visible share of pairs of patches, shape (p,), weighted by how much light goes each way."""
    # The places do not know which patch comes first, the result must not either.
    i, j = np.minimum(i, j), np.maximum(i, j)
    share = np.zeros(len(i))
    places = spread_points(LOOKS, 4)
    normal, corners = x.patches.normal, x.patches.corners
    for first in range(0, len(i), 256):
        of_i, of_j = i[first : first + 256], j[first : first + 256]
        p, stretch_i = surface_points(corners[of_i], places[0], places[1])
        q, stretch_j = surface_points(corners[of_j], places[2], places[3])
        way = q - p
        weight = np.maximum((normal[of_i][:, None] * way).sum(axis=2), 0.0)
        weight *= np.maximum(-(normal[of_j][:, None] * way).sum(axis=2), 0.0)
        weight *= stretch_i * stretch_j / np.maximum(np.square(way).sum(axis=2), (ROUNDING * x.size) ** 2) ** 2
        total = weight.sum(axis=1)
        sent = weight > 0.0
        weight[sent] *= ~blocked(p[sent], q[sent])
        share[first : first + 256] = weight.sum(axis=1) / np.where(total > 0.0, total, 1.0)
    return share


def _share_by_rays(
    x: Exchange, occluders: Occluders, i: IntArray, j: IntArray, kernel: SingleArray, close: BoolArray
) -> tuple[FloatArray, int]:
    """Return the visible share of pairs that face each other by rays, several for close pairs and lamps, else one."""
    facing, lamp = kernel > 0.0, (x.patches.emission > 0.0).any(axis=1)
    several = close | lamp[i][:, None] | lamp[j] | ~facing.all(axis=0)
    # Neighbouring pairs take different points, so that their errors even out and no bands show.
    turn = (i[:, None] + j) % len(x.of_i)
    seen, total, segments = np.zeros(close.shape), np.zeros(close.shape), 0
    for s, (a, b) in enumerate(zip(x.of_i, x.of_j, strict=True)):
        rows, columns = np.nonzero(facing[s] & (several | (turn == s)))
        weight = kernel[s, rows, columns]
        total[rows, columns] += weight
        seen[rows, columns] += weight * ~occluders.blocked(x.points[i[rows], a], x.points[j[columns], b])
        segments += len(rows)
    share = seen / np.where(total > 0.0, total, 1.0)
    rows, columns = np.nonzero(close & (total == 0.0))
    share[rows, columns] = _look_again(x, occluders.blocked, i[rows], j[columns])
    return share, segments + LOOKS * len(rows)


def _meeting(x: Exchange, members: IntArray, which: IntArray) -> FloatArray:
    """Return the points of patches that meet, shape (s, m, 3) [m]."""
    return x.points[members].transpose(1, 0, 2)[which]


def _cloud(x: Exchange, members: IntArray) -> FloatArray:
    """Return the corners of patches as one list of points, shape (4 m, 3) [m]."""
    return x.patches.corners[members].reshape(-1, 3)
