# SPDX-License-Identifier: GPL-3.0-or-later
"""Segments that come to a part of a tree one by one: pairs of a segment and a node, many pairs at a time.

In a large scene most nodes are reached by few segments of a stream. So those wait until there are many, whichever node
each has come to, and then go on together, each for itself: the last pairs first, so that what is blocked is found
early and what waits stays little.
"""

from __future__ import annotations

import numpy as np

from ..arrays import BoolArray, IntArray, SingleArray
from .stream_tree import Polygons, Tree

# Pairs that go on together, and that may wait.
TOGETHER = 1 << 14
WAITING = 1 << 16


class Stragglers:
    """Pairs that wait.

    Parameters
    ----------
    tree : Tree
    segments : ndarray of shape (13, m)
        As `streams` makes them: middles with a 1, half vectors, their inverses, and middles times inverses.
    blocked : ndarray of shape (m,)
        What is blocked so far; more is marked here.
    """

    def __init__(self, tree: Tree, segments: SingleArray, blocked: BoolArray) -> None:
        self.blocked = blocked
        self._tree, self.segments = tree, segments
        self._index: list[IntArray] = []
        self._node: list[IntArray] = []
        self._count = 0

    def add(self, node: int, index: IntArray) -> None:
        """Let segments wait that have come to a node."""
        self._index.append(index)
        self._node.append(np.full(len(index), node))
        self._count += len(index)
        if self._count > WAITING:
            self.finish()

    def finish(self) -> None:
        """Let all go on until they are blocked or through."""
        index, node, boxes = self._index, self._node, self._tree.boxes
        while index:
            one, here = _last(index, node)
            free = ~self.blocked[one]
            one, here = one[free], here[free]
            child = boxes.child[here]
            twig = child < 0
            self._meet(one[twig], here[twig])
            # The children's children at once: half as many steps, and hardly more boxes.
            one, child = one[~twig], child[~twig]
            both = np.concatenate([child, child + 1])
            first = boxes.child[both]
            ends = first < 0
            below = np.concatenate([both[ends], first[~ends], first[~ends] + 1])
            twice = np.concatenate([one, one])
            who = np.concatenate([twice[ends], twice[~ends], twice[~ends]])
            entered = self._entered(who, below)
            if len(entered):
                index.append(who[entered])
                node.append(below[entered])
        self._count = 0

    def _entered(self, index: IntArray, node: IntArray) -> IntArray:
        """Return which pairs of a segment and a box meet: the slabs of Kay and Kajiya 1986."""
        low, high = self._tree.boxes.low, self._tree.boxes.high
        near, far = np.float32(-1.0), np.float32(1.0)
        for axis in range(3):
            inverse, middle = self.segments[7 + axis].take(index), self.segments[10 + axis].take(index)
            one, other = low[axis].take(node), high[axis].take(node)
            one *= inverse
            one -= middle
            other *= inverse
            other -= middle
            near = np.maximum(near, np.minimum(one, other))
            far = np.minimum(far, np.maximum(one, other, out=other))
        return np.flatnonzero(near <= far)

    def _meet(self, index: IntArray, node: IntArray) -> None:
        """Mark the segments that a leaf of the binary tree blocks."""
        start = self._tree.boxes.start[node]
        count = self._tree.boxes.stop[node] - start
        who = np.repeat(index, count)
        which = np.arange(len(who)) + np.repeat(start - np.cumsum(count) + count, count)
        hit = _hit(self._tree.polygons, which, self.segments, who)
        self.mark(who[hit], which[hit])

    def mark(self, segment: IntArray, polygon: IntArray) -> None:
        """Mark segments that are blocked by polygons."""
        self.blocked[segment] = True


def _last(index: list[IntArray], node: list[IntArray]) -> tuple[IntArray, IntArray]:
    """Take the pairs that came last, about as many as go on together."""
    taken, ones, nodes = 0, [], []
    while index and taken < TOGETHER:
        one, here = index.pop(), node.pop()
        spare = taken + len(one) - TOGETHER
        if spare > 0:
            index.append(one[:spare])
            node.append(here[:spare])
            one, here = one[spare:], here[spare:]
        taken += len(one)
        ones.append(one)
        nodes.append(here)
    return np.concatenate(ones), np.concatenate(nodes)


def _hit(polygons: Polygons, which: IntArray, segments: SingleArray, who: IntArray) -> IntArray:
    """Return the pairs of a polygon and a segment that block."""
    rows = polygons.rows

    def functions(pairs: IntArray | slice, number: int) -> tuple[SingleArray, SingleArray]:
        """Return a function of the polygons at the middles of the segments, and how much more it is at the ends."""
        row = rows[number].take(which[pairs], axis=0).T
        at = segments[:7].take(who[pairs], axis=1)
        rise = row[0] * at[4] + row[1] * at[5] + row[2] * at[6]
        return row[0] * at[0] + row[1] * at[1] + row[2] * at[2] + row[3], rise

    height, rise = functions(slice(None), 0)
    across = np.flatnonzero(np.abs(height) + polygons.margin.take(which) < np.abs(rise))
    back = height[across] / rise[across]
    flat = polygons.parallelogram.take(which[across])
    inside = np.ones(len(across), dtype=bool)
    for number in (1, 2, 3):
        at, along = functions(across, number)
        at -= back * along
        # A parallelogram's coordinates are -1 to 1 inside, and it has two of them.
        inside &= np.where(flat, (np.abs(at) <= 1.0) | (number == 3), at >= 0.0)
    return across[inside]
