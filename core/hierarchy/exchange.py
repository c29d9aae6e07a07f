# SPDX-License-Identifier: GPL-3.0-or-later
"""How rows are computed: links, form factors, lots among the dim, and rays for how much gets through."""

from collections.abc import Iterator
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray

from ..runs import counted
from ..workers import in_order
from .kernels import Single, far_form_factors, near_form_factors
from .links import Links
from .lots import draw_lots
from .quality import Detail
from .rays import Sighting, visible_share
from .receivers import Receivers
from .rows import BRIGHT, MUCH, Rows, merged
from .scenery import Scenery, links_to
from .thickets import thicket_rows
from .tree import Float, Int
from .vectors import picked

# Receivers that one task computes, about: enough for NumPy to be busy, few enough to show progress and to be cancelled.
TASK = 1024
# ... and how many tasks a small scene is shared out among, at least.
_TASKS = 8
# Nobody sees more than all that is around. Links go by the bright parts of nodes and add up to more where those show
# and the others do not; beyond this, without what rays alone tell, and with it, something is there twice.
_FULL, _OVERFULL = 1.5, 2.0
# A wide node brings at most so many times what it would as a body of the area that it shows: a single ray that ends
# close by would speak for all of it.
_MOST_BROUGHT = 8.0
# A link that fills more than this of what is seen gets so many rays, at least, however dim it is.
_LARGE, _LARGE_RAYS = 0.05, 8
# Links that carry less than this share of what would be opened are drawn by lot; what is dark counts as so bright, as a
# share of a typical irradiance.
_LOTS, _DIMMEST = 0.25, 0.25
# Tasks computed ahead of the one that is waited for.
_AHEAD = 8


def build_rows(receivers: Receivers, groups: Int, scenery: Scenery, detail: Detail, need: Float | None = None) -> Rows:
    """Compute the rows of some groups.

    Parameters
    ----------
    receivers : Receivers
    groups : ndarray of shape (g,)
        Ascending.
    scenery : Scenery
    detail : Detail
    need : ndarray, optional
        See `find_links`.

    Returns
    -------
    Rows
    """
    links, thickets = links_to(scenery, receivers, groups, detail, need), scenery.thickets
    rows = _linked_rows(receivers, groups, links, scenery, detail, need)
    if thickets is None or not links.thick.any():
        return rows
    seen = thicket_rows(receivers, groups, links, thickets, scenery.occluders, detail)
    return merged(rows, seen, receivers)


def _linked_rows(
    receivers: Receivers, groups: Int, links: Links, scenery: Scenery, detail: Detail, need: Float | None
) -> Rows:
    """Compute the rows of links, otherwise as `build_rows`."""
    sources = scenery.sources
    count = np.diff(receivers.first)[links.group]
    pair, receiver = counted(count, receivers.first[links.group])
    node = links.node[pair]
    weight = _form_factors(receivers, receiver, links, pair, scenery)
    wanted = np.ones(len(pair), np.float32) if need is None else need[links.group[pair]].astype(np.float32)
    # Row sums and other light need what is dark as well.
    bright = np.maximum(scenery.brightness, _DIMMEST).astype(np.float32)[node]
    lots = draw_lots(weight * bright * wanted / np.float32(_LOTS * detail.error), receiver, node)
    weight *= lots
    shining = np.flatnonzero(weight > 0)
    who = (receiver[shining], node[shining], weight[shining], lots[shining], wanted[shining])
    filled = np.zeros_like(weight)
    weight[shining], filled[shining], large, seen = _through(receivers, *who, scenery, detail)
    halved = _halved(filled, receiver, sources.wide[node])
    weight *= halved
    sums = _sums(receivers, groups, receiver, (filled * halved).astype(np.float32), scenery.brightness[node] > BRIGHT)
    # On a curved surface most of what is close by is behind the horizon of all.
    kept = np.bincount(pair[weight > 0], minlength=len(count)) > 0
    much = weight[shining[large]] > MUCH
    large, middle = (np.cumsum(kept[pair]) - 1)[shining[large[much]]], seen.middle[much]
    weight, count, group, node = weight[kept[pair]], count[kept], links.group[kept], links.node[kept]
    first = np.searchsorted(group, np.append(groups, np.iinfo(np.int64).max))
    begin = np.concatenate(([0], np.cumsum(count)))[first]
    return Rows(groups, first, node, begin, weight, sums, large, middle, seen.cast)


def _through(
    receivers: Receivers,
    receiver: Int,
    node: Int,
    weight: Single,
    lots: Single,
    wanted: Single,
    scenery: Scenery,
    detail: Detail,
) -> tuple[Single, Single, Int, Sighting]:
    """Ask by rays what gets through from nodes to receivers, pair by pair.

    Returns
    -------
    weight, filled : ndarray of shape (k,)
        What is left of it, and the share of the receivers' view that the nodes fill.
    large : ndarray of shape (l,)
        Pairs of which it was asked where on the node the light comes from.
    seen : Sighting
    """
    sources = scenery.sources
    # Rays go where the light is: a dim far link gets one.
    carried = weight * scenery.brightness[node] * wanted
    rays = np.clip(np.ceil(carried / detail.ray), 1, detail.most_rays).astype(np.int64)
    rays = np.where(weight > _LARGE, np.maximum(rays, _LARGE_RAYS), rays)
    large = np.flatnonzero((weight > MUCH) & (sources.tree.child[node] < 0))
    seen = visible_share(
        receivers.point, receivers.normal, receiver, node, rays, large, scenery.targets, scenery.occluders
    )
    wide = sources.wide[node]

    def told(share: Float, brought: Float) -> Single:
        by_rays = np.minimum(lots * sources.area[node] * brought / np.pi, _MOST_BROUGHT * weight)
        return np.where(wide, by_rays, weight * share)

    return told(seen.share, seen.brought), told(seen.filled, seen.filling), large, seen


def _halved(weight: Single, receiver: Int, wide: NDArray[np.bool_]) -> Float:
    """Return what pairs are multiplied with for what is there twice, such as doubled faces, to count half."""
    if not len(receiver):
        return np.ones(0)
    at = receiver - np.min(receiver)
    full, sure = np.bincount(at, weight), np.bincount(at, np.where(wide, 0, weight))
    halved: Float = np.where((sure > _FULL) | (full > _OVERFULL), 1 / np.maximum(full, 1), 1)[at]
    return halved


def _sums(receivers: Receivers, groups: Int, receiver: Int, factor: Single, bright: NDArray[np.bool_]) -> Float:
    """Add up form factors of pairs for each receiver of groups that follow each other, shape (r, 2)."""
    if not len(groups):
        return np.zeros((0, 2))
    begin, end = receivers.first[groups[0]], receivers.first[groups[-1] + 1]
    column = 2 * (receiver - begin) + ~bright
    return np.bincount(column, factor, 2 * (end - begin)).reshape(-1, 2)


def tasks(receivers: Receivers, most: int = TASK) -> Iterator[Int]:
    """Yield the groups of receivers in parts of so many receivers, at most, that one task computes."""
    count = max(1, len(receivers.index))
    step = max(1, int(np.clip(count // _TASKS, TASK // 8, most)) * len(receivers) // count)
    for first in range(0, len(receivers), step):
        yield np.arange(first, min(first + step, len(receivers)))


def stream_rows(
    receivers: Receivers,
    scenery: Scenery,
    detail: Detail,
    workers: Executor,
    need: Float | None = None,
    most: int = TASK,
) -> Iterator[Rows]:
    """Compute the rows of all groups in tasks, and yield them in order, whoever finishes first.

    Closing the iterator cancels what has not begun.
    """

    def compute(groups: Int) -> Rows:
        return build_rows(receivers, groups, scenery, detail, need)

    return in_order(workers, compute, tasks(receivers, most), _AHEAD)


def _form_factors(receivers: Receivers, receiver: Int, links: Links, pair: Int, scenery: Scenery) -> Single:
    """Return the form factor of every pair of a receiver and a node, visibility aside."""
    sources = scenery.sources
    factors = np.zeros(len(pair), np.float32)
    near = links.near[pair]
    far = np.flatnonzero(~near)
    point, normal = picked(receivers.point, receiver[far]), picked(receivers.normal, receiver[far])
    factors[far] = far_form_factors(point, normal, sources, links.node[pair[far]])
    close = np.flatnonzero(near)
    point, normal = picked(receivers.point, receiver[close]), picked(receivers.normal, receiver[close])
    node = links.node[pair[close]]
    factors[close] = near_form_factors(point, normal, scenery.targets.polygons(node)) * sources.solid[node]
    return factors
