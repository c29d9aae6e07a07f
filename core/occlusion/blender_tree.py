# SPDX-License-Identifier: GPL-3.0-or-later
"""Segments and rays against Blender's own tree of boxes, which is only there inside Blender."""

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from .surfaces import GROWTH, MARGIN, Occluding

# How far behind a surface that does not count Blender's tree is asked again: the grain of single precision.
_STEP = 1e-7


def in_blender() -> bool:
    """Return whether there is Blender's tree: without it single rays take as long as there are surfaces."""
    try:
        import mathutils  # noqa: F401
    except ModuleNotFoundError:
        return False
    return True


class BVHOccluders:
    """Segments against Blender's own tree of boxes, `mathutils.bvhtree.BVHTree`, one after the other.

    The tree tells what is nearest and nothing behind it. So a segment that runs along a surface and meets that surface
    and another one at the same place may slip through there; streams have no such blind spot.

    Parameters
    ----------
    occluding : Occluding
        Surfaces that block.

    Raises
    ------
    ModuleNotFoundError
        Outside Blender.
    """

    def __init__(self, occluding: Occluding) -> None:
        from mathutils.bvhtree import BVHTree

        # The tree works in single precision.
        self._core = occluding.core
        self._face = occluding.triangle_face
        self._margin = occluding.margins
        corners = self._core.local(occluding.vertices)[occluding.triangles]
        # Nothing is farther from the middle.
        self._reach = max(1.0, float(np.max(np.linalg.norm(corners, axis=2), initial=0.0)))
        self._start = corners[:, 0]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        index = np.arange(corners.size // 3).reshape(-1, 3)
        self._tree = BVHTree.FromPolygons(
            _outgrown(corners).reshape(-1, 3).tolist(), index.tolist(), all_triangles=True, epsilon=0.0
        )

    def blocked(self, origins: FloatArray, targets: FloatArray) -> BoolArray:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        return self._core.piecewise(origins, targets, self._crossed)

    def _crossed(self, origins: FloatArray, targets: FloatArray) -> BoolArray:
        """Return which segments are blocked, as they are."""
        start, end = self._core.local(origins), self._core.local(targets)
        length = np.linalg.norm(end - start, axis=1)
        way = (end - start) / np.maximum(length, 1e-30)[:, None]
        triangle, _ = self._first(start, way, length - MARGIN, (start, end))
        return np.asarray(triangle >= 0)

    def nearest(self, origins: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return face, distance and side of what rays hit first; see `BruteForceOccluders.nearest`."""
        return self._hit(origins, directions, leaving=True)

    def any_nearest(self, origins: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return the same but, of several faces at one place, any of them: less work."""
        return self._hit(origins, directions, leaving=False)

    def _hit(
        self, origins: FloatArray, directions: FloatArray, *, leaving: bool
    ) -> tuple[IntArray, FloatArray, BoolArray]:
        start = self._core.local(origins)
        way = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        triangle, distance = self._first(start, way, np.linalg.norm(start, axis=1) + self._reach, (start,))
        if leaving:
            self._leave_first(triangle, start, way, distance)
        hit = np.flatnonzero(triangle >= 0)
        face, front = np.full(len(origins), -1), np.zeros(len(origins), dtype=bool)
        face[hit] = self._face[triangle[hit]]
        front[hit] = (self._normal[triangle[hit]] * way[hit]).sum(axis=1) < 0
        return face, distance * self._core.size, front

    def _leave_first(self, triangle: IntArray, start: FloatArray, way: FloatArray, distance: FloatArray) -> None:
        """Where a ray leaves a body right where it enters another one, put what it leaves first."""
        entered = np.flatnonzero(triangle >= 0)
        entered = entered[(self._normal[triangle[entered]] * way[entered]).sum(axis=1) < 0]
        places = (start[entered] + distance[entered, None] * way[entered]).T.tolist()
        for ray, place in zip(entered.tolist(), zip(*places, strict=True), strict=True):
            near = self._tree.find_nearest_range(place, MARGIN)
            if len(near) > 1:
                found = np.array([index for _, _, index, _ in near])
                height = ((start[ray] - self._start[found]) * self._normal[found]).sum(axis=1)
                left = found[(self._normal[found] @ way[ray] > 0) & (np.abs(height) > self._margin[found])]
                triangle[ray] = left[0] if len(left) else triangle[ray]

    def _first(
        self, start: FloatArray, way: FloatArray, reach: FloatArray, ends: tuple[FloatArray, ...]
    ) -> tuple[IntArray, FloatArray]:
        """Return the first triangles within reach in whose planes no end lies, -1 for none, and their distances."""
        triangle, distance = np.full(len(start), -1), np.full(len(start), np.inf)
        gone, step = np.full(len(start), MARGIN), _STEP
        rays = np.flatnonzero(gone < reach)
        while len(rays):
            # The quickest way to feed a tree: columns as lists, zipped into tuples, and no loop in Python.
            begin = (start[rays] + gone[:, None][rays] * way[rays]).T.tolist()
            left = (reach - gone)[rays].tolist()
            columns = zip(*begin, strict=True), zip(*way[rays].T.tolist(), strict=True), left
            hits = list(map(self._tree.ray_cast, *columns))
            hit = np.array([found[2] is not None for found in hits])
            rays = rays[hit]
            found, further = (np.array([h[k] for h in hits if h[2] is not None]) for k in (2, 3))
            found = found.astype(np.int64)
            gone[rays] += further
            counts = np.ones(len(rays), dtype=bool)
            for end in ends:
                height = ((end[rays] - self._start[found]) * self._normal[found]).sum(axis=1)
                counts &= np.abs(height) > self._margin[found]
            triangle[rays[counts]], distance[rays[counts]] = found[counts], gone[rays[counts]]
            # Go on behind the others. A ray in a wall's own plane meets it again and again: go twice as far each time.
            rays = rays[~counts]
            gone[rays] += step
            step *= 2.0
            rays = rays[gone[rays] < reach[rays]]
        return triangle, distance


def _outgrown(corners: FloatArray) -> FloatArray:
    """Return triangles, shape (t, 3, 3), with each edge `GROWTH` further out; needles grow less."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1), axis=2)
    around = sides.sum(axis=1)
    middle = (corners * sides[:, :, None]).sum(axis=1) / around[:, None]
    double = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # The inscribed circle's radius is twice the area over the circumference.
    factor = 1.0 + np.minimum(GROWTH * around / double, 0.05)
    return np.asarray(middle[:, None] + factor[:, None, None] * (corners - middle[:, None]))
