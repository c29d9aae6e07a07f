# SPDX-License-Identifier: GPL-3.0-or-later
"""Find the face corners that lie inside or under other geometry, where a path tracer's values mean nothing."""

import numpy as np
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

from .geometry import Geometry

# Rays from a corner, how far above it they start (of the scene's extent), and the share of them that may meet a back.
PROBES = 64
OFFSET = 1e-5
# How far towards the face's middle: as Cycles' bake, in shares of the corner's largest coordinate, or of a metre.
INWARDS = 1e-4
BACKS_ALLOWED = 0.1


def hidden_corners(geometry: Geometry) -> NDArray[np.bool_]:
    """Tell which corners are buried.

    Rays leave in all directions from just off the corner: along its face's normal and as far towards the face's middle
    as a bake moves there. In the open they meet fronts only (the face itself is the nearest of them); inside a solid or
    behind a wall, backs. A corner where more than a tenth of the rays first meet a back is buried.

    Returns
    -------
    ndarray of shape (c,)
    """
    position = geometry.vertices[geometry.corner_vertex]
    starts, corners = geometry.face_start[:-1], np.diff(geometry.face_start)
    inwards = np.repeat(np.add.reduceat(position, starts) / corners[:, None], corners, axis=0) - position
    inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
    # Newell's normal.
    area = np.add.reduceat(np.cross(position, position[geometry.next_corner]), starts)
    normal = np.repeat(area / np.linalg.norm(area, axis=1, keepdims=True), corners, axis=0)
    offset = OFFSET * float(np.ptp(geometry.vertices, axis=0).max())
    inwards *= INWARDS * np.maximum(np.abs(position).max(axis=1, keepdims=True), 1.0)
    origins = position + offset * normal + inwards

    faces = [geometry.corner_vertex[a:b].tolist() for a, b in zip(starts, geometry.face_start[1:], strict=True)]
    tree = BVHTree.FromPolygons(geometry.vertices.tolist(), faces)
    directions = _sphere(PROBES).tolist()
    backs = np.zeros(len(origins), dtype=int)
    for corner, origin in enumerate(origins.tolist()):
        for direction in directions:
            _, facing, face, _ = tree.ray_cast(origin, direction)
            if face is not None and geometry.sides[face] == 1:
                backs[corner] += facing.dot(direction) > 0
    return backs > BACKS_ALLOWED * PROBES


def _sphere(count: int) -> NDArray[np.float64]:
    """Return unit vectors spread evenly (a golden spiral)."""
    k = np.arange(count) + 0.5
    z, phi = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    return np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=1)
