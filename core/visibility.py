# SPDX-License-Identifier: GPL-3.0-or-later
"""Who sees whom: occlusion of many segments at once."""

from __future__ import annotations

from itertools import repeat
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from .surfaces import Occluding, occluder_polygons

if TYPE_CHECKING:
    from .meshing import Patches
    from .scene import Scene

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]

MARGIN = 2e-5  # of the scene's diagonal


class Occluders(Protocol):
    """Answer whether straight segments are blocked."""

    def blocked(self, origins: Floats, targets: Floats) -> Bools:
        """Return for each segment, shape (m,), whether a surface crosses it strictly between its ends."""
        ...


def _shortened(origins: Floats, targets: Floats, margin: float) -> tuple[Floats, Floats, Floats]:
    """Return start points, unit directions and lengths of the segments without their ends."""
    along = targets - origins
    length = np.sqrt((along * along).sum(axis=1))
    along = along / np.maximum(length, 1e-300)[:, None]
    cut = np.minimum(margin, 0.1 * length)
    return origins + cut[:, None] * along, along, length - 2.0 * cut


class BruteForceOccluders:
    """Every segment against every triangle (Moller and Trumbore 1997); the oracle."""

    def __init__(self, occluding: Occluding) -> None:
        corners = occluding.vertices[occluding.triangles]
        self._base = corners[:, 0]
        self._u = corners[:, 1] - corners[:, 0]
        self._v = corners[:, 2] - corners[:, 0]
        self._normal = np.cross(self._u, self._v)
        self._face = occluding.triangle_face
        points = occluding.vertices
        self._margin = MARGIN * float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0

    def _distances(self, starts: Floats, directions: Floats) -> Floats:
        """Return the distance from each start to each triangle along its direction, infinite for a miss."""
        turned = np.cross(directions[:, None], self._v[None])
        det = (turned * self._u).sum(axis=2)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            to = starts[:, None] - self._base
            u = (to * turned).sum(axis=2) / det
            turned = np.cross(to, self._u[None])
            v = (turned * directions[:, None]).sum(axis=2) / det
            t = (turned * self._v).sum(axis=2) / det
            hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (t >= 0.0) & np.isfinite(t)
        return np.where(hit, t, np.inf)

    def _blocks(self, count: int) -> list[slice]:
        step = max(1, 200_000 // max(1, len(self._base)))
        return [slice(first, first + step) for first in range(0, count, step)]

    def blocked(self, origins: Floats, targets: Floats) -> Bools:
        """Return for each segment, shape (m,), whether a surface crosses it strictly between its ends."""
        result = np.zeros(len(origins), dtype=bool)
        if len(self._base):
            starts, directions, lengths = _shortened(origins, targets, self._margin)
            for part in self._blocks(len(origins)):
                result[part] = (self._distances(starts[part], directions[part]) <= lengths[part, None]).any(axis=1)
        return result

    def nearest(self, origins: Floats, directions: Floats) -> tuple[Ints, Floats, Bools]:
        """Return the face hit first (-1: none), its distance (infinite: none) and whether its front was hit."""
        face = np.full(len(origins), -1, dtype=np.int64)
        distance = np.full(len(origins), np.inf)
        front = np.zeros(len(origins), dtype=bool)
        if len(self._base):
            unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
            starts = origins + self._margin * unit
            for part in self._blocks(len(origins)):
                t = self._distances(starts[part], unit[part])
                first = t.argmin(axis=1)
                distance[part] = t[np.arange(len(t)), first] + self._margin
                hit = np.isfinite(distance[part])
                face[part] = np.where(hit, self._face[first], -1)
                front[part] = hit & ((self._normal[first] * unit[part]).sum(axis=1) < 0.0)
        return face, distance, front


class BVHOccluders:
    """Segments against Blender's bounding volume hierarchy, `mathutils.bvhtree.BVHTree`."""

    def __init__(self, occluding: Occluding) -> None:
        from mathutils.bvhtree import BVHTree

        points = occluding.vertices
        low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.ones(3))
        # The tree holds single precision: bring the scene to the origin and to the size of one.
        self._centre = 0.5 * (low + high)
        self._size = float(np.linalg.norm(high - low)) or 1.0
        self._face = occluding.triangle_face
        corners = points[occluding.triangles]
        self._normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        local = (points - self._centre) / self._size
        self._tree = BVHTree.FromPolygons(local.tolist(), occluding.triangles.tolist(), all_triangles=True, epsilon=0.0)

    def _local(self, points: Floats) -> Floats:
        return (points - self._centre) / self._size

    def blocked(self, origins: Floats, targets: Floats) -> Bools:
        """Return for each segment, shape (m,), whether a surface crosses it strictly between its ends."""
        starts, directions, lengths = _shortened(self._local(origins), self._local(targets), MARGIN)
        hits = map(self._tree.ray_cast, starts.tolist(), directions.tolist(), lengths.tolist())
        return np.fromiter((hit[2] is not None for hit in hits), dtype=bool, count=len(origins))

    def nearest(self, origins: Floats, directions: Floats) -> tuple[Ints, Floats, Bools]:
        """Return the face hit first (-1: none), its distance (infinite: none) and whether its front was hit."""
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        starts = self._local(origins) + MARGIN * unit
        hits = list(map(self._tree.ray_cast, starts.tolist(), unit.tolist(), repeat(10.0)))
        index = np.array([-1 if hit[2] is None else hit[2] for hit in hits], dtype=np.int64)
        distance = np.array([np.inf if hit[2] is None else hit[3] for hit in hits])
        hit = index >= 0
        face = np.where(hit, self._face[index], -1) if len(self._face) else index
        front = hit & ((self._normal[index] * unit).sum(axis=1) < 0.0) if len(self._face) else hit
        return face, (distance + MARGIN) * self._size, front


def scene_occluders(scene: Scene, patches: Patches) -> BruteForceOccluders | BVHOccluders:
    """Return the fastest occluders there are for a scene.

    Parameters
    ----------
    scene : Scene
    patches : Patches

    Returns
    -------
    BVHOccluders or BruteForceOccluders
        The latter where mathutils is missing (outside Blender).
    """
    occluding = occluder_polygons(scene, patches)
    try:
        return BVHOccluders(occluding)
    except ModuleNotFoundError:
        return BruteForceOccluders(occluding)
