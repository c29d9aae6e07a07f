# SPDX-License-Identifier: GPL-3.0-or-later
"""Checked polygons as convex parts, and what planes leave of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import FloatArray
from ..errors import RadiosityError
from ..triangulation import triangulate

# Distances relative to a polygon's size: corners that coincide, a border that runs straight, a surface that is flat.
SAME = 1e-9
FLAT = 1e-4


@dataclass(frozen=True, eq=False)
class ConvexPart:
    """A convex piece of a polygon.

    Attributes
    ----------
    polygon : int
        Index of the polygon that it is a part of.
    corners : ndarray of shape (k, 3)
        Counter-clockwise seen from the radiating side [m].
    normal : ndarray of shape (3,)
        Unit normal.
    """

    polygon: int
    corners: FloatArray
    normal: FloatArray

    def distances(self, points: FloatArray) -> FloatArray:
        """Return how far in front of this part's plane points of shape (..., 3) are [m]."""
        return np.asarray((points - self.corners.mean(axis=0)) @ self.normal)


def checked_polygons(polygons: Sequence[ArrayLike]) -> list[FloatArray]:
    """Return polygons as arrays without doubled corners.

    Parameters
    ----------
    polygons : sequence of array_like of shape (k, 3)
        Corners [m].

    Raises
    ------
    RadiosityError
        Names the first polygon that is no flat polygon with an area, and what is wrong with it.
    """
    return [_checked(index, polygon) for index, polygon in enumerate(polygons)]


def _checked(index: int, polygon: ArrayLike) -> FloatArray:
    try:
        corners = np.array(polygon, dtype=float)
    except (TypeError, ValueError) as error:
        raise RadiosityError(f"Polygon {index}: expected an array of corners, shape (k, 3).") from error
    if corners.ndim != 2 or corners.shape[1] != 3:
        raise RadiosityError(f"Polygon {index}: expected corners of shape (k, 3), got {corners.shape}.")
    if not np.isfinite(corners).all():
        raise RadiosityError(f"Polygon {index}: a coordinate is not finite.")
    if len(corners) < 3:
        raise RadiosityError(f"Polygon {index}: has {len(corners)} corners, a polygon has at least 3.")
    size = np.linalg.norm(np.ptp(corners, axis=0))
    corners = corners[np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) > SAME * size]
    if len(corners) < 3 or np.linalg.norm(area_vector(corners)) <= SAME * size * size:
        raise RadiosityError(f"Polygon {index}: has no area.")
    away = np.abs((corners - corners.mean(axis=0)) @ unit_normal(corners)).max()
    if away > FLAT * size:
        raise RadiosityError(
            f"Polygon {index}: is not planar: corners are up to {away:.3g} m off its plane. Split it into triangles."
        )
    return np.asarray(corners)


def area_vector(corners: FloatArray) -> FloatArray:
    """Return a polygon's area times its unit normal [m^2] (Newell)."""
    arms = corners[1:] - corners[0]
    return cross(arms[:-1], arms[1:]).sum(axis=0) / 2


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return cross products over the last axis; for small arrays much faster than NumPy's own."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def unit_normal(corners: FloatArray) -> FloatArray:
    """Return the unit normal on the side from which the corners run counter-clockwise."""
    vector = area_vector(corners)
    return np.asarray(vector / np.linalg.norm(vector))


def plane_axes(normal: FloatArray) -> FloatArray:
    """Return two unit vectors, shape (2, 3), that make a right-handed frame with the normal."""
    axis = np.eye(3)[np.argmin(np.abs(normal))]
    first = cross(axis, normal)
    first /= np.linalg.norm(first)
    return np.stack((first, cross(normal, first)))


def convex_parts(polygon: int, corners: FloatArray) -> list[ConvexPart]:
    """Split a simple polygon into convex parts: itself if it is convex, else joined triangles."""
    normal = unit_normal(corners)
    flat = (corners - corners.mean(axis=0)) @ plane_axes(normal).T
    size = np.abs(flat).max()
    loops = [list(range(len(corners)))]
    if not _is_convex(flat / size, loops[0]):
        triangles, _ = triangulate(flat[None] / size)
        loops = _joined([[int(c) for c in triangle] for triangle in triangles], flat / size)
    return [ConvexPart(polygon, corners[loop], normal) for loop in loops]


def _is_convex(points: FloatArray, loop: list[int]) -> bool:
    """Return whether a loop turns left at every corner, or goes straight, and once around."""
    edges = np.roll(points[loop], -1, axis=0) - points[loop]
    following = np.roll(edges, -1, axis=0)
    cross = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    turns = np.arctan2(cross, np.sum(edges * following, axis=1))
    return bool((cross >= -SAME).all() and turns.sum() < 3 * np.pi)


def _joined(loops: list[list[int]], points: FloatArray) -> list[list[int]]:
    """Join neighbouring loops as long as a joined one is convex."""
    for i, first in enumerate(loops):
        for j, second in enumerate(loops[:i]):
            union = _union(first, second)
            if union and _is_convex(points, union):
                rest = [loop for k, loop in enumerate(loops) if k not in (i, j)]
                return _joined([*rest, union], points)
    return loops


def _union(first: list[int], second: list[int]) -> list[int]:
    """Return the loop around two loops that share one edge; empty if they share none."""
    for k, start in enumerate(first):
        end = first[(k + 1) % len(first)]
        if end in second and second[(second.index(end) + 1) % len(second)] == start:
            at = second.index(end)
            # Around the first from the edge's end to its start, then on along the second.
            around = first[k + 1 :] + first[: k + 1]
            return around + [second[(at + 2 + step) % len(second)] for step in range(len(second) - 2)]
    return []


def in_front(corners: FloatArray, distances: FloatArray, margin: float) -> FloatArray:
    """Return what a plane leaves of a convex polygon on its front.

    Parameters
    ----------
    corners : ndarray of shape (k, 3)
        The polygon [m].
    distances : ndarray of shape (k,)
        How far in front of the plane its corners are [m].
    margin : float
        Corners this close to the plane lie in it [m].

    Returns
    -------
    ndarray of shape (m, 3)
        m is 0 when no corner is in front by more than the margin.
    """
    if np.max(distances) <= margin:
        return corners[:0]
    if np.min(distances) >= -margin:
        return corners
    kept: list[FloatArray] = []
    for k, (corner, distance) in enumerate(zip(corners, distances, strict=True)):
        following = (k + 1) % len(corners)
        if distance >= -margin:
            kept.append(corner)
        if abs(distance) > margin and abs(distances[following]) > margin and distance * distances[following] < 0:
            share = distance / (distance - distances[following])
            kept.append(corner + share * (corners[following] - corner))
    return np.array(kept)
