# SPDX-License-Identifier: GPL-3.0-or-later
"""Occlusion of streams of segments: thousands go down the tree together, as arrays.

A node tests the boxes of all its children against all segments that reached it and hands each child those that pass; a
leaf tests its few polygons against all that arrive. Segments that are found blocked leave the stream. That suits NumPy,
which is slow to start and quick to go on, and it runs in threads, since NumPy gives up the interpreter meanwhile.
Sources: Wald, Gribble, Boulos, Kensler 2007 (SIMD ray stream tracing); Barringer, Akenine-Moller 2014 (dynamic ray
stream traversal); Goldsmith, Salmon 1987 (surface area heuristic).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .surfaces import GROWTH, MARGIN, Occluding, never_block

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Polygons in a leaf and children of a node: where the cost of starting and that of going on are about the same.
LEAF = 16
CHILDREN = 12
# Segments worked on at a time: their temporaries stay in a core's second-level cache, and the products below are too
# small for the linear algebra library to start threads of its own.
CHUNK = 1024
# Segments that go down together; more make the leaves' share of Python's overhead smaller, until memory is slow.
STREAM = 1 << 17
# Planes of the scene's walls that segments are compared with first: the cost of a box.
WALLS = 8
# Heights over two planes that differ by no more are heights over one.
_SAME_PLANE = 0.2 * MARGIN
# Half lengths below this are parallel to an axis.
_PARALLEL = 1e-9


@dataclass(frozen=True, eq=False)
class _Leaf:
    """Parallelograms and triangles as linear functions of a point (x, y, z, 1), stacked.

    Of a parallelogram: height over the plane, and two coordinates that are -1 to 1 inside. Of a triangle: height, and
    depth inside each of the three edges. `margin`: heights up to which an end counts as on the surface.
    """

    parallelograms: Singles  # (3k, 4)
    parallelogram_margin: Singles  # (k, 1)
    triangles: Singles  # (4j, 4)
    triangle_margin: Singles  # (j, 1)


@dataclass(frozen=True, eq=False)
class _Node:
    """Boxes and what is in them."""

    low: Singles  # (c, 3)
    high: Singles  # (c, 3)
    children: list[_Node | _Leaf]


class StreamOccluders:
    """Segments against surfaces, many at a time.

    Surfaces in whose plane the scene ends, such as the walls of a room, block only segments that leave the scene. So
    they wait in a tree of their own, and a segment is let through to it when one of its ends is behind such a wall.

    Parameters
    ----------
    occluding : Occluding
        Surfaces that block.
    """

    def __init__(self, occluding: Occluding) -> None:
        points = occluding.vertices
        # Single precision wants the scene at the origin and of the size of one.
        self._size = occluding.diagonal
        self._centre = 0.5 * (points.min(axis=0) + points.max(axis=0)) if len(points) else np.zeros(3)
        corners = ((points - self._centre) / self._size)[occluding.triangles]
        margin = MARGIN + np.broadcast_to(occluding.slack, len(corners)) / self._size
        self._walls, outer = _walls(corners, never_block(points, occluding.triangles, MARGIN * self._size))
        self._inner = _planted(corners[~outer], margin[~outer])
        self._outer = _planted(corners[outer], margin[outer])

    def blocked(self, origins: Floats, targets: Floats) -> Bools:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        result = np.zeros(len(origins), dtype=bool)
        # What is level with a plane divides by nothing, but then it does not cross it.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for first in range(0, len(origins), STREAM):
                part = slice(first, first + STREAM)
                segments = self._segments(origins[part], targets[part])
                if self._inner is not None:
                    _descend(self._inner, segments, np.arange(segments.shape[1]), result[part])
                leaving = self._leaving(segments)
                if self._outer is not None and len(leaving):
                    _descend(self._outer, segments.take(leaving, axis=1), leaving, result[part])
        return result

    def _leaving(self, segments: Singles) -> Ints:
        """Return the segments that have an end behind a wall of the scene."""
        behind = [
            (self._walls @ chunk[:4] + np.abs(self._walls[:, :3] @ chunk[4:7]) > 0.5 * MARGIN).any(axis=0)
            for _, chunk in _chunks(segments)
        ]
        return np.flatnonzero(np.concatenate([*behind, np.zeros(0, dtype=bool)]))

    def _segments(self, origins: Floats, targets: Floats) -> Singles:
        """Return middles with a 1, half vectors, their inverses, and middles times inverses, shape (13, m)."""
        a, b = (origins - self._centre) / self._size, (targets - self._centre) / self._size
        segments = np.ones((13, len(a)), dtype=np.float32)
        segments[:3] = (0.5 * (a + b)).T
        segments[4:7] = (0.5 * (b - a)).T
        if isinstance(self._inner, _Node) or isinstance(self._outer, _Node):
            half = segments[4:7]
            np.divide(1.0, np.where(np.abs(half) < _PARALLEL, np.float32(_PARALLEL), half), out=segments[7:10])
            np.multiply(segments[:3], segments[7:10], out=segments[10:])
        return segments


def _descend(node: _Node | _Leaf, segments: Singles, index: Ints, blocked: Bools) -> None:
    """Mark the segments that a part of the tree blocks; `index` tells where each one stands in `blocked`."""
    if isinstance(node, _Leaf):
        for part, chunk in _chunks(segments):
            hit = _parallelograms_hit(node, chunk) | _triangles_hit(node, chunk)
            blocked[index[part][hit]] = True
        return
    reached = np.concatenate([_boxes_hit(node, chunk) for _, chunk in _chunks(segments)], axis=1)
    for child, mask in zip(node.children, reached, strict=True):
        chosen = np.flatnonzero(mask & ~blocked[index])
        if len(chosen):
            _descend(child, segments.take(chosen, axis=1), index[chosen], blocked)


def _chunks(segments: Singles) -> Iterator[tuple[slice, Singles]]:
    """Yield segments in pieces that fit into the cache."""
    for first in range(0, segments.shape[1], CHUNK):
        part = slice(first, first + CHUNK)
        yield part, segments[:, part]


def _boxes_hit(node: _Node, segments: Singles) -> Bools:
    """Return which boxes each segment enters, shape (c, m): the slabs of Kay and Kajiya 1986."""
    near, far = np.float32(-1.0), np.float32(1.0)
    for axis in range(3):
        inverse, middle = segments[7 + axis], segments[10 + axis]
        one = node.low[:, axis, None] * inverse
        one -= middle
        other = node.high[:, axis, None] * inverse
        other -= middle
        near = np.maximum(near, np.minimum(one, other))
        far = np.minimum(far, np.maximum(one, other, out=other))
    return np.asarray(near <= far)


def _crossing(height: Singles, rise: Singles, margin: Singles) -> tuple[Bools, Singles]:
    """Return whether the ends lie on different sides of planes, and where between -1 and 1 the segments cross them.

    Parameters
    ----------
    height, rise : ndarray of shape (k, m)
        Of the segments' middles over the planes, and of their ends over their middles.
    margin : ndarray of shape (k, 1)
        How far an end must be from the plane.
    """
    apart = np.abs(height)
    apart += margin
    across = apart < np.abs(rise)
    return across, np.divide(height, rise, out=apart)


def _parallelograms_hit(leaf: _Leaf, segments: Singles) -> Bools:
    """Return which segments the parallelograms of a leaf block, shape (m,)."""
    count = len(leaf.parallelogram_margin)
    if count == 0:
        return np.zeros(segments.shape[1], dtype=bool)
    at = leaf.parallelograms @ segments[:4]
    along = leaf.parallelograms[:, :3] @ segments[4:7]
    hit, back = _crossing(at[:count], along[:count], leaf.parallelogram_margin)
    for side in (1, 2):
        part = slice(side * count, (side + 1) * count)
        along[part] *= back
        at[part] -= along[part]
        hit &= np.abs(at[part], out=at[part]) <= 1.0
    return np.asarray(hit.any(axis=0))


def _triangles_hit(leaf: _Leaf, segments: Singles) -> Bools:
    """Return which segments the triangles of a leaf block, shape (m,)."""
    count = len(leaf.triangle_margin)
    if count == 0:
        return np.zeros(segments.shape[1], dtype=bool)
    at = leaf.triangles @ segments[:4]
    along = leaf.triangles[:, :3] @ segments[4:7]
    hit, back = _crossing(at[:count], along[:count], leaf.triangle_margin)
    for side in (1, 2, 3):
        part = slice(side * count, (side + 1) * count)
        along[part] *= back
        hit &= at[part] >= along[part]
    return np.asarray(hit.any(axis=0))


def _walls(corners: Floats, never: Bools) -> tuple[Singles, Bools]:
    """Return the planes in which the scene ends and which triangles lie in them.

    Parameters
    ----------
    corners : ndarray of shape (t, 3, 3)
    never : ndarray of shape (t,)
        Triangles that have the whole scene on one side.

    Returns
    -------
    planes : ndarray of shape (k, 4)
        Linear functions of (x, y, z, 1): the height outside. Of many planes, as round a ball, the largest.
    outer : ndarray of shape (t,)
        The triangles in those planes; some of `never`.
    """
    chosen = np.flatnonzero(never)
    a, b, c = (corners[chosen, k] for k in range(3))
    vector = np.cross(b - a, c - a)
    size = np.linalg.norm(vector, axis=1)
    normal = vector / size[:, None]
    height = (normal * (corners.reshape(-1, 3).mean(axis=0) - a)).sum(axis=1) if len(chosen) else size
    outward = -np.sign(height)[:, None] * normal
    function = np.column_stack([outward, -(outward * a).sum(axis=1)])
    # A flat scene has no inside.
    deep = np.abs(height) > MARGIN
    chosen, function, size = chosen[deep], function[deep], size[deep]
    _, first, plane = np.unique(np.round(function / _SAME_PLANE), axis=0, return_index=True, return_inverse=True)
    plane = plane.reshape(-1)
    largest = np.argsort(-np.bincount(plane, weights=size), kind="stable")[:WALLS]
    outer = np.zeros(len(corners), dtype=bool)
    outer[chosen[np.isin(plane, largest)]] = True
    return function[first[largest]].astype(np.float32), outer


def _planted(corners: Floats, margin: Floats) -> _Node | _Leaf | None:
    """Return a tree over triangles (t, 3, 3), with parallelograms where two that follow each other make one."""
    if len(corners) == 0:
        return None
    first = _pairs(corners)
    lone = np.ones(len(corners), dtype=bool)
    lone[first] = lone[first + 1] = False
    half = np.concatenate([corners[first], corners[lone]])
    margin = np.concatenate([margin[first], margin[lone]])
    ends = np.concatenate([corners[first + 1, 2], half[len(first) :, 2]])[:, None]
    everything = np.concatenate([half, ends], axis=1)
    # Surfaces reach a little over their edges, and single precision has its own opinion.
    pad = GROWTH + 1e-6
    low, high = everything.min(axis=1) - pad, everything.max(axis=1) + pad
    rows = _edges(half, len(first)).astype(np.float32)
    polygons = _Polygons(rows, margin.astype(np.float32), len(first), low, high)
    return _grown(polygons, np.arange(len(half)))


@dataclass(frozen=True, eq=False)
class _Polygons:
    """What a tree is grown over: parallelograms first, then triangles."""

    rows: Singles  # (n, 4, 4); a parallelogram has only three
    margin: Singles  # (n,)
    parallelograms: int
    low: Floats  # (n, 3)
    high: Floats  # (n, 3)


def _pairs(corners: Floats) -> Ints:
    """Return the triangles that make a parallelogram with the one after them, none of them twice."""
    one, other = corners[:-1], corners[1:]
    shared = (one[:, 0] == other[:, 0]).all(axis=1) & (one[:, 2] == other[:, 1]).all(axis=1)
    opposite = one[:, 0] + one[:, 2] - one[:, 1] - other[:, 2]
    match = np.concatenate([shared & (np.abs(opposite).max(axis=1) <= 0.1 * GROWTH), [False]])
    # In a row of matches every other one counts.
    place = np.arange(len(match))
    begin = np.maximum.accumulate(np.where(match & ~np.roll(match, 1), place, 0))
    return np.flatnonzero(match & ((place - begin) % 2 == 0))


def _edges(half: Floats, parallelograms: int) -> Floats:
    """Return the linear functions of the first polygons as parallelograms and the others as triangles, (n, 4, 4)."""
    a, b, c = half[:, 0], half[:, 1], half[:, 2]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rows = np.zeros((len(half), 4, 4))
    rows[:, 0, :3] = normal
    rows[:, 0, 3] = -(normal * a).sum(axis=1)
    for side, (start, end) in enumerate(((a, b), (b, c), (c, a))):
        inward = np.cross(normal, end - start)
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        rows[:, 1 + side, :3] = inward
        rows[:, 1 + side, 3] = GROWTH - (inward * start).sum(axis=1)
    # Opposite sides at once: how far from the middle line, in half widths.
    middle = 0.5 * (a + c)
    for side, start in ((1, a), (2, b)):
        inward = rows[:parallelograms, side, :3]
        reach = (inward * (middle - start)[:parallelograms]).sum(axis=1) + GROWTH
        rows[:parallelograms, side, 3] = -(inward * middle[:parallelograms]).sum(axis=1)
        rows[:parallelograms, side] /= reach[:, None]
    return rows


def _grown(polygons: _Polygons, members: Ints) -> _Node | _Leaf:
    """Return a tree over some of the polygons."""
    if len(members) <= LEAF:
        return _leaf(polygons, members)
    # The heaviest part is split until there are enough. What blocks most comes first: the segments that it blocks need
    # not look further.
    parts = [(_weight(polygons, members), members)]
    while len(parts) < CHILDREN and any(len(group) > LEAF for _, group in parts):
        heaviest = next(k for k, (_, group) in enumerate(parts) if len(group) > LEAF)
        parts += [(_weight(polygons, group), group) for group in _split(polygons, parts.pop(heaviest)[1])]
        parts.sort(key=lambda part: -part[0])
    groups = [group for _, group in parts]
    low = np.array([polygons.low[group].min(axis=0) for group in groups], dtype=np.float32)
    high = np.array([polygons.high[group].max(axis=0) for group in groups], dtype=np.float32)
    return _Node(low, high, [_grown(polygons, group) for group in groups])


def _leaf(polygons: _Polygons, members: Ints) -> _Leaf:
    """Return the functions of a few polygons, those of a kind together."""
    flat, sharp = members[members < polygons.parallelograms], members[members >= polygons.parallelograms]
    rows, margin = polygons.rows, polygons.margin[:, None]
    return _Leaf(
        np.ascontiguousarray(rows[flat, :3].transpose(1, 0, 2).reshape(-1, 4)),
        margin[flat],
        np.ascontiguousarray(rows[sharp].transpose(1, 0, 2).reshape(-1, 4)),
        margin[sharp],
    )


def _weight(polygons: _Polygons, members: Ints) -> float:
    """Return the chance that a segment gets to a group's box, times what it costs there."""
    span = polygons.high[members].max(axis=0) - polygons.low[members].min(axis=0)
    return float(_surface(span) * len(members))


def _surface(span: Floats) -> Floats:
    """Return half the surface of boxes with the given sides in the last axis."""
    x, y, z = span[..., 0], span[..., 1], span[..., 2]
    return np.asarray(x * y + y * z + z * x)


def _split(polygons: _Polygons, members: Ints) -> list[Ints]:
    """Return two parts of a group, cut where boxes are cheapest to ask: sorted along each axis, at every place."""
    best = (np.inf, members[:1], members[1:])
    for axis in range(3):
        order = members[np.argsort(polygons.low[members, axis] + polygons.high[members, axis], kind="stable")]
        low, high = polygons.low[order], polygons.high[order]
        left = np.maximum.accumulate(high) - np.minimum.accumulate(low)
        right = (np.maximum.accumulate(high[::-1]) - np.minimum.accumulate(low[::-1]))[::-1]
        count = np.arange(1, len(order))
        cost = _surface(left[:-1]) * count + _surface(right[1:]) * count[::-1]
        cheapest = int(np.argmin(cost))
        if cost[cheapest] < best[0]:
            best = (float(cost[cheapest]), order[: cheapest + 1], order[cheapest + 1 :])
    return [best[1], best[2]]
