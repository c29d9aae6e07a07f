# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles and parallelograms in a tree of boxes, as arrays that many segments at once are tested against.

Polygons are linear functions of a point, so that testing is two matrix products and a few comparisons. The tree is a
binary one, `box_tree`; where many segments come, its nodes are taken together to wide ones, when they are first asked
for. Source: Wald, Benthin, Boulos 2008 (wide trees).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray, SingleArray
from .box_tree import BoxTree, box_tree
from .surfaces import GROWTH

# Polygons in a leaf and children of a node, for streams: where the cost of starting and that of going on are about the
# same.
LEAF = 16
CHILDREN = 12
# Polygons in a leaf of the binary tree.
TWIG = 4


@dataclass(frozen=True, eq=False)
class Leaf:
    """Parallelograms and triangles as linear functions of a point (x, y, z, 1), stacked.

    Of a parallelogram: height over the plane, and two coordinates that are -1 to 1 inside. Of a triangle: height, and
    depth inside each of the three edges. `margin`: heights up to which an end counts as on the surface.
    """

    parallelograms: SingleArray  # (3k, 4)
    parallelogram_margin: SingleArray  # (k, 1)
    triangles: SingleArray  # (4j, 4)
    triangle_margin: SingleArray  # (j, 1)


@dataclass(frozen=True, eq=False)
class Node:
    """Boxes and what is in them: nodes of the binary tree."""

    low: SingleArray  # (c, 3)
    high: SingleArray  # (c, 3)
    children: list[int]


@dataclass(frozen=True, eq=False)
class Polygons:
    """Polygons in the order of the tree's leaves, as `Leaf` describes them.

    Attributes
    ----------
    rows : ndarray of shape (4, n, 4)
        First functions of all, then second ones, and so on; a parallelogram has only three.
    margin : ndarray of shape (n,)
    parallelogram : ndarray of shape (n,)
    first : ndarray of shape (n,)
        The triangle that each is, or begins with.
    """

    rows: SingleArray
    margin: SingleArray
    parallelogram: BoolArray
    first: IntArray


@dataclass(frozen=True, eq=False)
class Tree:
    """A tree over polygons.

    Attributes
    ----------
    boxes : BoxTree
        Node 0 is its root.
    polygons : Polygons
    """

    boxes: BoxTree
    polygons: Polygons
    _wide: dict[int, Node | Leaf] = field(default_factory=dict)

    def wide(self, node: int) -> Node | Leaf:
        """Return a node of the binary tree as a wide one, or a leaf where only a few polygons are below it."""
        found = self._wide.get(node)
        if found is None:
            # Two threads may do this at a time: both get the same.
            found = self._wide[node] = self._taken_together(node)
        return found

    def _taken_together(self, node: int) -> Node | Leaf:
        tree = self.boxes
        if tree.stop[node] - tree.start[node] <= LEAF or tree.child[node] < 0:
            return self._leaf(slice(tree.start[node], tree.stop[node]))
        # The heaviest part is split until there are enough. What blocks most comes first: the segments that it blocks
        # need not look further.
        parts = [(self._weight(node), node)]
        while len(parts) < CHILDREN:
            inner = (k for k, (_, part) in enumerate(parts) if tree.stop[part] - tree.start[part] > LEAF)
            heaviest = next((k for k in inner if tree.child[parts[k][1]] >= 0), None)
            if heaviest is None:
                break
            first = int(tree.child[parts.pop(heaviest)[1]])
            parts += [(self._weight(child), child) for child in (first, first + 1)]
            parts.sort(key=lambda part: -part[0])
        children = [part for _, part in parts]
        return Node(tree.low[:, children].T.copy(), tree.high[:, children].T.copy(), children)

    def _leaf(self, members: slice) -> Leaf:
        """Return the functions of a few polygons, those of a kind together."""
        rows, margin = self.polygons.rows[:, members], self.polygons.margin[members, None]
        flat = self.polygons.parallelogram[members]
        return Leaf(
            rows[:3, flat].reshape(-1, 4),
            margin[flat],
            rows[:, ~flat].reshape(-1, 4),
            margin[~flat],
        )

    def _weight(self, node: int) -> float:
        """Return the chance that a segment gets to a node's box, times what it costs there."""
        x, y, z = (self.boxes.high[:, node] - self.boxes.low[:, node]).tolist()
        return float((x * y + y * z + z * x) * (self.boxes.stop[node] - self.boxes.start[node]))


def planted(corners: FloatArray, margin: FloatArray) -> Tree | None:
    """Grow a tree.

    Parameters
    ----------
    corners : ndarray of shape (t, 3, 3)
        Triangles; two that follow each other and make a parallelogram become one [scene's diagonals].
    margin : ndarray of shape (t,)
        Height over each up to which an end of a segment lies on it [scene's diagonals].

    Returns
    -------
    Tree or None
        None over nothing.
    """
    if len(corners) == 0:
        return None
    first = _pairs(corners)
    lone = np.ones(len(corners), dtype=bool)
    lone[first] = lone[first + 1] = False
    half = np.concatenate([corners[first], corners[lone]])
    levels = np.concatenate([margin[first], margin[lone]]).astype(np.float32)
    ends = np.concatenate([corners[first + 1, 2], half[len(first) :, 2]])[:, None]
    everything = np.concatenate([half, ends], axis=1)
    # Surfaces reach a little over their edges, and single precision has its own opinion.
    pad = GROWTH + 1e-6 * np.maximum(1.0, 2.0 * np.abs(everything).max(axis=(1, 2)))[:, None]
    low, high = everything.min(axis=1) - pad, everything.max(axis=1) + pad
    boxes = box_tree(low.astype(np.float32), high.astype(np.float32), TWIG)
    rows: SingleArray = np.ascontiguousarray(_edges(half, len(first))[boxes.order].transpose(1, 0, 2)).astype(
        np.float32
    )
    triangle = np.concatenate([first, np.flatnonzero(lone)])[boxes.order]
    return Tree(boxes, Polygons(rows, levels[boxes.order], boxes.order < len(first), triangle))


def _pairs(corners: FloatArray) -> IntArray:
    """Return the triangles that make a parallelogram with the one after them, none of them twice."""
    one, other = corners[:-1], corners[1:]
    shared = (one[:, 0] == other[:, 0]).all(axis=1) & (one[:, 2] == other[:, 1]).all(axis=1)
    opposite = one[:, 0] + one[:, 2] - one[:, 1] - other[:, 2]
    match = np.concatenate([shared & (np.abs(opposite).max(axis=1) <= 0.1 * GROWTH), [False]])
    # In a row of matches every other one counts.
    place = np.arange(len(match))
    begin = np.maximum.accumulate(np.where(match & ~np.roll(match, 1), place, 0))
    return np.flatnonzero(match & ((place - begin) % 2 == 0))


def _edges(half: FloatArray, parallelograms: int) -> FloatArray:
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
