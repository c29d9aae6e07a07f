# SPDX-License-Identifier: GPL-3.0-or-later
"""A wide tree over triangles and parallelograms, as arrays that many segments at once are tested against.

Polygons are linear functions of a point, so that testing is two matrix products and a few comparisons.
Sources: Goldsmith, Salmon 1987 (the surface area heuristic); Wald, Benthin, Boulos 2008 (wide trees).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .surfaces import GROWTH

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]

# Polygons in a leaf and children of a node: where the cost of starting and that of going on are about the same.
LEAF = 16
CHILDREN = 12


@dataclass(frozen=True, eq=False)
class Leaf:
    """Parallelograms and triangles as linear functions of a point (x, y, z, 1), stacked.

    Of a parallelogram: height over the plane, and two coordinates that are -1 to 1 inside. Of a triangle: height, and
    depth inside each of the three edges. `margin`: heights up to which an end counts as on the surface.
    """

    parallelograms: Singles  # (3k, 4)
    parallelogram_margin: Singles  # (k, 1)
    triangles: Singles  # (4j, 4)
    triangle_margin: Singles  # (j, 1)


@dataclass(frozen=True, eq=False)
class Node:
    """Boxes and what is in them."""

    low: Singles  # (c, 3)
    high: Singles  # (c, 3)
    children: list[Node | Leaf]


def planted(corners: Floats, margin: Floats) -> Node | Leaf | None:
    """Grow a tree.

    Parameters
    ----------
    corners : ndarray of shape (t, 3, 3)
        Triangles; two that follow each other and make a parallelogram become one [scene's diagonals].
    margin : ndarray of shape (t,)
        Height over each up to which an end of a segment lies on it [scene's diagonals].

    Returns
    -------
    Node, Leaf or None
        None over nothing.
    """
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


def _grown(polygons: _Polygons, members: Ints) -> Node | Leaf:
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
    return Node(low, high, [_grown(polygons, group) for group in groups])


def _leaf(polygons: _Polygons, members: Ints) -> Leaf:
    """Return the functions of a few polygons, those of a kind together."""
    flat, sharp = members[members < polygons.parallelograms], members[members >= polygons.parallelograms]
    rows, margin = polygons.rows, polygons.margin[:, None]
    return Leaf(
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
