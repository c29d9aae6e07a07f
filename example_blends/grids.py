# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces as grids of quads, from which the example scenes are put together."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Grid = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices of shape (v, 3) [m] and quads of shape (f, 4)."""


def even(count: int) -> NDArray[np.float64]:
    """Return the parameters 0 to 1 of ``count`` cells of equal width."""
    return np.linspace(0.0, 1.0, count + 1)


def stops(*pieces: tuple[float, float, int]) -> NDArray[np.float64]:
    """Return grid lines that run through pieces (from, to, cells), which adjoin."""
    return np.concatenate([[pieces[0][0]], *(np.linspace(a, b, n + 1)[1:] for a, b, n in pieces)])


def grid(corners: ArrayLike, u: NDArray[np.float64], v: NDArray[np.float64]) -> Grid:
    """Mesh a quadrilateral, planar or not, on its bilinear surface.

    Parameters
    ----------
    corners : array_like of shape (4, 3)
        Counter-clockwise seen from the lit side [m].
    u, v : ndarray of shape (m,), (n,)
        Parameters of the grid lines along the first and the last edge, 0 to 1.
    """
    a, b, c, d = np.asarray(corners, dtype=float)
    s, t = (array[..., None] for array in np.meshgrid(u, v))
    points = (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * d + s * c)
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    faces = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1)
    return points.reshape(-1, 3), faces.reshape(-1, 4)


def without(part: Grid, low: ArrayLike, high: ArrayLike) -> Grid:
    """Cut a hole: drop the faces whose middle lies inside the box between two corners."""
    vertices, faces = part
    middle = vertices[faces].mean(axis=1)
    return vertices, faces[~((middle > low) & (middle < high)).all(axis=1)]


def rectangle(origin: ArrayLike, edge_u: ArrayLike, edge_v: ArrayLike, cell: float) -> Grid:
    """Mesh a rectangle into cells of about one size; its lit side is where edge_u x edge_v points."""
    o, eu, ev = (np.asarray(value, dtype=float) for value in (origin, edge_u, edge_v))
    counts = [max(1, round(np.linalg.norm(edge) / cell)) for edge in (eu, ev)]
    return grid([o, o + eu, o + eu + ev, o + ev], even(counts[0]), even(counts[1]))


def prism(base: ArrayLike, bottom: float, top: float, cell: float) -> list[Grid]:
    """Mesh the sides and the top of a block over a quadrilateral (4, 2), counter-clockwise seen from above."""
    low, high = (np.column_stack([base, np.full(4, z)]) for z in (bottom, top))
    parts = [rectangle(low[i], low[(i + 1) % 4] - low[i], high[i] - low[i], cell) for i in range(4)]
    across = [max(1, round(np.linalg.norm(high[i + 1] - high[i]) / cell)) for i in (0, 1)]
    return [*parts, grid(high, even(across[0]), even(across[1]))]


def box(low: Sequence[float], high: Sequence[float], cell: float) -> list[Grid]:
    """Mesh a box that stands on something: four sides and the top."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return prism([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], z0, z1, cell)


def closed_box(low: Sequence[float], high: Sequence[float], cell: float) -> list[Grid]:
    """Mesh a box from all sides, for what hangs in the air."""
    (x0, y0, z0), (x1, y1, _) = low, high
    return [*box(low, high, cell), rectangle((x0, y0, z0), (0, y1 - y0, 0), (x1 - x0, 0, 0), cell)]


def inside(parts: list[Grid]) -> list[Grid]:
    """Turn surfaces round, so that the inside of a box is lit."""
    return [(vertices, faces[:, ::-1]) for vertices, faces in parts]
