# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees of sources over loose polygons, for tests of the hierarchy."""

import numpy as np

from core.hierarchy.pieces import centres, quarters
from core.hierarchy.sources import build_sources


def measured(corners):
    """Return centres, unit normals and areas of planar patches."""
    vector = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area = np.sqrt((vector**2).sum(axis=1))
    return centres(corners), vector / area[:, None], area


def split(polygons, times):
    corners = np.array(polygons, float)
    for _ in range(times):
        corners = quarters(corners)
    return corners


def sources_of(corners, shade=None):
    return build_sources(corners, *measured(corners), shade)


def elements_below(tree, node):
    return tree.order[tree.start[node] : tree.stop[node]]


def ball(times=2):
    """An octahedron's triangles, split and pushed out to the unit sphere."""
    corners = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            for sz in (-1, 1):
                face = [(sx, 0, 0), (0, sy, 0), (0, 0, sz)][:: sx * sy * sz]
                corners.append([*face, face[-1]])
    corners = split(corners, times)
    return corners / np.linalg.norm(corners, axis=2, keepdims=True)


def random_polygons(rng, count, triangles=0.5):
    """Return rectangles and triangles of any size and orientation, here and there."""
    frame = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    u, v = frame[:, 0] * rng.uniform(0.1, 1, (count, 1)), frame[:, 1] * rng.uniform(0.1, 1, (count, 1))
    a = rng.uniform(-2, 2, (count, 3))
    corners = np.stack((a, a + u, a + u + v, a + v), axis=1)
    triangle = rng.random(count) < triangles
    corners[triangle, 3] = corners[triangle, 2]
    return corners
