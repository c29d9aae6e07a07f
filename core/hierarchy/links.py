# SPDX-License-Identifier: GPL-3.0-or-later
"""Links: which cluster is one source for which group of receivers.

All groups walk the hierarchy of sources at once, level by level, as arrays of (group, node) pairs. A pair below the
group's horizon or behind the node is dropped; a pair whose error would be seen is opened; the rest are links.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .receivers import Receivers
from .sources import Sources, most_shown_area
from .tree import Float, Int
from .vectors import dots, picked

# A cluster of several walls shines into each direction with its mean. It may if this many times what its parts differ
# by is no more than other errors.
_UNEVENLY = 2.0
# A wall shines as its mean from end to end: from its dim end, too, which others see that do not see the bright one, so
# light seems to spread faster than it does. All such errors add up, as those of far shapes do not: so many times more.
_GRADED = 16.0
# What carries this many times less than would be opened may be as near as this share of its radius, whatever the angle:
# of what a receiver nearly touches it sees much, however little its middle says.
_DIM = 4.0
_NEAREST = 0.5
# Receivers of a group are nearer to a node than its middle is, down to this share of that distance.
_WITHIN = 0.3
# A wide cluster may be as near as its radius over this, at any quality: its nearest and its farthest parts are seen by
# one ray. One that carries this many times less may be nearer.
_WIDE, _FAINT = 0.4, 16.0
# What a group might see comes to so many times all that there is round it, at least, in a thicket.
_DENSE = 4.0


@dataclass(frozen=True, eq=False)
class Links:
    """Pairs of a group and a node, sorted by group.

    Attributes
    ----------
    group, node : ndarray of shape (k,)
    form_factor : ndarray of shape (k,)
        An estimate, rather high, by the group's centre.
    near : ndarray of shape (k,)
        True for leaves so close that only the exact kernel will do.
    thick : ndarray of shape (g,)
        Groups in thickets: of what they see only some is linked.
    """

    group: Int
    node: Int
    form_factor: Float
    near: NDArray[np.bool_]
    thick: NDArray[np.bool_]


def find_links(
    receivers: Receivers,
    groups: Int,
    sources: Sources,
    brightness: Float,
    *,
    angle: float,
    error: float,
    uneven: Float | None = None,
    need: Float | None = None,
    linked: NDArray[np.bool_] | None = None,
    most: int = 0,
) -> Links:
    """Walk the hierarchy for some groups.

    Parameters
    ----------
    receivers : Receivers
    groups : ndarray of shape (g,)
        Which of their groups.
    sources : Sources
    brightness : ndarray of shape (m,)
        Radiosity of each node over the irradiance that matters at a receiver, dimensionless.
    angle : float
        A node is opened when its radius exceeds this times its distance.
    error : float
        A node is opened when its estimated error, as a share of a receiver's irradiance, exceeds this.
    uneven : ndarray of shape (m,), optional
        How much the parts of each node differ in brightness, see `unevenness`; not at all when not given.
    need : ndarray of shape (groups of `receivers`,), optional
        How many times as much an error counts at each group as where light is typical.
    linked : ndarray of shape (m,), optional
        Nodes that groups in thickets are linked to, too; when not given there are no thickets.
    most : int
        Links that a group has everywhere else, however much it might see.

    Returns
    -------
    Links
    """
    tree = sources.tree
    g, s = groups, np.zeros(len(groups), np.int64)
    found: list[tuple[Int, Int, Float, NDArray[np.bool_]]] = []
    crowd = _Crowd(groups, most)
    while len(g):
        seen, form_factor, radius, apart = _look(receivers, g, sources, s)
        g, s, form_factor, radius, apart = g[seen], s[seen], form_factor[seen], radius[seen], apart[seen]
        if linked is not None:
            crowd.count(g, form_factor)
            kept = linked[s] | ~crowd.thick(g)
            g, s, form_factor, radius, apart = g[kept], s[kept], form_factor[kept], radius[kept], apart[kept]
        leaf = tree.child[s] < 0
        carried = form_factor * brightness[s] if need is None else form_factor * brightness[s] * need[g]
        # A curved cluster's points are centroids, not Gauss's: as good as those of a flat one twice as large.
        ratio = np.where(sources.flat[s], radius, 2 * radius)
        missed = carried * np.minimum(ratio, 1) ** 2
        fine = (missed < error) & ((ratio < angle) | (apart & (_DIM * missed < error)))
        # A wide one is told by rays alone, whatever the angle; all that it carries counts as missed.
        ample = (carried < error) & ((radius < _WIDE) | (apart & (_FAINT * carried < error)))
        fine = np.where(sources.wide[s], ample, fine)
        if uneven is not None:
            amiss = np.where(sources.flat[s], _GRADED * np.minimum(ratio, 1), _UNEVENLY)
            fine &= amiss * uneven[s] * carried < error
        done = leaf | fine
        found.append((g[done], s[done], form_factor[done], ~fine[done]))
        if linked is not None:
            crowd.keep(g[done], form_factor[done])
        g, s = np.repeat(g[~done], 2), np.column_stack((tree.child[s[~done]], tree.child[s[~done]] + 1)).ravel()
    group, node, form_factor, near = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((node, group))
    if linked is not None:
        # What was found before a group turned out to be in a thicket.
        order = order[(linked[node] | ~crowd.thick(group))[order]]
    return Links(group[order], node[order], form_factor[order], near[order], crowd.thick(groups))


class _Crowd:
    """Counts what groups might see, level by level, and tells who is in a thicket."""

    def __init__(self, groups: Int, most: int) -> None:
        # Ascending: numbered from the first.
        self._first, last = (int(groups[0]), int(groups[-1])) if len(groups) else (0, 0)
        self._most, self._held = most, np.zeros((2, last - self._first + 1))
        self._thick = np.zeros(self._held.shape[1], bool)

    def thick(self, group: Int) -> NDArray[np.bool_]:
        """Return which of some groups have turned out to be in a thicket."""
        return self._thick[group - self._first]

    def count(self, group: Int, form_factor: Float) -> None:
        """Count the pairs of a level, with the links that there are by now."""
        pairs, filled = self._with(group, form_factor)
        self._thick |= (pairs > self._most) & (filled > _DENSE)

    def keep(self, group: Int, form_factor: Float) -> None:
        """Count pairs as links."""
        self._held = self._with(group, form_factor)

    def _with(self, group: Int, form_factor: Float) -> Float:
        """Return the number of links and the sum of their form factors, with some more, shape (2, groups)."""
        at, count = group - self._first, self._held.shape[1]
        return self._held + [np.bincount(at, minlength=count), np.bincount(at, form_factor, count)]


def unevenness(sources: Sources, brightness: Float) -> Float:
    """Return by how much parts of a node differ from it, over its brightness: halves of flat ones, else quarters."""
    half = np.where((sources.tree.child >= 0) & sources.flat, sources.tree.child, np.arange(len(brightness)))
    # Siblings lie side by side.
    other = np.where(half > np.arange(len(half)), half + 1, half)
    parts = np.column_stack((brightness[sources.below], brightness[half], brightness[other]))
    parts = np.abs(parts - brightness[:, None]).max(axis=1)
    uneven: Float = parts / np.maximum(brightness, 1e-300)
    return uneven


def _look(
    receivers: Receivers, g: Int, sources: Sources, s: Int
) -> tuple[NDArray[np.bool_], Float, Float, NDArray[np.bool_]]:
    """Return what pairs see of each other.

    Returns
    -------
    seen : ndarray of shape (k,)
        Which see each other at all.
    form_factor : ndarray of shape (k,)
        An estimate.
    ratio : ndarray of shape (k,)
        The node's radius over its distance.
    apart : ndarray of shape (k,)
        Whether no end of the node is very near.
    """
    axis, normal, at = picked(receivers.axis, g), picked(sources.normal, s), picked(receivers.centre, g)
    half, spread = picked(sources.half, s), receivers.radius[g]
    apart = picked(sources.middle, s) - at
    reach = np.sqrt(dots(apart, apart)) + np.sqrt(dots(half, half)) + spread
    # The highest that any point of the node stands above any receiver's horizon.
    height = dots(axis, apart) + dots(np.abs(axis), half)
    height += receivers.depth[g] + receivers.cone[g] * reach
    # The furthest that any receiver stands before the node's plane, in which its centroid lies if it is flat.
    to = picked(sources.centre, s) - at
    flat, before = sources.flat[s], -dots(normal, to)
    front = np.where(flat, before, dots(np.abs(normal), half) - dots(normal, apart))
    cosine = np.abs(dots(axis, normal))
    aside = spread * np.sqrt(np.maximum(1 - cosine * cosine, 0)) + receivers.depth[g]
    front += aside + sources.cone[s] * reach
    seen = (height > 1e-7 * reach) & (front > 1e-7 * reach)
    # What a receiver that is placed rather well gets: bounds on all of them would be too large by far.
    length = np.maximum(np.sqrt(dots(to, to)), 1e-9 * sources.radius[s] + 1e-300)
    distance = np.maximum(length - spread, _WITHIN * length)
    above = _rather(dots(axis, to), sources.radius[s] + receivers.depth[g] + receivers.cone[g] * length)
    facing = sources.area[s] * _rather(before, aside) / length
    shown = np.where(flat, facing, most_shown_area(sources, s, -to / length[:, None]))
    form_factor = shown * np.minimum(above / length, 1) / np.maximum(np.pi * distance * distance + shown, 1e-300)
    # A node of no compact shape, such as all that something stands on, is as near as its nearest end.
    gaps = np.maximum(np.abs(apart) - half, 0)
    gap = np.sqrt(dots(gaps, gaps))
    reached = np.minimum(length, gap + sources.radius[s])
    near = np.maximum(reached - spread, 1e-3 * sources.radius[s] + 1e-300)
    return seen, form_factor, sources.radius[s] / near, gap - spread > _NEAREST * sources.radius[s]


def _rather(height: Float, reach: Float) -> Float:
    """Return how far above a horizon things are that spread by `reach` about a height, of the higher ones."""
    higher = height + 0.5 * reach
    above = np.clip(higher + reach, 0, 2 * reach)
    rather: Float = np.where(higher > reach, higher, above * above / np.maximum(4 * reach, 1e-300))
    return rather
