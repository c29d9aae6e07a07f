# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a bake is off: rms of luminance over its mean, at the points where the mesh tells the truth.

A *point* is a vertex with one shading normal: the corners that share both are averaged, as they would be in a mesh of
vertex colours. Left out are points of emitting faces and points on an open border (an edge with one face only).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Shading normals that agree to this many decimals are one.
NORMAL_DECIMALS = 3


@dataclass(frozen=True, eq=False)
class Points:
    """Where the error is measured.

    Attributes
    ----------
    point : ndarray of shape (c,)
        The point of every face corner.
    counted : ndarray of shape (p,)
        Whether a point takes part.
    """

    point: NDArray[np.int64]
    counted: BoolArray

    def luminance(self, corner_radiance: FloatArray) -> FloatArray:
        """Return the luminance at the points that take part: the mean over each point's corners."""
        corners = np.bincount(self.point, minlength=len(self.counted))
        total = np.bincount(self.point, corner_radiance @ LUMINANCE, minlength=len(self.counted))
        return (total / corners)[self.counted]

    def without(self, corners: BoolArray) -> "Points":
        """Leave out every point that has one of these corners."""
        counted = self.counted.copy()
        counted[self.point[corners]] = False
        return Points(self.point, counted)


def points(geometry: Geometry) -> Points:
    """Return the points off the emitters that are not on an open border."""
    key = np.column_stack([geometry.corner_vertex, np.round(geometry.corner_normals, NORMAL_DECIMALS) + 0.0])
    _, first, point = np.unique(key, axis=0, return_index=True, return_inverse=True)
    vertex = geometry.corner_vertex[first]
    left_out = np.zeros(len(geometry.vertices), dtype=bool)
    left_out[geometry.corner_vertex[(geometry.emission > 0).any(axis=1)[geometry.corner_face]]] = True
    left_out[_open_border(geometry)] = True
    return Points(point.reshape(-1), ~left_out[vertex])


def _open_border(geometry: Geometry) -> NDArray[np.int64]:
    """Return the vertices of all edges that have one face only."""
    edges = np.sort(np.column_stack([geometry.corner_vertex, geometry.corner_vertex[geometry.next_corner]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    return np.unique(unique[count == 1])


def error(where: Points, radiance: FloatArray, first: FloatArray, second: FloatArray) -> float:
    """Return the rms error of luminance over mean luminance, free of the references' noise.

    The noise of two references with different seeds is independent: the mean of (x - A)(x - B) holds none of it.

    Parameters
    ----------
    where : Points
    radiance, first, second : ndarray of shape (c, 3)
        What is measured, and the two references.
    """
    x, a, b = (where.luminance(values) for values in (radiance, first, second))
    return float(np.sqrt(max(np.mean((x - a) * (x - b)), 0.0)) / np.mean((a + b) / 2))


def bias(where: Points, radiance: FloatArray, first: FloatArray, second: FloatArray) -> float:
    """Return how much too bright a bake is on the whole, over the mean luminance."""
    x, a, b = (where.luminance(values).mean() for values in (radiance, first, second))
    return float(2 * x / (a + b) - 1)
