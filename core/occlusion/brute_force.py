# SPDX-License-Identifier: GPL-3.0-or-later
"""Every segment against every triangle: the oracle that all other occluders are tested against."""

from collections.abc import Iterator

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from .surfaces import GROWTH, MARGIN, Occluding

# Pairs of segment and triangle that are looked at together.
_PAIRS = 200_000


class BruteForceOccluders:
    """Every segment against every triangle, in double precision: slow, plain, what the others are tested against.

    Parameters
    ----------
    occluding : Occluding
        Surfaces that block.
    margin, growth : float
        How near to a plane an end lies in it, and how far surfaces reach over their edges [share of the diagonal].
    """

    def __init__(self, occluding: Occluding, *, margin: float = MARGIN, growth: float = GROWTH) -> None:
        self._face = occluding.triangle_face
        self._margin = margin * occluding.diagonal + np.broadcast_to(occluding.slack, len(self._face))
        self._margin = self._margin + margin * occluding.diagonal * occluding.core.away(
            occluding.vertices[occluding.triangles]
        )
        self._growth = growth * occluding.diagonal
        self._corners = occluding.vertices[occluding.triangles]
        a, b, c = (self._corners[:, k] for k in range(3))
        normal = np.cross(b - a, c - a)
        self._normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def blocked(self, origins: FloatArray, targets: FloatArray) -> BoolArray:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        result = np.zeros(len(origins), dtype=bool)
        for part in self._parts(len(origins)):
            along = targets[part] - origins[part]
            crossing, rise = self._crossings(origins[part], along)
            # The other end has to be clear of the plane as well.
            hit = np.isfinite(crossing)
            beyond = (1.0 - np.where(hit, crossing, 1.0)) * np.abs(rise) > self._margin
            result[part] = (hit & beyond).any(axis=1)
        return result

    def nearest(self, origins: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return what rays hit first.

        Parameters
        ----------
        origins, directions : ndarray of shape (m, 3)
            A surface in whose plane a ray starts is not hit [m]; directions of any length but zero.

        Returns
        -------
        face : ndarray of shape (m,)
            Face of the scene, or one of those that were joined with it; -1 for none.
        distance : ndarray of shape (m,)
            Infinite for none [m].
        front : ndarray of shape (m,)
            Whether the front of the face was hit. Where a ray leaves a body right where it enters another one, it is
            the back of what it leaves.
        """
        face, distance = np.full(len(origins), -1), np.full(len(origins), np.inf)
        front = np.zeros(len(origins), dtype=bool)
        for part in self._parts(len(origins)):
            way = directions[part] / np.linalg.norm(directions[part], axis=1, keepdims=True)
            crossing, rise = self._crossings(origins[part], way)
            # Where a ray leaves a body right where it enters another one, what it leaves is first.
            tied = crossing - np.where(rise > 0, 2.0 * self._margin, 0.0)
            first = tied.argmin(axis=1)
            row = np.arange(len(first))
            distance[part] = crossing[row, first]
            hit = np.isfinite(distance[part])
            face[part] = np.where(hit, self._face[first], -1)
            front[part] = hit & (rise[row, first] < 0)
        return face, distance, front

    def any_nearest(self, origins: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return the same; of several faces at one place it may be any of them."""
        return self.nearest(origins, directions)

    def _parts(self, count: int) -> Iterator[slice]:
        """Yield the segments in parts; none when there is nothing to hit."""
        if len(self._face):
            step = max(1, _PAIRS // len(self._face))
            for first in range(0, count, step):
                yield slice(first, first + step)

    def _crossings(self, origins: FloatArray, along: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where rays cross triangles, in lengths of `along`, and how fast they rise over them, shape (m, t).

        Infinite where they do not, or start in the triangle's plane.
        """
        arm = origins[:, None] - self._corners[:, 0]
        height, rise = (arm * self._normal).sum(axis=2), along @ self._normal.T
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = -height / rise
            hit = (np.abs(height) > self._margin) & (crossing > 0) & np.isfinite(crossing)
            arm += np.where(hit, crossing, 0.0)[:, :, None] * along[:, None]
        for side in range(3):
            edge = self._corners[:, (side + 1) % 3] - self._corners[:, side]
            inward = np.cross(self._normal, edge / np.linalg.norm(edge, axis=1, keepdims=True))
            start = (inward * (self._corners[:, side] - self._corners[:, 0])).sum(axis=1)
            hit &= (arm * inward).sum(axis=2) >= start - self._growth
        return np.where(hit, crossing, np.inf), rise
