# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces of patches, quads and triangles: their quarters, middles and measures."""

import numpy as np

from .tree import Float


def quarters(corners: Float) -> Float:
    """Split quads and triangles into four alike, one after the other; `(n, 4, 3)` to `(4 n, 4, 3)`."""
    a, b, c, d = corners.transpose(1, 0, 2)
    triangle = (c == d).all(axis=1)[:, None]
    ab, bc, cd, da = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + d), 0.5 * (d + a)
    middle = 0.5 * (ab + cd)
    quads: Float = np.stack((a, ab, middle, da, ab, b, bc, middle, middle, bc, c, cd, da, middle, cd, d), axis=1)
    ca = 0.5 * (c + a)
    triangles: Float = np.stack((a, ab, ca, ca, ab, b, bc, bc, ca, bc, c, c, ab, bc, ca, ca), axis=1)
    return np.where(triangle[:, None], triangles, quads).reshape(-1, 4, 3)


def centres(corners: Float) -> Float:
    """Return the middles of quads and triangles, shape (n, 3) [m]."""
    triangle = (corners[:, 2] == corners[:, 3]).all(axis=1)[:, None]
    middle: Float = np.where(triangle, corners[:, :3].mean(axis=1), corners.mean(axis=1))
    return middle


def flat_measures(corners: Float) -> tuple[Float, Float]:
    """Return unit normals, shape (n, 3), and areas as seen along them, shape (n,) [m^2]."""
    vector = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area: Float = np.sqrt((vector * vector).sum(axis=1))
    return vector / np.maximum(area, 1e-300)[:, None], area
