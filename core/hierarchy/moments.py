# SPDX-License-Identifier: GPL-3.0-or-later
"""Second moments of clusters: how large they are, and the few points that stand for them."""

import numpy as np

from .tree import Float, Tree
from .vectors import across


def moments(tree: Tree, corners: Float, centre: Float, area: Float) -> tuple[Float, Float, Float]:
    """Combine the moments of elements from the leaves upwards (parallel axis theorem).

    Parameters
    ----------
    tree : Tree
    corners : ndarray of shape (n, 4, 3)
        Of the elements [m].
    centre : ndarray of shape (n, 3)
        Their centroids [m].
    area : ndarray of shape (n,)
        [m^2].

    Returns
    -------
    area : ndarray of shape (m,)
        Of every node [m^2].
    centre : ndarray of shape (m, 3)
        Centroid [m].
    covariance : ndarray of shape (m, 3, 3)
        Mean of the products of coordinates about it [m^2].
    """
    first = tree.order[tree.start]
    A, C = area[first], centre[first]
    # A quad's own second moment, as that of the parallelogram on its mean edges.
    u = 0.5 * (corners[:, 1] - corners[:, 0] + corners[:, 2] - corners[:, 3])
    v = 0.5 * (corners[:, 3] - corners[:, 0] + corners[:, 2] - corners[:, 1])
    own = (_squares(u) + _squares(v)) / 12
    a, b, c, d = corners.transpose(1, 0, 2)
    own = np.where((c == d).all(axis=1)[:, None, None], (_squares(b - a) + _squares(c - b) + _squares(a - c)) / 36, own)
    M = own[first]
    for begin, end in reversed(tree.levels):
        inner = begin + np.flatnonzero(tree.child[begin:end] >= 0)
        left = tree.child[inner]
        right = left + 1
        A[inner] = A[left] + A[right]
        share = (A[right] / A[inner])[:, None]
        apart = C[right] - C[left]
        C[inner] = C[left] + share * apart
        share = share[:, :, None]
        M[inner] = (1 - share) * M[left] + share * M[right] + share * (1 - share) * apart[:, :, None] * apart[:, None]
    return A, C, M


def _squares(vector: Float) -> Float:
    """Return each vector times itself, shape (n, 3, 3)."""
    return vector[:, :, None] * vector[:, None]


def principal_points(centre: Float, covariance: Float, normal: Float) -> Float:
    """Place four points for each node, at one standard deviation along its principal axes in its plane.

    Parameters
    ----------
    centre : ndarray of shape (m, 3)
        [m].
    covariance : ndarray of shape (m, 3, 3)
        [m^2].
    normal : ndarray of shape (m, 3)
        Unit length.

    Returns
    -------
    ndarray of shape (m, 4, 3)
        [m].
    """
    # Any frame in the plane will do.
    t = across(normal)
    b = np.cross(normal, t)
    tt = np.einsum("mi,mij,mj->m", t, covariance, t)
    tb = np.einsum("mi,mij,mj->m", t, covariance, b)
    bb = np.einsum("mi,mij,mj->m", b, covariance, b)
    angle = 0.5 * np.arctan2(2 * tb, tt - bb)
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    u, v = c * t + s * b, c * b - s * t
    half, mean = np.hypot(0.5 * (tt - bb), tb), 0.5 * (tt + bb)
    spread = np.sqrt(np.maximum(np.column_stack((mean + half, mean - half)), 0))
    u, v = spread[:, :1] * u, spread[:, 1:] * v
    points: Float = centre[:, None] + np.stack((u + v, u - v, -u - v, v - u), axis=1)
    return points
