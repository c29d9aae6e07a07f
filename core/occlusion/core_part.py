# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part of a scene tolerances are measured by: a room, and not the dome of a sky or the land around it.

How near is on a surface, and how fine is fine enough, are shares of a size. Where a few things are very much larger
than all others together, the size of the others is what counts there; far from them it is the distance to them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray

Blocked = Callable[[FloatArray, FloatArray], BoolArray]

# The whole is at least so many times as large as a part that is looked at by itself ...
_LARGER = 100.0
# ... and the next larger face makes that part so many times as large at once.
_JUMP = 8.0
# ... and that is a thing of some faces, and the next one no small face far away: a blade of grass that stands apart
# from all others is not where a scene is.
_SOME, _FAR = 4, 32.0
# Half the edge of the cube around that part, in its diagonals; no round number, for fear of walls in its faces' planes.
_AROUND = 1.0437


@dataclass(frozen=True, eq=False)
class CorePart:
    """Where most of a scene is.

    Attributes
    ----------
    centre : ndarray of shape (3,)
        Of its bounding box [m].
    size : float
        Diagonal of that [m]; 1 when there is nothing.
    whole : bool
        Whether all of the scene is in that box.
    """

    centre: FloatArray
    size: float
    whole: bool

    def away(self, corners: FloatArray) -> FloatArray:
        """Return how far outside polygons are, shape (n,) [sizes]; 0 for what comes as near as one size.

        Parameters
        ----------
        corners : ndarray of shape (n, k, 3)
            [m].
        """
        if self.whole:
            return np.zeros(len(corners))
        low, high = (corners.min(axis=1) - self.centre) / self.size, (corners.max(axis=1) - self.centre) / self.size
        gap = np.maximum(np.maximum(low, -high), 0.0)
        return np.asarray(np.maximum(np.sqrt((gap * gap).sum(axis=1)) - 1.0, 0.0))

    def local(self, points: FloatArray) -> FloatArray:
        """Return points as single precision wants them: around the origin, in sizes."""
        return np.asarray((points - self.centre) / self.size)

    def piecewise(self, origins: FloatArray, targets: FloatArray, blocked: Blocked) -> BoolArray:
        """Return which segments are blocked, asked in pieces that have one scale each.

        Parameters
        ----------
        origins, targets : ndarray of shape (m, 3)
            [m].
        blocked : callable
            Takes origins and targets, and returns which of those segments are blocked.

        Returns
        -------
        ndarray of shape (m,)
        """
        if self.whole:
            return blocked(origins, targets)
        # Single precision is as fine as what is far away is far.
        begin, end, owner = self.cut(origins, targets)
        result = np.zeros(len(origins), dtype=bool)
        result[owner[blocked(begin, end)]] = True
        return result

    def cut(self, origins: FloatArray, targets: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
        """Cut segments where they enter and leave a cube around this part, so that each piece has one scale.

        Parameters
        ----------
        origins, targets : ndarray of shape (m, 3)
            [m].

        Returns
        -------
        origins, targets : ndarray of shape (n, 3)
            Of the pieces [m].
        owner : ndarray of shape (n,)
            The segment that each is a piece of.
        """
        everything = np.arange(len(origins))
        if self.whole:
            return origins, targets, everything
        half = _AROUND * self.size
        along = targets - origins
        outside = (np.maximum(np.abs(origins - self.centre), np.abs(targets - self.centre)) > half).any(axis=1)
        some = np.flatnonzero(outside)
        with np.errstate(divide="ignore", invalid="ignore"):
            one = (self.centre - half - origins[some]) / along[some]
            other = (self.centre + half - origins[some]) / along[some]
        # What runs along a face of the cube divides nothing by nothing: it is in between all the way.
        near = np.nan_to_num(np.minimum(one, other), nan=-np.inf, posinf=np.inf, neginf=-np.inf).max(axis=1)
        far = np.nan_to_num(np.maximum(one, other), nan=np.inf, posinf=np.inf, neginf=-np.inf).min(axis=1)
        near, far = np.maximum(near, 0.0), np.minimum(far, 1.0)
        meets = near < far
        some, near, far = some[meets], near[meets, None], far[meets, None]
        enters = origins[some] + near * along[some]
        leaves = np.where(far < 1.0, origins[some] + far * along[some], targets[some])
        rest = np.ones(len(origins), dtype=bool)
        rest[some] = False
        before, after = near[:, 0] > 0.0, far[:, 0] < 1.0
        return (
            np.concatenate([origins[rest], origins[some][before], enters, leaves[after]]),
            np.concatenate([targets[rest], enters[before], leaves, targets[some][after]]),
            np.concatenate([everything[rest], some[before], some, some[after]]),
        )


def core_part(low: FloatArray, high: FloatArray) -> CorePart:
    """Find where most of a scene is.

    Parameters
    ----------
    low, high : ndarray of shape (n, 3)
        Boxes of its faces [m].

    Returns
    -------
    CorePart
        The whole of it, unless a few faces are far larger than all smaller ones together.
    """
    if len(low) == 0:
        return CorePart(np.zeros(3), 1.0, True)
    extent = np.sqrt(((high - low) ** 2).sum(axis=1))
    order = np.argsort(extent, kind="stable")
    least, most = np.minimum.accumulate(low[order], axis=0), np.maximum.accumulate(high[order], axis=0)
    size = np.sqrt(((most - least) ** 2).sum(axis=1))
    next_size, next_extent = size[1:], extent[order][1:]
    part = size[:-1]
    apart = (part > 0) & (next_size >= _JUMP * part) & (next_extent >= part) & (size[-1] >= _LARGER * part)
    apart &= (np.arange(1, len(low)) >= _SOME) & (_FAR * next_extent >= next_size)
    last = int(np.flatnonzero(apart)[-1]) if apart.any() else len(low) - 1
    return CorePart(0.5 * (least[last] + most[last]), float(size[last]) or 1.0, last == len(low) - 1)
