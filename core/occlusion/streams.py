# SPDX-License-Identifier: GPL-3.0-or-later
"""Occlusion of streams of segments: thousands go down the tree together, as arrays.

A node tests the boxes of all its children against all segments that reached it and hands each child those that pass; a
leaf tests its few polygons against all that arrive. Segments that are found blocked leave the stream. That suits NumPy,
which is slow to start and quick to go on, and it runs in threads, since NumPy gives up the interpreter meanwhile.
Sources: Wald, Gribble, Boulos, Kensler 2007 (SIMD ray stream tracing); Barringer, Akenine-Moller 2014 (dynamic ray
stream traversal).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray, SingleArray
from .core_part import CorePart
from .stragglers import Stragglers
from .stream_tree import Leaf, Node, Tree, planted
from .surfaces import MARGIN, Occluding, never_block

# Segments of one matrix product: too small for the linear algebra library to start threads of its own.
CHUNK = 1024
# Chunks worked on at a time: their temporaries stay near a core's second-level cache, and other threads are not kept
# waiting for the interpreter by calls that are over at once.
BATCH = 8
# Segments that go down together; more make the leaves' share of Python's overhead smaller, until memory is slow.
STREAM = 1 << 18
# Segments that come to a node together, at least: fewer are left to go their own ways.
FEWEST = 1024
# Planes of the scene's walls that segments are compared with first: the cost of a box.
WALLS = 8
# Heights over two planes that differ by no more are heights over one.
_SAME_PLANE = 0.2 * MARGIN
# Rows of segments that polygons are asked with come first, then those for boxes.
SLABS = 7
# Half lengths below this are parallel to an axis.
_PARALLEL = 1e-9


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
        self._core = occluding.core
        corners, margin = self._core.local(points)[occluding.triangles], occluding.margins
        self._walls, outer = _walls(corners, never_block(points, occluding.triangles, MARGIN * self._core.size))
        self._inner = planted(corners[~outer], margin[~outer])
        self._outer = planted(corners[outer], margin[outer])

    def blocked(self, origins: FloatArray, targets: FloatArray) -> BoolArray:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        return self._core.piecewise(origins, targets, self._crossed)

    def _crossed(self, origins: FloatArray, targets: FloatArray) -> BoolArray:
        """Return which segments are blocked, as they are."""
        result = np.zeros(len(origins), dtype=bool)
        # What is level with a plane divides by nothing, but then it does not cross it.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for first in range(0, len(origins), STREAM):
                part = slice(first, first + STREAM)
                segments = segment_rows(self._core, origins[part], targets[part])
                for tree, chosen in ((self._inner, np.arange(segments.shape[1])), (self._outer, None)):
                    if tree is not None:
                        cross(tree, segments, self._leaving(segments) if chosen is None else chosen, result[part])
        return result

    def _leaving(self, segments: SingleArray) -> IntArray:
        """Return the segments that have an end behind a wall of the scene."""
        behind = [np.zeros(0, dtype=bool)]
        for _, batch in _batches(segments):
            height = self._walls @ batch[:, :4] + np.abs(self._walls[:, :3] @ batch[:, 4:7])
            behind.append((height > 0.5 * MARGIN).any(axis=1).reshape(-1))
        return np.flatnonzero(np.concatenate(behind))


def segment_rows(core: CorePart, origins: FloatArray, targets: FloatArray) -> SingleArray:
    """Return middles with a 1, half vectors, their inverses, and middles times inverses, shape (13, m)."""
    a, b = core.local(origins), core.local(targets)
    segments = np.ones((13, len(a)), dtype=np.float32)
    segments[:3] = (0.5 * (a + b)).T
    segments[4:7] = (0.5 * (b - a)).T
    half = segments[4:7]
    np.divide(1.0, np.where(np.abs(half) < _PARALLEL, np.float32(_PARALLEL), half), out=segments[7:10])
    np.multiply(segments[:3], segments[7:10], out=segments[10:])
    return segments


def cross(tree: Tree, segments: SingleArray, chosen: IntArray, blocked: BoolArray) -> None:
    """Mark the chosen segments that the polygons of a tree block.

    Parameters
    ----------
    tree : Tree
    segments : ndarray of shape (13, m)
        See `segment_rows`.
    chosen : ndarray of shape (k,)
    blocked : ndarray of shape (m,)
        What is blocked so far; more is marked here.
    """
    stragglers = Stragglers(tree, segments, blocked)
    slabs = segments[SLABS:]
    _descend(tree, 0, slabs if len(chosen) == segments.shape[1] else slabs.take(chosen, axis=1), chosen, stragglers)
    stragglers.finish()


def _descend(tree: Tree, number: int, slabs: SingleArray, index: IntArray, stragglers: Stragglers) -> None:
    """Mark the segments that a node blocks.

    Parameters
    ----------
    slabs : ndarray of shape (6, m)
        What boxes are asked with: all that goes down from node to node.
    index : ndarray of shape (m,)
        Where each segment stands in `stragglers`.
    """
    if len(index) < FEWEST:
        stragglers.add(number, index)
        return
    node, blocked = tree.wide(number), stragglers.blocked
    if isinstance(node, Leaf):
        for part, batch in _batches(stragglers.segments[:SLABS].take(index, axis=1)):
            hit = _parallelograms_hit(node, batch) | _triangles_hit(node, batch)
            blocked[index[part][hit.reshape(-1)]] = True
        return
    entered = [_boxes_hit(node, batch).transpose(1, 0, 2) for _, batch in _batches(slabs)]
    reached = np.concatenate([batch.reshape(len(node.children), -1) for batch in entered], axis=1)
    for child, mask in zip(node.children, reached, strict=True):
        chosen = np.flatnonzero(mask & ~blocked[index])
        if len(chosen):
            _descend(tree, child, slabs.take(chosen, axis=1), index[chosen], stragglers)


def _batches(segments: SingleArray) -> Iterator[tuple[slice, SingleArray]]:
    """Yield segments (k, m) in batches of a few chunks (b, k, w), and what is left of the last chunk by itself."""
    count = segments.shape[1]
    whole = count - count % CHUNK
    for first in [*range(0, whole, BATCH * CHUNK), whole]:
        last = min(first + BATCH * CHUNK, whole) if first < whole else count
        if first < last:
            chunks = max(1, (last - first) // CHUNK)
            part = slice(first, last)
            yield part, segments[:, part].reshape(len(segments), chunks, -1).transpose(1, 0, 2)


def _boxes_hit(node: Node, slabs: SingleArray) -> BoolArray:
    """Return which of c boxes each segment enters, shape (b, c, w): the slabs of Kay and Kajiya 1986."""
    near, far = np.float32(-1.0), np.float32(1.0)
    for axis in range(3):
        inverse, middle = slabs[:, axis, None], slabs[:, 3 + axis, None]
        one = node.low[:, axis, None] * inverse
        one -= middle
        other = node.high[:, axis, None] * inverse
        other -= middle
        near = np.maximum(near, np.minimum(one, other))
        far = np.minimum(far, np.maximum(one, other, out=other))
    return np.asarray(near <= far)


def _crossing(height: SingleArray, rise: SingleArray, margin: SingleArray) -> tuple[BoolArray, SingleArray]:
    """Return whether the ends lie on different sides of planes, and where between -1 and 1 the segments cross them.

    Parameters
    ----------
    height, rise : ndarray of shape (b, k, w)
        Of the segments' middles over the planes, and of their ends over their middles.
    margin : ndarray of shape (k, 1)
        How far an end must be from the plane.
    """
    apart = np.abs(height)
    apart += margin
    across = apart < np.abs(rise)
    return across, np.divide(height, rise, out=apart)


def _parallelograms_hit(leaf: Leaf, segments: SingleArray) -> BoolArray:
    """Return which segments the parallelograms of a leaf block, shape (b, w)."""
    count = len(leaf.parallelogram_margin)
    if count == 0:
        return np.zeros(segments[:, 0].shape, dtype=bool)
    at = leaf.parallelograms @ segments[:, :4]
    along = leaf.parallelograms[:, :3] @ segments[:, 4:7]
    hit, back = _crossing(at[:, :count], along[:, :count], leaf.parallelogram_margin)
    for side in (1, 2):
        part = slice(side * count, (side + 1) * count)
        along[:, part] *= back
        at[:, part] -= along[:, part]
        hit &= np.abs(at[:, part], out=at[:, part]) <= 1.0
    return np.asarray(hit.any(axis=1))


def _triangles_hit(leaf: Leaf, segments: SingleArray) -> BoolArray:
    """Return which segments the triangles of a leaf block, shape (b, w)."""
    count = len(leaf.triangle_margin)
    if count == 0:
        return np.zeros(segments[:, 0].shape, dtype=bool)
    at = leaf.triangles @ segments[:, :4]
    along = leaf.triangles[:, :3] @ segments[:, 4:7]
    hit, back = _crossing(at[:, :count], along[:, :count], leaf.triangle_margin)
    for side in (1, 2, 3):
        part = slice(side * count, (side + 1) * count)
        along[:, part] *= back
        hit &= at[:, part] >= along[:, part]
    return np.asarray(hit.any(axis=1))


def _walls(corners: FloatArray, never: BoolArray) -> tuple[SingleArray, BoolArray]:
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
