# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of each other two groups of patches see, by the cheapest way that is good enough.

Nothing in the shaft between them: all. A few flat blockers in it: each pair of points by the test of `shadows`, and for
pairs that much light goes between, many more segments than those. Many blockers, or panes that dim light: rays.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray, SingleArray
from ..sequences import spread_points
from ..visibility import Occluders, dimmed, panes_of
from .exchange import ROUNDING, Exchange, meeting
from .quadrature import surface_points
from .shadows import hidden, hidden_pairs
from .shafts import between

# With more blockers than this in a shaft, rays are cheaper than testing each.
FEW = 200
# A pair with a larger factor than this, either way, may count on more looks: so many segments decide what it sees.
LARGE, LOOKS = 0.01, 128
# Pairs that are looked at again at a time.
BATCH = 256


def visible_share(
    x: Exchange, i: IntArray, j: IntArray, kernel: SingleArray, whole: FloatArray, close: BoolArray
) -> tuple[FloatArray, int]:
    """Find out how much pairs of patches see of each other.

    Parameters
    ----------
    x : Exchange
    i, j : ndarray of shape (m,), (k,)
        Two groups of patches.
    kernel : ndarray of shape (s, m, k)
        What would pass between each pair of points; it is used up.
    whole : ndarray of shape (m, k)
        A_i F_ij as if nothing stood between them [m^2].
    close : ndarray of shape (m, k)
        Which pairs are near each other for their size.

    Returns
    -------
    share : ndarray of shape (m, k)
        Visible part of what would pass, 0 to 1.
    segments : int
        How many were tested.
    """
    if x.occluders is None:
        return np.ones_like(whole), 0
    blockers = x.blockers
    if blockers is None or panes_of(x.occluders) is not None:
        return _share_by_rays(x, x.occluders, i, j, kernel, close)
    inside = between(_cloud(x, i), _cloud(x, j), blockers)
    if not len(inside):
        return np.ones_like(whole), 0
    if len(inside) > FEW:
        return _share_by_rays(x, x.occluders, i, j, kernel, close)
    total = kernel.sum(axis=0)
    kernel[hidden(blockers, inside, meeting(x, i, x.of_i), meeting(x, j, x.of_j))] = 0.0
    share = kernel.sum(axis=0, dtype=np.float64) / np.where(total > 0.0, total, 1.0)
    area = np.minimum(x.patches.area[i][:, None], x.patches.area[j])
    rows, columns = np.nonzero(((whole > LARGE * area) & (x.near > 0.0)) | (close & (total == 0.0)))
    share[rows, columns] = _look_again(x, partial(hidden_pairs, blockers, inside), i[rows], j[columns])
    return share, kernel.size + LOOKS * len(rows)


def _look_again(
    x: Exchange, blocked: Callable[[FloatArray, FloatArray], BoolArray], i: IntArray, j: IntArray
) -> FloatArray:
    """Return the visible share of pairs of patches, shape (p,), weighted by how much light goes each way."""
    # The places do not know which patch comes first, the result must not either.
    i, j = np.minimum(i, j), np.maximum(i, j)
    share = np.zeros(len(i))
    places = spread_points(LOOKS, 4) if len(i) else np.zeros((4, 0))
    normal, corners = x.patches.normal, x.patches.corners
    for first in range(0, len(i), BATCH):
        of_i, of_j = i[first : first + BATCH], j[first : first + BATCH]
        p, stretch_i = surface_points(corners[of_i], places[0], places[1])
        q, stretch_j = surface_points(corners[of_j], places[2], places[3])
        way = q - p
        weight = np.maximum((normal[of_i][:, None] * way).sum(axis=2), 0.0)
        weight *= np.maximum(-(normal[of_j][:, None] * way).sum(axis=2), 0.0)
        weight *= stretch_i * stretch_j / np.maximum(np.square(way).sum(axis=2), (ROUNDING * x.size) ** 2) ** 2
        total = weight.sum(axis=1)
        sent = weight > 0.0
        weight[sent] *= ~blocked(p[sent], q[sent])
        share[first : first + BATCH] = weight.sum(axis=1) / np.where(total > 0.0, total, 1.0)
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
        start, end = x.points[i[rows], a], x.points[j[columns], b]
        clear = ~occluders.blocked(start, end)
        seen[rows, columns] += weight * clear * dimmed(start, end, clear, occluders)[0]
        segments += len(rows)
    share = seen / np.where(total > 0.0, total, 1.0)
    rows, columns = np.nonzero(close & (total == 0.0))
    share[rows, columns] = _look_again(x, occluders.blocked, i[rows], j[columns])
    return share, segments + LOOKS * len(rows)


def _cloud(x: Exchange, members: IntArray) -> FloatArray:
    """Return the corners of patches as one list of points, shape (4 m, 3) [m]."""
    return x.patches.corners[members].reshape(-1, 3)
