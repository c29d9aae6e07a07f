# SPDX-License-Identifier: GPL-3.0-or-later
"""A binary tree of boxes, grown level by level, all nodes of a level at once: a million boxes in a few seconds.

Every node is cut where its halves are cheapest to ask, judged by all its members, or by some where there are many.
Sources: Goldsmith, Salmon 1987 (the surface area heuristic); Wald 2007 (cuts that few candidates tell).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..arrays import IntArray, SingleArray

# Members that are looked at to cut a node: all of so many, or a sample; fewer for each node where there are many.
_FEWEST, _MOST, _IN_ALL = 64, 4096, 1 << 18
# Numbers that are held at a time.
_BATCH = 1 << 17


@dataclass(frozen=True, eq=False)
class BoxTree:
    """Nodes over boxes; parents come before their children, siblings side by side.

    Attributes
    ----------
    order : ndarray of shape (n,)
        Boxes in the order of the leaves.
    start, stop : ndarray of shape (m,)
        Run of `order` that each node covers.
    child : ndarray of shape (m,)
        First of the two children; -1 for a leaf.
    low, high : ndarray of shape (3, m)
        Bounds of each node.
    """

    order: IntArray
    start: IntArray
    stop: IntArray
    child: IntArray
    low: SingleArray
    high: SingleArray


def box_tree(low: SingleArray, high: SingleArray, most: int) -> BoxTree:
    """Grow a tree.

    Parameters
    ----------
    low, high : ndarray of shape (n, 3)
        Corners of at least one box.
    most : int
        Members of a leaf.

    Returns
    -------
    BoxTree
    """
    order, boxes = np.arange(len(low)), _Boxes.of(low, high)
    starts, stops = [np.array([0])], [np.array([len(low)])]
    children: list[IntArray] = []
    levels = [(0, 1)]
    while True:
        start, stop, (first, last) = starts[-1], stops[-1], levels[-1]
        inner = np.flatnonzero(stop - start > most)
        child = np.full(last - first, -1)
        child[inner] = last + 2 * np.arange(len(inner))
        children.append(child)
        if not len(inner):
            break
        middle = _cut(order, start[inner], stop[inner], boxes)
        starts.append(np.column_stack((start[inner], middle)).ravel())
        stops.append(np.column_stack((middle, stop[inner])).ravel())
        levels.append((last, last + 2 * len(inner)))
    start, stop, child = (np.concatenate(parts) for parts in (starts, stops, children))
    return BoxTree(order, start, stop, child, *_bounds(order, start, child, levels, low, high))


def _bounds(
    order: IntArray,
    start: IntArray,
    child: IntArray,
    levels: list[tuple[int, int]],
    low: SingleArray,
    high: SingleArray,
) -> tuple[SingleArray, SingleArray]:
    """Return the bounds of all nodes, from the leaves upwards."""
    bounds = np.zeros((2, 3, len(start)), dtype=np.float32)
    leaf = np.flatnonzero(child < 0)
    leaf = leaf[np.argsort(start[leaf], kind="stable")]
    bounds[0, :, leaf] = np.minimum.reduceat(low[order], start[leaf])
    bounds[1, :, leaf] = np.maximum.reduceat(high[order], start[leaf])
    for first, last in reversed(levels):
        inner = first + np.flatnonzero(child[first:last] >= 0)
        one = child[inner]
        bounds[0][:, inner] = np.minimum(bounds[0][:, one], bounds[0][:, one + 1])
        bounds[1][:, inner] = np.maximum(bounds[1][:, one], bounds[1][:, one + 1])
    return bounds[0], bounds[1]


@dataclass(frozen=True, eq=False)
class _Boxes:
    """What is cut, and one box more, that is nowhere: it stands where a row has no more members."""

    bounds: SingleArray  # (6, n + 1): low corners, negated high ones
    middle: SingleArray  # (3, n + 1), twice

    @classmethod
    def of(cls, low: SingleArray, high: SingleArray) -> _Boxes:
        """Return boxes with these corners."""
        nowhere = np.full((1, 3), np.inf, dtype=np.float32)
        bounds = np.concatenate([np.concatenate([low, nowhere]).T, np.concatenate([-high, nowhere]).T])
        return cls(bounds, np.ascontiguousarray(np.concatenate([low + high, nowhere]).T))


def _cut(order: IntArray, start: IntArray, stop: IntArray, boxes: _Boxes) -> IntArray:
    """Reorder the runs start:stop of `order` in place, each into two parts, and return where the second begins."""
    size, middle = stop - start, np.zeros(len(start), dtype=np.int64)
    most = int(np.clip(_IN_ALL // len(start), _FEWEST, _MOST))
    few = np.flatnonzero(size <= most)
    # Those of about the same size together.
    few = few[np.argsort(size[few], kind="stable")]
    while len(few):
        count = max(1, _BATCH // int(size[few[0]]))
        part = few[: min(count, int(np.searchsorted(size[few], 1.25 * size[few[0]], side="right")))]
        few = few[len(part) :]
        place = np.arange(int(size[part[-1]]))
        there = place < size[part, None]
        slot = start[part, None] + place
        member = np.where(there, order[np.minimum(slot, len(order) - 1)], len(order))
        _, at, ordered, _ = _cheapest(member, size[part], boxes)
        order[slot[there]] = ordered[there]
        middle[part] = start[part] + at
    many = np.flatnonzero(size > most)
    for first in range(0, len(many), max(1, _BATCH // most)):
        part = many[first : first + max(1, _BATCH // most)]
        # Spread over the run, which goes from one place to the next.
        slot = start[part, None] + (np.arange(most) * (size[part, None] / most)).astype(np.int64)
        axis, _, _, level = _cheapest(order[slot], np.full(len(part), most), boxes)
        middle[part] = _parted(order, start[part], size[part], axis, level, boxes)
    return middle


def _cheapest(member: IntArray, count: IntArray, boxes: _Boxes) -> tuple[IntArray, IntArray, IntArray, SingleArray]:
    """Find for each row of boxes the cheapest cut, over all places along all axes.

    Parameters
    ----------
    member : ndarray of shape (g, k)
        Boxes, at least two in a row; nowhere after the first `count` of each row.

    Returns
    -------
    axis, at : ndarray of shape (g,)
        Axis to sort along, and how many go to the first part.
    ordered : ndarray of shape (g, k)
        The members in that order.
    level : ndarray of shape (g,)
        Twice the height of the cut along the axis.
    """
    rows, k = np.arange(len(member)), member.shape[1]
    # One column for each row of boxes: what goes on from box to box is done for all of them at once.
    left = np.arange(1, k, dtype=np.float32)[:, None]
    # Where nothing is left over, the surface is that of nowhere: without end.
    right = np.maximum(count.astype(np.float32) - left, 1)
    best = np.full(len(member), np.inf, dtype=np.float32)
    axis, at = np.zeros((2, len(member)), dtype=np.int64)
    result, level = member.copy(), np.zeros(len(member), dtype=np.float32)
    for way in range(3):
        rank = np.argsort(boxes.middle[way][member], axis=1)
        ordered = np.take_along_axis(member, rank, axis=1)
        bounds = np.stack([side[ordered.T] for side in boxes.bounds], axis=1)
        cost = left * _surfaces(bounds)
        cost += right * _surfaces(bounds[::-1])[::-1]
        cheapest = cost.argmin(axis=0)
        better = (cost[cheapest, rows] < best) | (way == 0)
        axis[better], at[better], result[better] = way, cheapest[better] + 1, ordered[better]
        best[better] = cost[cheapest, rows][better]
        pair = np.take_along_axis(ordered, cheapest[:, None] + np.arange(2), axis=1)
        level[better] = 0.5 * boxes.middle[way][pair].sum(axis=1)[better]
    return axis, at, result, level


def _surfaces(bounds: SingleArray) -> SingleArray:
    """Return half the surface of what holds the first box, the first two, and so on: (k, 6, g) to (k - 1, g)."""
    held = bounds[:-1].copy()
    # Far quicker than `minimum.accumulate`.
    for one, other in pairwise(held):
        np.minimum(one, other, out=other)
    x, y, z = (held[:, way] + held[:, 3 + way] for way in range(3))
    return np.asarray(x * y + y * z + z * x)


def _parted(
    order: IntArray, start: IntArray, size: IntArray, axis: IntArray, level: SingleArray, boxes: _Boxes
) -> IntArray:
    """Move what lies above the level of its run to the run's end, in place, and return where that begins."""
    first = np.cumsum(size) - size
    run = np.repeat(np.arange(len(size)), size)
    slot = np.arange(len(run)) + (start - first)[run]
    member = order[slot]
    above = boxes.middle[axis[run], member] > level[run]
    count = np.add.reduceat(above.astype(np.int64), first)
    # All at one place: halves in the order that there is.
    stuck = (count == 0) | (count == size)
    if stuck.any():
        above = np.where(stuck[run], slot - start[run] >= (size // 2)[run], above)
        count = np.add.reduceat(above.astype(np.int64), first)
    middle = start + size - count
    below = np.cumsum(~above)
    before = (below - ~above)[first]
    rank = below - 1 - before[run]
    order[np.where(above, middle[run] + slot - start[run] - rank - 1, start[run] + rank)] = member
    return np.asarray(middle)
