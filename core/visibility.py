# SPDX-License-Identifier: GPL-3.0-or-later
"""Who sees whom: occlusion of many segments at once, against surfaces and not patches (T14).

A surface blocks a segment that crosses it, unless an end of the segment lies in the surface's plane, within `MARGIN`:
so a surface never blocks what starts on it or runs along it, nor what starts on a coplanar neighbour, however shallow.
That is a test of heights over the plane and not of distances along the segment. Where two surfaces touch, a point on
both is blocked by neither, and closed bodies block with their far side.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from .occlusion.streams import StreamOccluders
from .occlusion.surfaces import GROWTH, MARGIN, Occluding, occluder_polygons

if TYPE_CHECKING:
    from .meshing import Patches
    from .scene import Scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Streams want segments: half as many as there are triangles, or as many as are enough for any tree; measured.
FEW, ENOUGH = 0.5, 2048
# How far behind a surface that does not count Blender's tree is asked again: the grain of single precision.
_STEP = 1e-7
# Pairs of segment and triangle that are looked at together.
_PAIRS = 200_000


class Occluders(Protocol):
    """Something that blocks light; safe to ask from several threads."""

    def blocked(self, origins: Floats, targets: Floats) -> Bools:
        """Return for each segment whether a surface crosses it strictly between its ends.

        Parameters
        ----------
        origins, targets : ndarray of shape (m, 3)
            On surfaces or anywhere else [m].

        Returns
        -------
        ndarray of shape (m,)
            The same with origins and targets exchanged.
        """
        ...


def scene_occluders(scene: Scene, patches: Patches) -> SurfaceOccluders:
    """Return what blocks light in a scene.

    Parameters
    ----------
    scene : Scene
    patches : Patches
        How the scene is meshed: what blocks is what is lit.

    Returns
    -------
    SurfaceOccluders
    """
    found = SurfaceOccluders(occluder_polygons(scene, patches))
    if not np.array_equal(scene.occludes, scene.shades):
        found.for_sky = SurfaceOccluders(occluder_polygons(scene, patches, scene.shades))
    return found


def sky_occluders(occluders: Occluders) -> Occluders:
    """Return what blocks the light of the sky where all other light is blocked by `occluders`."""
    return occluders.for_sky or occluders if isinstance(occluders, SurfaceOccluders) else occluders


class SurfaceOccluders:
    """Streams of segments where there are many of them, Blender's tree for the rest: whatever is faster.

    Parameters
    ----------
    occluding : Occluding
        Surfaces that block.

    Attributes
    ----------
    for_sky : SurfaceOccluders or None
        What blocks the light of the sky, where that is something else.
    """

    def __init__(self, occluding: Occluding) -> None:
        self.for_sky: SurfaceOccluders | None = None
        self._occluding = occluding
        self._stream = StreamOccluders(occluding)

    @cached_property
    def _single(self) -> BVHOccluders | BruteForceOccluders:
        """Return who is asked for a few segments, and for what is nearest: grown only when it is needed."""
        try:
            return BVHOccluders(self._occluding)
        except ModuleNotFoundError:
            return BruteForceOccluders(self._occluding)

    def blocked(self, origins: Floats, targets: Floats) -> Bools:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        enough = len(origins) >= min(FEW * len(self._occluding.triangles), ENOUGH)
        # Outside Blender there are streams for everything, except for what is nearest.
        if enough or isinstance(self._single, BruteForceOccluders):
            return self._stream.blocked(origins, targets)
        return self._single.blocked(origins, targets)

    def nearest(self, origins: Floats, directions: Floats) -> tuple[Ints, Floats, Bools]:
        """Return face, distance and side of what rays hit first; see `BruteForceOccluders.nearest`."""
        return self._single.nearest(origins, directions)


class BruteForceOccluders:
    """Every segment against every triangle, in double precision: slow, plain, what the others are tested against.

    Parameters
    ----------
    occluding : Occluding
        Surfaces that block.
    margin, growth : float
        How near to a plane an end lies in it, and how far surfaces reach over their edges [share of the diagonal].
    """

    def __init__(self, occluding: Occluding, *, margin: float = MARGIN, growth: float = GROWTH) -> None:
        self._face = occluding.triangle_face
        self._margin = margin * occluding.diagonal + np.broadcast_to(occluding.slack, len(self._face))
        self._growth = growth * occluding.diagonal
        self._corners = occluding.vertices[occluding.triangles]
        a, b, c = (self._corners[:, k] for k in range(3))
        normal = np.cross(b - a, c - a)
        self._normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def blocked(self, origins: Floats, targets: Floats) -> Bools:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        result = np.zeros(len(origins), dtype=bool)
        for part in self._parts(len(origins)):
            along = targets[part] - origins[part]
            crossing, rise = self._crossings(origins[part], along)
            # The other end has to be clear of the plane as well.
            hit = np.isfinite(crossing)
            beyond = (1.0 - np.where(hit, crossing, 1.0)) * np.abs(rise) > self._margin
            result[part] = (hit & beyond).any(axis=1)
        return result

    def nearest(self, origins: Floats, directions: Floats) -> tuple[Ints, Floats, Bools]:
        """Return what rays hit first.

        Parameters
        ----------
        origins, directions : ndarray of shape (m, 3)
            A surface in whose plane a ray starts is not hit [m]; directions of any length but zero.

        Returns
        -------
        face : ndarray of shape (m,)
            Face of the scene, or one of those that were joined with it; -1 for none.
        distance : ndarray of shape (m,)
            Infinite for none [m].
        front : ndarray of shape (m,)
            Whether the front of the face was hit.
        """
        face, distance = np.full(len(origins), -1), np.full(len(origins), np.inf)
        front = np.zeros(len(origins), dtype=bool)
        for part in self._parts(len(origins)):
            way = directions[part] / np.linalg.norm(directions[part], axis=1, keepdims=True)
            crossing, rise = self._crossings(origins[part], way)
            first = crossing.argmin(axis=1)
            row = np.arange(len(first))
            distance[part] = crossing[row, first]
            hit = np.isfinite(distance[part])
            face[part] = np.where(hit, self._face[first], -1)
            front[part] = hit & (rise[row, first] < 0)
        return face, distance, front

    def _parts(self, count: int) -> Iterator[slice]:
        """Yield the segments in parts; none when there is nothing to hit."""
        if len(self._face):
            step = max(1, _PAIRS // len(self._face))
            for first in range(0, count, step):
                yield slice(first, first + step)

    def _crossings(self, origins: Floats, along: Floats) -> tuple[Floats, Floats]:
        """Return where rays cross triangles, in lengths of `along`, and how fast they rise over them, shape (m, t).

        Infinite where they do not, or start in the triangle's plane.
        """
        arm = origins[:, None] - self._corners[:, 0]
        height, rise = (arm * self._normal).sum(axis=2), along @ self._normal.T
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = -height / rise
            hit = (np.abs(height) > self._margin) & (crossing > 0) & np.isfinite(crossing)
            arm += np.where(hit, crossing, 0.0)[:, :, None] * along[:, None]
        for side in range(3):
            edge = self._corners[:, (side + 1) % 3] - self._corners[:, side]
            inward = np.cross(self._normal, edge / np.linalg.norm(edge, axis=1, keepdims=True))
            start = (inward * (self._corners[:, side] - self._corners[:, 0])).sum(axis=1)
            hit &= (arm * inward).sum(axis=2) >= start - self._growth
        return np.where(hit, crossing, np.inf), rise


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

        points = occluding.vertices
        # The tree works in single precision, which wants the scene at the origin and of the size of one.
        self._size = occluding.diagonal
        self._centre = 0.5 * (points.min(axis=0) + points.max(axis=0)) if len(points) else np.zeros(3)
        self._face = occluding.triangle_face
        self._margin = MARGIN + np.broadcast_to(occluding.slack, len(self._face)) / self._size
        corners = self._local(points)[occluding.triangles]
        self._start = corners[:, 0]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        index = np.arange(corners.size // 3).reshape(-1, 3)
        self._tree = BVHTree.FromPolygons(
            _outgrown(corners).reshape(-1, 3).tolist(), index.tolist(), all_triangles=True, epsilon=0.0
        )

    def blocked(self, origins: Floats, targets: Floats) -> Bools:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        start, end = self._local(origins), self._local(targets)
        length = np.linalg.norm(end - start, axis=1)
        way = (end - start) / np.maximum(length, 1e-30)[:, None]
        triangle, _ = self._first(start, way, length - MARGIN, (start, end))
        return np.asarray(triangle >= 0)

    def nearest(self, origins: Floats, directions: Floats) -> tuple[Ints, Floats, Bools]:
        """Return face, distance and side of what rays hit first; see `BruteForceOccluders.nearest`."""
        start = self._local(origins)
        way = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        # Nothing is farther from the middle of the scene than half its diagonal.
        triangle, distance = self._first(start, way, np.linalg.norm(start, axis=1) + 1.0, (start,))
        hit = np.flatnonzero(triangle >= 0)
        face, front = np.full(len(origins), -1), np.zeros(len(origins), dtype=bool)
        face[hit] = self._face[triangle[hit]]
        front[hit] = (self._normal[triangle[hit]] * way[hit]).sum(axis=1) < 0
        return face, distance * self._size, front

    def _local(self, points: Floats) -> Floats:
        """Return points in the units of the tree."""
        return np.asarray((points - self._centre) / self._size)

    def _first(self, start: Floats, way: Floats, reach: Floats, ends: tuple[Floats, ...]) -> tuple[Ints, Floats]:
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


def _outgrown(corners: Floats) -> Floats:
    """Return triangles, shape (t, 3, 3), with each edge `GROWTH` further out; needles grow less."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1), axis=2)
    around = sides.sum(axis=1)
    middle = (corners * sides[:, :, None]).sum(axis=1) / around[:, None]
    double = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # The inscribed circle's radius is twice the area over the circumference.
    factor = 1.0 + np.minimum(GROWTH * around / double, 0.05)
    return np.asarray(middle[:, None] + factor[:, None, None] * (corners - middle[:, None]))
