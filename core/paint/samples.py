# SPDX-License-Identifier: GPL-3.0-or-later
"""Points at which surfaces are looked at: spread over the triangles that faces are cut into.

Each triangle is cut into n x n cells, and each cell has three points, whose mean is exact for whatever is no more
curved than a parabola.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray, IntArray

# Where a cell's three points are, as shares of its corners.
_PLACES = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]) / 6.0


@dataclass(frozen=True, eq=False)
class PaintSamples:
    """Points on faces.

    Attributes
    ----------
    triangle : ndarray of shape (s,)
        The triangle that each of s points is on; three points a cell follow each other.
    share : ndarray of shape (s, 3)
        Its place between the corners of the triangle.
    parts : ndarray of shape (t,)
        Cells along the edges of each triangle.
    """

    triangle: IntArray
    share: FloatArray
    parts: IntArray

    def weights(self, area: FloatArray) -> FloatArray:
        """Return the area that each point stands for, given those of the triangles, shape (s,)."""
        # A mesh of lines still has values.
        share = np.maximum(area, 1e-30) / np.maximum(3 * self.parts**2, 1)
        return np.asarray(share[self.triangle])

    def take(self, index: slice) -> "PaintSamples":
        """Return some of the points, whole cells of them."""
        return PaintSamples(self.triangle[index], self.share[index], self.parts)


def paint_samples(parts: IntArray) -> PaintSamples:
    """Spread points over triangles.

    Parameters
    ----------
    parts : ndarray of shape (t,)
        Cells along the edges of each triangle, 1 or more; 0 for no points.

    Returns
    -------
    PaintSamples
        3 n^2 of them on a triangle with n parts, in the order of the triangles.
    """
    triangles, shares = [], []
    for count in np.unique(parts[parts > 0]):
        which = np.flatnonzero(parts == count)
        pattern = _pattern(int(count))
        triangles.append(np.repeat(which, len(pattern)))
        shares.append(np.tile(pattern, (len(which), 1)))
    triangle = np.concatenate([*triangles, np.zeros(0, np.int64)])
    order = np.argsort(triangle, kind="stable")
    return PaintSamples(triangle[order], np.concatenate([*shares, np.zeros((0, 3))])[order], parts)


def _pattern(count: int) -> FloatArray:
    """Return the points of one triangle with `count` parts, shape (3 count^2, 3)."""
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(count), np.arange(count)))
    upright = i + j < count
    turned = i + j < count - 1
    up = np.stack([i, j], axis=1)[upright]
    down = np.stack([i, j], axis=1)[turned]
    corners = np.concatenate(
        [
            np.stack([up, up + (1, 0), up + (0, 1)], axis=1),
            np.stack([down + (1, 1), down + (0, 1), down + (1, 0)], axis=1),
        ]
    )
    second_third = (_PLACES @ corners / count).reshape(-1, 2)
    return np.column_stack([1.0 - second_third.sum(axis=1), second_third])
