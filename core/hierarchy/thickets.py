# SPDX-License-Identifier: GPL-3.0-or-later
"""Thickets: among leaves, grass or shelves a receiver might see thousands of things, and sees a few dozen of them.

There nearly every ray to a source ends at something else. Rays that go anywhere end at what is seen, so what they meet
first are the links, as in a path tracer's final gather (Ward, Rubinstein, Clear 1988). Only what is bright, and what
rays pass through, is linked as everywhere else.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..runs import counted
from ..visibility import Occluders, dimmed
from .element_hits import ElementHits
from .links import Links
from .probes import ways_round
from .quality import Detail
from .receivers import Receivers
from .rows import BRIGHT, MUCH, Rows
from .tree import Float, Int, Tree

# A ray stands for this share of what gets one more ray of a link.
_SHARE = 0.25
# ... and there are so many at least: the few samples that tell roughly where light is speak for all.
_LEAST = 100
# Links that a receiver may have for each ray before rays are the quicker way.
_WORTH = 4


@dataclass(frozen=True, eq=False)
class Thickets:
    """How to see in thickets.

    Attributes
    ----------
    tree : Tree
        Of the elements.
    hits : ElementHits
    linked : ndarray of shape (m,)
        Nodes that are linked everywhere: something below them is bright, or blocks nothing.
    leaf : ndarray of shape (n,)
        The node that each element is.
    """

    tree: Tree
    hits: ElementHits
    linked: NDArray[np.bool_]
    leaf: Int


def find_thickets(tree: Tree, brightness: Float, hits: ElementHits) -> Thickets:
    """Tell how to see in thickets.

    Parameters
    ----------
    tree : Tree
        Of the elements.
    brightness : ndarray of shape (m,)
        Of its nodes, see `Scenery`.
    hits : ElementHits

    Returns
    -------
    Thickets
    """
    leaf = tree.at_elements(np.arange(len(tree.child)))
    linked = (brightness[leaf] > BRIGHT) | ~hits.blocks
    return Thickets(tree, hits, tree.sums(linked[:, None].astype(float))[:, 0] > 0, leaf)


def rays_of(detail: Detail) -> int:
    """Return how many rays a receiver in a thicket casts."""
    return max(round(1 / (_SHARE * detail.ray)), _LEAST)


def most_links(detail: Detail) -> int:
    """Return how many links a group of receivers may have without being in a thicket."""
    return _WORTH * rays_of(detail)


def thicket_rows(
    receivers: Receivers,
    groups: Int,
    links: Links,
    thickets: Thickets,
    occluders: Occluders,
    detail: Detail,
) -> Rows:
    """Compute the rows of groups that are in thickets, but for what is linked; empty ones for the others.

    Parameters
    ----------
    receivers : Receivers
    groups : ndarray of shape (g,)
        Ascending.
    links : Links
        Of those groups: what they hold is not looked at again.
    thickets : Thickets
    occluders : Occluders
        Whose panes dim light.
    detail : Detail

    Returns
    -------
    Rows
    """
    count, nodes = np.diff(receivers.first)[groups], len(thickets.tree.child)
    seen = _looked_round(receivers, groups, links, thickets, occluders, rays_of(detail))
    # One link for all rays of a group that meet the same element.
    key, link = np.unique(seen.at * nodes + seen.leaf, return_inverse=True)
    own, node = np.divmod(key, nodes)
    begin = np.cumsum(count[own]) - count[own]
    slot = begin[link.reshape(-1)] + seen.receiver - receivers.first[groups[seen.at]]
    total = int(count[own].sum())
    weight = np.bincount(slot, seen.share, total)
    large = np.flatnonzero(weight > MUCH)
    middle = np.stack([np.bincount(slot, seen.share * axis, total)[large] / weight[large] for axis in seen.place.T], 1)
    sums = np.zeros((int(count.sum()), 2))
    sums[:, 1] = np.bincount(seen.receiver - receivers.first[groups[0]], seen.left, len(sums))
    first = np.searchsorted(own, np.arange(len(groups) + 1))
    return Rows(
        group=groups,
        first=first,
        node=node,
        begin=np.append(begin, total)[first],
        weight=weight.astype(np.float32),
        sums=sums,
        large=large,
        middle=middle,
        rays=seen.cast,
    )


class _Seen(NamedTuple):
    """What rays meet of what is not linked."""

    receiver: Int  # (k,)
    at: Int  # (k,), where in the list of groups the receiver's is
    leaf: Int  # (k,), the node that is met
    place: Float  # (k, 3) [m]
    share: Float  # (k,) of what is seen that the ray stands for, as it is dimmed by panes
    left: Float  # (k,) the same, but for what panes fill themselves
    cast: int


def _looked_round(
    receivers: Receivers, groups: Int, links: Links, thickets: Thickets, occluders: Occluders, rays: int
) -> _Seen:
    """Cast rays from all receivers that are in thickets; parameters as of `thicket_rows`."""
    thick = np.flatnonzero(links.thick)
    at, receiver = counted(np.diff(receivers.first)[groups[thick]], receivers.first[groups[thick]])
    way = ways_round(np.repeat(receivers.normal[receiver, None], rays, axis=1), receiver).reshape(-1, 3)
    receiver, at = np.repeat(receiver, rays), np.repeat(thick[at], rays)
    origin = receivers.point[receiver]
    element, distance = thickets.hits.met(origin, way)
    met = np.flatnonzero(element >= 0)
    leaf = thickets.leaf[element[met]]
    free = ~_held(links, groups[at[met]], leaf, thickets.tree)
    met, leaf = met[free], leaf[free]
    place = origin[met] + distance[met, None] * way[met]
    share, left = dimmed(origin[met], place, np.ones(len(met), bool), occluders)
    return _Seen(receiver[met], at[met], leaf, place, share / rays, left / rays, len(origin))


def _held(links: Links, group: Int, leaf: Int, tree: Tree) -> NDArray[np.bool_]:
    """Return which leaves are below nodes that their groups are linked to, shape (k,)."""
    if not len(links.group):
        return np.zeros(len(leaf), bool)
    n = len(tree.order) + 1
    # The nodes of a group do not overlap: the last that begins before a leaf is the one that may hold it.
    start = links.group * n + tree.start[links.node]
    order = np.argsort(start)
    at = np.searchsorted(start[order], group * n + tree.start[leaf], side="right") - 1
    link = order[np.maximum(at, 0)]
    held: NDArray[np.bool_] = (
        (at >= 0) & (links.group[link] == group) & (tree.start[leaf] < tree.stop[links.node[link]])
    )
    return held
