# SPDX-License-Identifier: GPL-3.0-or-later
"""Points on patches that stand for the whole patch in an integral."""

from functools import cache

import numpy as np

from ..arrays import FloatArray
from ..sequences import GOLDEN


def surface_points(corners: FloatArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places on patches and how much area there is around each.

    Parameters
    ----------
    corners : ndarray of shape (n, 4, 3)
        Patches [m]; a triangle repeats its last corner.
    u, v : ndarray of shape (q,) or (n, q)
        Places in the unit square, the same or others for each patch; u runs from corner 0 to 1, v from 0 to 3.

    Returns
    -------
    points : ndarray of shape (n, q, 3)
        On the patches' bilinear surfaces [m].
    stretch : ndarray of shape (n, q)
        Area of the surface over area in the unit square [m^2].
    """
    u, v = u[..., None], v[..., None]
    a, b, c, d = (corners[:, k, None] for k in range(4))
    along_u = (1 - v) * (b - a) + v * (c - d)
    along_v = (1 - u) * (d - a) + u * (c - b)
    # Arms from the first corner: a patch far from the origin keeps its digits.
    points = a + (u * (1 - v) * (b - a) + u * v * (c - a) + (1 - u) * v * (d - a))
    return points, np.asarray(np.linalg.norm(np.cross(along_u, along_v), axis=2))


def gauss_points(corners: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Return the points and weights of a Gauss-Legendre product rule on every patch.

    Parameters
    ----------
    corners : ndarray of shape (n, 4, 3)
        Patches [m].
    order : int
        Points along each side; on parallelograms polynomials up to degree 2 * order - 1 are integrated exactly.

    Returns
    -------
    points : ndarray of shape (n, order**2, 3)
        [m].
    weights : ndarray of shape (n, order**2)
        Share of the area that each point stands for; they sum to 1.
    """
    t, w = _gauss(order)
    u, v = np.meshgrid((t + 1) / 2, (t + 1) / 2, indexing="ij")
    points, stretch = surface_points(corners, u.ravel(), v.ravel())
    return points, _shares(stretch * np.outer(w, w).ravel())


@cache
def _gauss(order: int) -> tuple[FloatArray, FloatArray]:
    """Return the points and weights of a rule on -1 to 1; finding them takes longer than using them."""
    t, w = np.polynomial.legendre.leggauss(order)
    return t, w


def turned_points(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return four points on every patch, turned by another angle on each, and their weights.

    On parallelograms any turn integrates polynomials up to degree 3 exactly. That no two patches have the same turn
    keeps the lines between their points from meeting edges in line with the meshing all in the same way.

    Parameters
    ----------
    corners : ndarray of shape (n, 4, 3)
        Patches [m].

    Returns
    -------
    points : ndarray of shape (n, 4, 3)
        In order round the centre [m].
    weights : ndarray of shape (n, 4)
        Share of the area that each point stands for; they sum to 1.
    """
    # Turns by the golden ratio of a quarter are never alike.
    turn = (np.arange(len(corners)) * GOLDEN) % 1.0
    angle = (turn[:, None] + np.arange(4)) * (np.pi / 2)
    radius = np.sqrt(1 / 6)
    points, stretch = surface_points(corners, 0.5 + radius * np.cos(angle), 0.5 + radius * np.sin(angle))
    return points, _shares(stretch)


def _shares(weights: FloatArray) -> FloatArray:
    """Return weights that sum to 1 on every patch."""
    total = weights.sum(axis=1, keepdims=True)
    # A patch without area stands for nothing; any weights do.
    return np.where(total > 0, weights / np.where(total > 0, total, 1), 1 / weights.shape[1])
