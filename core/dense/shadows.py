# SPDX-License-Identifier: GPL-3.0-or-later
"""Which segments between two sets of points a few flat blockers stop, without casting rays.

A segment crosses a blocker's plane when its ends lie on different sides of it. With the distances h of both ends from
that plane and a from one of the planes that stand on its edges, the crossing lies inside that edge when
a_i |h_j| + a_j |h_i| >= 0: a product of matrices two wide, for all segments at once.
"""

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from .shafts import Blockers

# Neighbouring blockers overlap by this share of their distance, so that no light leaks through the seam.
SEAM = 1e-6


def hidden(blockers: Blockers, which: IntArray, points_i: FloatArray, points_j: FloatArray) -> BoolArray:
    """Return which segments are blocked.

    Parameters
    ----------
    blockers : Blockers
    which : ndarray of shape (t,)
        Those of them that could be in the way.
    points_i, points_j : ndarray of shape (s, m, 3), (s, k, 3)
        s times a set of m and one of k points [m].

    Returns
    -------
    ndarray of shape (s, m, k)
        Ends closer to a blocker's plane than its margin lie on it, and are not hidden by it.
    """
    result = np.zeros((*points_i.shape[:2], points_j.shape[1]), dtype=bool)
    for index in which:
        margin = blockers.margin[index]
        at_i, at_j = _distances(blockers, index, points_i), _distances(blockers, index, points_j)
        up_i, up_j, down_i, down_j = at_i[0] > margin, at_j[0] > margin, at_i[0] < -margin, at_j[0] < -margin
        crossing = (up_i[:, :, None] & down_j[:, None]) | (down_i[:, :, None] & up_j[:, None])
        # Relative to the larger distance, single precision is enough.
        size = max(np.abs(at_i).max(), np.abs(at_j).max())
        at_i, at_j = (at_i / size).astype(np.float32), (at_j / size).astype(np.float32)
        left = np.stack((at_i[1:], np.broadcast_to(np.abs(at_i[0]), at_i[1:].shape)), axis=3)
        right = np.stack((np.broadcast_to(np.abs(at_j[0]), at_j[1:].shape), at_j[1:]), axis=2)
        for edge in range(len(left)):
            crossing &= (left[edge] @ right[edge]) >= -SEAM
        result |= crossing
    return result


def hidden_pairs(blockers: Blockers, which: IntArray, starts: FloatArray, ends: FloatArray) -> BoolArray:
    """Return which segments are blocked, each from one point to one other.

    Parameters
    ----------
    blockers : Blockers
    which : ndarray of shape (t,)
        Those of them that could be in the way.
    starts, ends : ndarray of shape (..., 3)
        [m].

    Returns
    -------
    ndarray of shape (...,)
        As `hidden`.
    """
    result = np.zeros(starts.shape[:-1], dtype=bool)
    for index in which:
        margin = blockers.margin[index]
        at_start, at_end = _distances(blockers, index, starts), _distances(blockers, index, ends)
        h, g = at_start[0], at_end[0]
        crossing = ((h > margin) & (g < -margin)) | ((h < -margin) & (g > margin))
        size = max(np.abs(at_start).max(), np.abs(at_end).max()) ** 2
        crossing &= (at_start[1:] * np.abs(g) + at_end[1:] * np.abs(h)).min(axis=0) >= -SEAM * size
        result |= crossing
    return result


def _distances(blockers: Blockers, index: int, points: FloatArray) -> FloatArray:
    """Return the distances of points (..., 3) from plane and edges of one blocker, shape (1 + edges, ...) [m]."""
    planes = blockers.planes[index, : 1 + blockers.edges[index]]
    flat = points.reshape(-1, 3) @ planes[:, :3].T + planes[:, 3]
    return np.ascontiguousarray(flat.T).reshape(-1, *points.shape[:-1])
