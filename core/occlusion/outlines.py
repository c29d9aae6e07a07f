# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of groups of coplanar faces.

A border that two faces of a group share cancels; what is left runs round the group's union in closed loops, however
finely the group is meshed. A loop that only turns left is one convex polygon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..runs import counted


@dataclass(frozen=True, eq=False)
class Loops:
    """Closed loops, the inside on their left, sorted by group.

    Attributes
    ----------
    vertex : ndarray of shape (e,)
        Corners in the order of the loops.
    start : ndarray of shape (l + 1,)
        First corner of each loop; the last entry is e.
    group : ndarray of shape (l,)
        The group that each loop bounds.
    """

    vertex: IntArray
    start: IntArray
    group: IntArray

    def following(self) -> IntArray:
        """Return the index of the corner after each one, shape (e,)."""
        after = np.arange(1, len(self.vertex) + 1)
        after[self.start[1:] - 1] = self.start[:-1]
        return after

    def corner_loop(self) -> IntArray:
        """Return the loop of each corner, shape (e,)."""
        return np.repeat(np.arange(len(self.group)), np.diff(self.start))

    def keep(self, corners: BoolArray) -> Loops:
        """Return the loops with only some of their corners; loops of fewer than three vanish."""
        loop = self.corner_loop()
        corners = corners & (np.bincount(loop[corners], minlength=len(self.group)) >= 3)[loop]
        size = np.bincount(loop[corners], minlength=len(self.group))
        start = np.concatenate([[0], np.cumsum(size[size > 0])])
        return Loops(self.vertex[corners], start, self.group[size > 0])


def edge_runs(tail: IntArray, head: IntArray, group: IntArray | None = None) -> tuple[IntArray, BoolArray]:
    """Sort edges so that those between the same two vertices stand together.

    Parameters
    ----------
    tail, head : ndarray of shape (e,)
        The vertices that each edge runs between.
    group : ndarray of shape (e,), optional
        Edges of different groups stay apart.

    Returns
    -------
    order : ndarray of shape (e,)
        Edges in their new order.
    first : ndarray of shape (e,)
        Where in that order a new pair of vertices begins.
    """
    stride = int(np.max(np.append(tail, head), initial=0)) + 1
    key = np.minimum(tail, head) * stride + np.maximum(tail, head)
    order = np.argsort(key, kind="stable") if group is None else np.lexsort((key, group))
    first = np.diff(key[order], prepend=-1) != 0
    if group is not None:
        first |= np.diff(group[order], prepend=-1) != 0
    return order, first


def outlines(tail: IntArray, head: IntArray, group: IntArray, n_groups: int) -> tuple[Loops, BoolArray]:
    """Return the borders of groups of faces.

    Parameters
    ----------
    tail, head : ndarray of shape (e,)
        Directed edges of all faces of the groups, each face counter-clockwise.
    group : ndarray of shape (e,)
        The group of the face of each edge, 0 to `n_groups` - 1.
    n_groups : int

    Returns
    -------
    loops : Loops
        Of the sound groups.
    sound : ndarray of shape (n_groups,)
        False for groups that overlap themselves along an edge or touch themselves in a single vertex.
    """
    order, first = edge_runs(tail, head, group)
    run = np.cumsum(first) - 1
    members = np.bincount(run)
    forward = np.bincount(run, weights=tail[order] < head[order])
    sound = np.ones(n_groups, dtype=bool)
    tangled = (members > 2) | ((members == 2) & (forward != 1))
    sound[group[order][tangled[run]]] = False
    edges = order[(members == 1)[run]]

    # The edge after an edge starts where that one ends; two that start there are a touch.
    by_tail = edges[np.lexsort((tail[edges], group[edges]))]
    touch = (tail[by_tail][1:] == tail[by_tail][:-1]) & (group[by_tail][1:] == group[by_tail][:-1])
    sound[group[by_tail][1:][touch]] = False
    edges = by_tail[sound[group[by_tail]]]
    stride = int(np.max(np.append(tail, head), initial=0)) + 1
    start_key, end_key = group[edges] * stride + tail[edges], group[edges] * stride + head[edges]
    after = np.searchsorted(start_key, end_key)
    loop, rank = _along(after)
    place = np.lexsort((rank, loop))
    loop, edges = loop[place], edges[place]
    begins = np.flatnonzero(np.diff(loop, prepend=-1))
    return Loops(tail[edges], np.append(begins, len(edges)), group[edges[begins]]), sound


def _along(after: IntArray) -> tuple[IntArray, IntArray]:
    """Return each entry's cycle (its smallest member) and the steps from there, for a permutation.

    By doubling the stride, so that a loop of n corners takes log n rounds.
    """
    n = len(after)
    cycle, jump = np.arange(n), after
    while True:
        smaller = np.minimum(cycle, cycle[jump])
        if np.array_equal(smaller, cycle):
            break
        cycle, jump = smaller, jump[jump]
    # Cut each cycle before its smallest member, then count the steps that are left to the cut.
    last = cycle[after] == after
    jump = np.where(last, np.arange(n), after)
    steps = np.where(last, 0, 1)
    while True:
        further = steps + steps[jump]
        if np.array_equal(further, steps):
            break
        steps, jump = further, jump[jump]
    return cycle, -steps


def straightened(loops: Loops, points: FloatArray, tolerance: float) -> Loops:
    """Leave out corners at which a loop runs straight on.

    Parameters
    ----------
    loops : Loops
    points : ndarray of shape (e, 2)
        Positions of the corners in the plane of their group.
    tolerance : float
        How far from the line between its neighbours such a corner may lie [unit of `points`].

    Returns
    -------
    Loops
        Loops of which fewer than three corners would be left vanish.
    """
    after = loops.following()
    before = np.zeros_like(after)
    before[after] = np.arange(len(after))
    back, forth = points - points[before], points[after] - points
    span = np.linalg.norm(back + forth, axis=1)
    ahead = (back * forth).sum(axis=1) > 0
    return loops.keep(~(ahead & (np.abs(cross(back, forth)) <= tolerance * span)))


def loop_areas(loops: Loops, points: FloatArray) -> FloatArray:
    """Return the signed area of every loop, shape (l,)."""
    # From each loop's first corner, so that small loops far from the origin keep their digits.
    arm = points - points[loops.start[:-1]][loops.corner_loop()]
    twice = cross(arm, arm[loops.following()])
    return np.asarray(0.5 * np.bincount(loops.corner_loop(), weights=twice, minlength=len(loops.group)))


def convex(loops: Loops, points: FloatArray) -> BoolArray:
    """Return which loops turn left at every corner, once round in all, shape (l,)."""
    after = loops.following()
    forth = points[after] - points
    back = np.zeros_like(forth)
    back[after] = forth
    turn = np.arctan2(cross(back, forth), (back * forth).sum(axis=1))
    loop = loops.corner_loop()
    left = np.bincount(loop, weights=turn <= 0, minlength=len(loops.group)) == 0
    whole = np.bincount(loop, weights=turn, minlength=len(loops.group))
    return np.asarray(left & (np.abs(whole - 2 * np.pi) < 1e-3))


def fans(loops: Loops, chosen: BoolArray) -> tuple[IntArray, IntArray]:
    """Cut convex loops into quads that share their first corner.

    Parameters
    ----------
    loops : Loops
    chosen : ndarray of shape (l,)
        Which loops.

    Returns
    -------
    quads : ndarray of shape (q, 4)
        Vertices; a triangle repeats its last one.
    loop : ndarray of shape (q,)
        The loop of each quad.
    """
    size = np.diff(loops.start)
    count = np.where(chosen, (size - 1) // 2, 0)
    loop, turn = counted(count)
    steps = np.stack([0 * turn, 2 * turn + 1, 2 * turn + 2, np.minimum(2 * turn + 3, size[loop] - 1)], axis=1)
    return loops.vertex[loops.start[loop][:, None] + steps], loop


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product of plane vectors."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
