# SPDX-License-Identifier: GPL-3.0-or-later
"""The hemicube: half a cube of pixels about a point, onto which all polygons are projected (T4).

Every pixel has a delta form factor, kept in a table; a polygon's form factor is the sum over the pixels in which it is
the nearest. Projection, clipping at the horizon and visibility are one and the same step.

References
----------
M. F. Cohen, D. P. Greenberg, The hemi-cube: a radiosity solution for complex environments, SIGGRAPH 1985.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .errors import RadiosityError
from .exact.convex_parts import plane_axes
from .form_factors import points_to_polygons
from .lambert import cross
from .runs import counted

# Right, up and forward of the five faces, in a frame whose third axis is the normal; side faces are their upper half.
FACES = np.array(
    [
        [(1, 0, 0), (0, 1, 0), (0, 0, 1)],
        [(0, 1, 0), (0, 0, 1), (1, 0, 0)],
        [(0, -1, 0), (0, 0, 1), (-1, 0, 0)],
        [(-1, 0, 0), (0, 0, 1), (0, 1, 0)],
        [(1, 0, 0), (0, 0, 1), (0, -1, 0)],
    ],
    dtype=float,
)
# A point this close to a polygon's plane, relative to the polygon's size, sees nothing of it.
IN_PLANE = 1e-6
# A pixel's centre this close to an edge, relative to the edge's size in pixels, is covered: no cracks between polygons.
ON_EDGE = 1e-9


@dataclass(frozen=True)
class Hemicube:
    """A hemicube of given resolution.

    Attributes
    ----------
    resolution : int
        Pixels along each edge of the top face, even; the sides are half as high: 3 * resolution**2 pixels in all.
    """

    resolution: int = 128

    def __post_init__(self) -> None:
        """Check the resolution."""
        if self.resolution < 2 or self.resolution % 2:
            raise RadiosityError(f"A hemicube's resolution is an even number of pixels, not {self.resolution}.")

    @cached_property
    def deltas(self) -> FloatArray:
        """Return the delta form factors, shape (3 * resolution**2,): the top face by rows, then the sides.

        Each is the exact factor of the pixel's square; the literature's cos cos dA / (pi r^2) takes it at the centre.
        They sum to 1.
        """
        half = 1 / self.resolution
        # Seen from the point, rows run right and columns up: clockwise from the square's other side.
        ring = half * np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)])
        squares = [np.insert(self._centres(face)[:, None] + ring, 2, 1.0, axis=2) @ FACES[face] for face in range(2)]
        origin, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
        top, side = (points_to_polygons(origin, up, square)[0] for square in squares)
        return np.concatenate((top, *4 * [side]))

    def factors(self, point: FloatArray, normal: FloatArray, polygons: FloatArray) -> FloatArray:
        """Return the form factors from a point to polygons that also hide each other.

        Parameters
        ----------
        point, normal : ndarray of shape (3,)
            Where the hemicube stands [m] and its unit normal.
        polygons : ndarray of shape (n, 4, 3)
            Convex quadrilaterals [m], counter-clockwise seen from their radiating side; a triangle repeats its last
            corner. They radiate on that side only and hide what is behind them on both.

        Returns
        -------
        ndarray of shape (n,)
            Dimensionless.
        """
        polygon, front = self.seen(point, normal, polygons)
        return np.bincount(polygon[front], self.deltas[front], minlength=len(polygons)).astype(float)

    def seen(self, point: FloatArray, normal: FloatArray, polygons: FloatArray) -> tuple[IntArray, BoolArray]:
        """Return which polygon is the nearest in every pixel, in the order of `deltas`.

        Parameters
        ----------
        point, normal, polygons
            See `factors`.

        Returns
        -------
        polygon : ndarray of shape (3 * resolution**2,)
            Index; -1 where there is none.
        front : ndarray of shape (3 * resolution**2,)
            Whether it shows its radiating side.
        """
        frame = np.vstack((plane_axes(normal), normal))
        corners = np.ascontiguousarray(((polygons - point) @ frame.T).transpose(2, 1, 0))
        diagonals = np.asarray(cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), float)
        area2 = np.sqrt((diagonals**2).sum(axis=0))
        # Distance of each polygon's plane from the point, negative when the point is in front.
        offset = (diagonals * (corners[:, 0] + corners[:, 1]) / 2).sum(axis=0) / np.maximum(area2, 1e-300)
        shown = (np.abs(offset) > IN_PLANE * np.sqrt(area2)) & (corners[2].max(axis=0) > 0)
        some = np.flatnonzero(shown)
        corners, offset = corners[:, :, some], offset[some]
        # Planes through the point and each edge, positive towards the polygon's inside.
        edges = np.asarray(cross(corners, np.roll(corners, -1, axis=1)), float) * np.sign(offset)
        nearness = diagonals[:, some] / (area2[some] * offset)
        owners = [self._rasterised(face, corners, edges, nearness) for face in range(len(FACES))]
        owner = np.concatenate(owners)
        hit = owner >= 0
        polygon, front = np.full(len(owner), -1), np.zeros(len(owner), dtype=bool)
        polygon[hit], front[hit] = some[owner[hit]], offset[owner[hit]] < 0
        return polygon, front

    def _centres(self, face: int) -> FloatArray:
        """Return the pixels' centres on a face at distance 1, rows first, shape (p, 2)."""
        across = (np.arange(self.resolution) + 0.5) * 2 / self.resolution - 1
        upward = across if face == 0 else across[self.resolution // 2 :]
        return np.stack((np.tile(across, len(upward)), np.repeat(upward, len(across))), axis=1)

    def _rasterised(self, face: int, corners: FloatArray, edges: FloatArray, nearness: FloatArray) -> IntArray:
        """Return the nearest of m polygons in every pixel of a face, or -1.

        Parameters
        ----------
        corners, edges : ndarray of shape (3, 4, m)
            Corners seen from the point, and planes through the edges.
        nearness : ndarray of shape (3, m)
            A polygon is met at distance 1 / (nearness . d) along d.
        """
        rows = self.resolution if face == 0 else self.resolution // 2
        right, up, forward = (np.einsum("a,akm->km", axis, corners) for axis in FACES[face])
        lowest = -forward if face == 0 else np.zeros_like(forward)
        # Outside one side of the face's pyramid with all corners: nothing of it on this face.
        inside = (forward > 0).any(axis=0) & (up > lowest).any(axis=0) & (up < forward).any(axis=0)
        inside &= (right > -forward).any(axis=0) & (right < forward).any(axis=0)
        some = np.flatnonzero(inside)
        bounds = self._bounds(right[:, some], up[:, some], forward[:, some], rows)
        some, column, row = _fragments(some, bounds)
        x = (column + 0.5) * 2 / self.resolution - 1
        y = (row + 0.5) * 2 / self.resolution + (1 - 2 * rows / self.resolution)
        covered = np.ones(len(some), dtype=bool)
        for edge in range(4):
            a, b, c = (axis @ edges[:, edge] for axis in FACES[face])
            slack = ON_EDGE * (np.abs(a) + np.abs(b) + np.abs(c))
            covered &= a[some] * x + b[some] * y + c[some] >= -slack[some]
        a, b, c = (axis @ nearness for axis in FACES[face])
        near = a[some] * x + b[some] * y + c[some]
        hits = np.flatnonzero(covered & (near > 0))
        pixel = (row * self.resolution + column)[hits]
        nearest = np.zeros(rows * self.resolution)
        np.maximum.at(nearest, pixel, near[hits])
        first = near[hits] == nearest[pixel]
        owner = np.full(rows * self.resolution, -1)
        owner[pixel[first]] = some[hits[first]]
        return owner

    def _bounds(self, right: FloatArray, up: FloatArray, forward: FloatArray, rows: int) -> IntArray:
        """Return the first and last column and row, shape (4, m), that polygons can cover on a face."""
        # A polygon that reaches behind the point may be anywhere on the face.
        ahead = (forward > 0).all(axis=0)
        depth = np.where(ahead, forward, 1)
        x, y = right / depth, up / depth
        low, high = 2 * rows / self.resolution - 1, 0.5 * self.resolution
        edges = np.stack((x.min(axis=0) + 1, x.max(axis=0) + 1, y.min(axis=0) + low, y.max(axis=0) + low)) * high
        first, last = np.ceil(edges[::2] - 0.5 - 1e-6), np.floor(edges[1::2] - 0.5 + 1e-6)
        most = np.array([[self.resolution - 1], [rows - 1]])
        first = np.where(ahead, np.clip(first, 0, most + 1), 0)
        last = np.where(ahead, np.clip(last, -1, most), most)
        return np.stack((first[0], last[0], first[1], last[1])).astype(np.int64)


def _fragments(polygon: IntArray, bounds: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return every pixel within every polygon's bounds: polygon, column and row."""
    width = np.maximum(bounds[1] - bounds[0] + 1, 0)
    count = width * np.maximum(bounds[3] - bounds[2] + 1, 0)
    which, place = counted(count)
    row, column = np.divmod(place, np.maximum(width, 1)[which])
    return polygon[which], column + bounds[0][which], row + bounds[2][which]
