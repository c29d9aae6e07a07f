# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes whose faces vary inside, by a function of place."""

import numpy as np

from core.paint.averages import Triangles, build_paint, corner_values, face_means
from core.paint.samples import paint_samples
from core.scene import Scene


def painted(polygons, color, parts=8, faces=None, **fields):
    """Return a scene of quads whose faces look like `color(points)`, an array (s, 6) of reflectance and exitance."""
    plain = Scene.from_polygons(polygons, 0.0, 0.0, **fields)
    corner = plain.face_start[:-1, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    triangles = Triangles(
        plain.vertices[plain.corner_vertex[corner]].reshape(-1, 3, 3),
        corner.reshape(-1, 3),
        np.repeat(np.arange(len(polygons)), 2),
    )
    samples = paint_samples(np.full(len(triangles.face), parts))
    points = np.einsum("sk,ski->si", samples.share, triangles.points[samples.triangle])
    values = color(points)
    mean = face_means(samples, values, triangles, len(polygons))
    corners = corner_values(samples, values, triangles, mean[plain.corner_face], plain.corner_vertex)
    paint = build_paint(samples, values, triangles, corners, plain.face_normal)
    return Scene(plain.vertices, plain.corner_vertex, plain.face_start, mean[:, :3], mean[:, 3:], paint=paint, **fields)


def halves(points):
    """Red where x < 1/2, green elsewhere; nothing emits."""
    left = points[:, 0] < 0.5
    return np.stack([0.8 * left, 0.8 * ~left, *np.zeros((4, len(points)))], axis=1)


def furnace(points):
    """Whatever it reflects, it emits what is missing for a radiosity of 1."""
    rho = np.stack([points[:, 0], points[:, 1] ** 2, 0.5 + 0.4 * np.sin(9 * points[:, 2])], axis=1) * 0.9
    return np.concatenate([rho, 1.0 - rho], axis=1)


SQUARE = [[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]]
