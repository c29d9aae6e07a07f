# SPDX-License-Identifier: GPL-3.0-or-later
"""Links: which cluster is one source for which group of receivers.

All groups walk the hierarchy of sources at once, level by level, as arrays of (group, node) pairs. A pair below the
group's horizon or behind the node is dropped; a pair whose error would be seen is opened; the rest are links.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .receivers import Receivers
from .sources import Sources
from .tree import Float, Int

# What a curved cluster's quadrature points stand for may bend by this sine in the end; by more, if it carries little.
_BEND = 0.35
# Clipping at the rim of a curved cluster always loses light, which does not even out as other errors do.
_FRINGE = 10.0


# A cluster of several walls shines into each direction with its mean: only if its parts differ by less than this.
_UNEVEN = 0.25


@dataclass(frozen=True, eq=False)
class Links:
    """Pairs of a group and a node, sorted by group.

    Attributes
    ----------
    group, node : ndarray of shape (k,)
    form_factor : ndarray of shape (k,)
        An upper estimate, by the group's centre.
    near : ndarray of shape (k,)
        True for leaves so close that only the exact kernel will do.
    """

    group: Int
    node: Int
    form_factor: Float
    near: NDArray[np.bool_]


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

    Returns
    -------
    Links
    """
    tree = sources.tree
    g, s = groups, np.zeros(len(groups), np.int64)
    found: list[tuple[Int, Int, Float, NDArray[np.bool_]]] = []
    while len(g):
        seen, form_factor, ratio = _look(receivers, g, sources, s)
        g, s, form_factor, ratio = g[seen], s[seen], form_factor[seen], ratio[seen]
        leaf = tree.child[s] < 0
        carried = form_factor * brightness[s] if need is None else form_factor * brightness[s] * need[g]
        # A curved cluster's points are centroids, not Gauss's: as good as those of a flat one twice as large.
        ratio = np.where(sources.flat[s], ratio, 2 * ratio)
        fine = (ratio < angle) & (carried * np.minimum(ratio, 1) ** 2 < error)
        fine &= (sources.bend[s] < _BEND) | (_FRINGE * carried * sources.bend[s] ** 2 < error)
        if uneven is not None:
            fine &= sources.flat[s] | (uneven[s] < _UNEVEN)
        done = leaf | fine
        found.append((g[done], s[done], form_factor[done], ~fine[done]))
        g, s = np.repeat(g[~done], 2), np.column_stack((tree.child[s[~done]], tree.child[s[~done]] + 1)).ravel()
    group, node, form_factor, near = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((node, group))
    return Links(group[order], node[order], form_factor[order], near[order])


def unevenness(sources: Sources, brightness: Float) -> Float:
    """Return by how much the parts that a node's quadrature points stand for differ from it, over its brightness."""
    parts = np.abs(brightness[sources.below] - brightness[:, None]).max(axis=1)
    uneven: Float = parts / np.maximum(brightness, 1e-300)
    return uneven


def _look(receivers: Receivers, g: Int, sources: Sources, s: Int) -> tuple[NDArray[np.bool_], Float, Float]:
    """Return which pairs see each other at all, their form factor's estimate and the node's radius over distance."""
    axis, normal = receivers.axis[g], sources.normal[s]
    half, spread = sources.half[s], receivers.radius[g]
    apart = sources.middle[s] - receivers.centre[g]
    reach = np.sqrt((apart * apart).sum(axis=1)) + np.sqrt((half * half).sum(axis=1)) + spread
    # The highest that any point of the node stands above any receiver's horizon.
    height = (axis * apart).sum(axis=1) + (np.abs(axis) * half).sum(axis=1)
    height += receivers.depth[g] + receivers.cone[g] * reach
    # The furthest that any receiver stands before the node's plane, in which its centroid lies if it is flat.
    to = sources.centre[s] - receivers.centre[g]
    front = np.where(sources.flat[s], -(normal * to).sum(axis=1), (np.abs(normal) * half - normal * apart).sum(axis=1))
    cosine = np.abs((axis * normal).sum(axis=1))
    front += spread * np.sqrt(np.maximum(1 - cosine * cosine, 0)) + receivers.depth[g] + sources.cone[s] * reach
    seen = (height > 1e-7 * reach) & (front > 1e-7 * reach)
    distance = np.maximum(np.sqrt((to * to).sum(axis=1)) - spread, 1e-3 * sources.radius[s] + 1e-300)
    cosines = np.clip(height / distance, 0, 1) * np.clip(front / distance, 0, 1)
    return seen, np.minimum(sources.facing[s] * cosines / (np.pi * distance**2), 1), sources.radius[s] / distance
