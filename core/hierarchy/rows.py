# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of the transport: for each group of receivers the nodes it is lit by, with form factor times visible share."""

from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..runs import counted
from ..workers import in_order
from .kernels import Single, far_form_factors, near_form_factors
from .links import Links, find_links
from .lots import draw_lots
from .quality import Detail
from .rays import visible_share
from .receivers import Receivers
from .scenery import Scenery
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
# What a receiver sees of an element for it to matter which part of it that is.
_MUCH = 0.04
# Links that carry less than this share of what would be opened are drawn by lot; what is dark counts as so bright, as a
# share of a typical irradiance.
_LOTS, _DIMMEST = 0.25, 0.25
# Tasks computed ahead of the one that is waited for.
_AHEAD = 8
# Nodes this many times as bright as is typical need no putting right.
BRIGHT = 12.0


@dataclass(frozen=True, eq=False)
class Rows:
    """Dense blocks of weights, one for each group.

    Attributes
    ----------
    group : ndarray of shape (g,)
        Groups of the receivers, ascending.
    first : ndarray of shape (g + 1,)
        First link of each.
    node : ndarray of shape (k,)
        Source of each link.
    begin : ndarray of shape (g + 1,)
        First weight of each group.
    weight : ndarray of shape (w,)
        For each group its links, for each link its receivers: form factor times visible share.
    sums : ndarray of shape (r, 2)
        Share of its surroundings that each receiver of the groups sees shine: of bright nodes, and of the others.
    large : ndarray of shape (l,)
        Weights of single elements that fill much of what a receiver sees, ascending.
    middle : ndarray of shape (l, 3)
        Where on those the light comes from on the mean [m].
    rays : int
        Cast on the way.
    """

    group: Int
    first: Int
    node: Int
    begin: Int
    weight: Single
    sums: Float
    large: Int
    middle: Float
    rays: int

    def blocks(self, receivers: Receivers) -> Iterator[tuple[slice, Int, Single]]:
        """Yield each group's receivers, its nodes, shape (k,), and their weights, shape (k, receivers)."""
        for index, group in enumerate(self.group):
            run = slice(receivers.first[group], receivers.first[group + 1])
            nodes = self.node[self.first[index] : self.first[index + 1]]
            weight = self.weight[self.begin[index] : self.begin[index + 1]]
            yield run, nodes, weight.reshape(len(nodes), run.stop - run.start)


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
    sources = scenery.sources
    links = find_links(
        receivers,
        groups,
        sources,
        scenery.brightness,
        angle=detail.angle,
        error=detail.error,
        uneven=scenery.uneven,
        need=need,
    )
    count = np.diff(receivers.first)[links.group]
    pair, receiver = counted(count, receivers.first[links.group])
    weight = _form_factors(receivers, receiver, links, pair, scenery)
    wanted = np.ones(len(pair), np.float32) if need is None else need[links.group[pair]].astype(np.float32)
    # Row sums and other light need what is dark as well.
    bright = np.maximum(scenery.brightness, _DIMMEST).astype(np.float32)[links.node[pair]]
    lots = draw_lots(weight * bright * wanted / np.float32(_LOTS * detail.error), receiver, links.node[pair])
    weight *= lots
    shining = np.flatnonzero(weight > 0)
    node = links.node[pair[shining]]
    # Rays go where the light is: a dim far link gets one.
    carried = weight[shining] * scenery.brightness[node] * wanted[shining]
    rays = np.clip(np.ceil(carried / detail.ray), 1, detail.most_rays).astype(np.int64)
    rays = np.where(weight[shining] > _LARGE, np.maximum(rays, _LARGE_RAYS), rays)
    wide = sources.wide[node]
    large = np.flatnonzero((weight[shining] > _MUCH) & (sources.tree.child[node] < 0))
    seen = visible_share(
        receivers.point, receivers.normal, receiver[shining], node, rays, large, scenery.targets, scenery.occluders
    )
    told = np.minimum(lots[shining] * sources.area[node] * seen.brought / np.pi, _MOST_BROUGHT * weight[shining])
    weight[shining] = np.where(wide, told, weight[shining] * seen.share)
    weight *= _halved(weight, receiver, sources.wide[links.node[pair]])
    sums = _sums(receivers, groups, receiver[shining], weight[shining], scenery.brightness[node] > BRIGHT)
    # On a curved surface most of what is close by is behind the horizon of all.
    kept = np.bincount(pair[weight > 0], minlength=len(count)) > 0
    much = weight[shining[large]] > _MUCH
    large, middle = (np.cumsum(kept[pair]) - 1)[shining[large[much]]], seen.middle[much]
    weight, count, group, node = weight[kept[pair]], count[kept], links.group[kept], links.node[kept]
    first = np.searchsorted(group, np.append(groups, np.iinfo(np.int64).max))
    begin = np.concatenate(([0], np.cumsum(count)))[first]
    return Rows(groups, first, node, begin, weight, sums, large, middle, seen.cast)


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


def tasks(receivers: Receivers) -> Iterator[Int]:
    """Yield the groups of receivers in parts that one task computes."""
    count = max(1, len(receivers.index))
    step = max(1, int(np.clip(count // _TASKS, TASK // 8, TASK)) * len(receivers) // count)
    for first in range(0, len(receivers), step):
        yield np.arange(first, min(first + step, len(receivers)))


def stream_rows(
    receivers: Receivers, scenery: Scenery, detail: Detail, workers: Executor, need: Float | None = None
) -> Iterator[Rows]:
    """Compute the rows of all groups in tasks, and yield them in order, whoever finishes first.

    Closing the iterator cancels what has not begun.
    """

    def compute(groups: Int) -> Rows:
        return build_rows(receivers, groups, scenery, detail, need)

    return in_order(workers, compute, tasks(receivers), _AHEAD)


def _form_factors(receivers: Receivers, receiver: Int, links: Links, pair: Int, scenery: Scenery) -> Single:
    """Return the form factor of every pair of a receiver and a node, visibility aside."""
    sources = scenery.sources
    factors = np.zeros(len(pair), np.float32)
    near = links.near[pair]
    far = np.flatnonzero(~near)
    point, normal = picked(receivers.point, receiver[far]), picked(receivers.normal, receiver[far])
    factors[far] = far_form_factors(point, normal, sources, links.node[pair[far]])
    close = np.flatnonzero(near)
    element = sources.tree.order[sources.tree.start[links.node[pair[close]]]]
    point, normal = picked(receivers.point, receiver[close]), picked(receivers.normal, receiver[close])
    factors[close] = near_form_factors(point, normal, picked(scenery.corners, element))
    return factors


def gather(rows: Rows, receivers: Receivers, radiosity: Float) -> Float:
    """Add up the light of every link.

    Parameters
    ----------
    rows : Rows
    receivers : Receivers
    radiosity : ndarray of shape (m, k)
        Of each node, best in Fortran's order [W/m^2].

    Returns
    -------
    ndarray of shape (r, k)
        Irradiance at the receivers of the rows' groups, in their order [W/m^2].
    """
    # All that is looked up at once: what is left for each group is little more than its product.
    sent = picked(radiosity, rows.node).astype(np.float32)
    count = np.diff(receivers.first)[rows.group].tolist()
    first, begin = rows.first.tolist(), rows.begin.tolist()
    parts = [
        rows.weight[begin[k] : begin[k + 1]].reshape(-1, count[k]).T @ sent[first[k] : first[k + 1]]
        for k in range(len(count))
    ]
    return np.concatenate(parts).astype(float) if parts else np.zeros((0, radiosity.shape[1]))


def closed(rows: Rows, receivers: Receivers, closure: Float, bright: NDArray[np.bool_]) -> Rows:
    """Return rows whose links to all but bright nodes are multiplied with something.

    Parameters
    ----------
    rows : Rows
    receivers : Receivers
    closure : ndarray of shape (r,)
        For each receiver, in their order.
    bright : ndarray of shape (m,)
        Which nodes are left as they are.

    Returns
    -------
    Rows
        Closed, they stay as they are when they are closed once more.
    """
    factor = closure.astype(np.float32)
    parts = [
        (weight * np.where(bright[node][:, None], np.float32(1), factor[run])).ravel()
        for run, node, weight in rows.blocks(receivers)
    ]
    if not parts:
        return rows
    run = slice(receivers.first[rows.group[0]], receivers.first[rows.group[-1] + 1])
    sums = rows.sums * np.column_stack((np.ones(run.stop - run.start), closure[run]))
    return replace(rows, weight=np.concatenate(parts), sums=sums)


def received(rows: Rows, receivers: Receivers, area: Float, nodes: int) -> Float:
    """Return the area-weighted sum of each node's weights: what the receivers get from a node of radiosity one.

    Parameters
    ----------
    rows : Rows
    receivers : Receivers
    area : ndarray of shape (r,)
        Of the receivers, in their order [m^2].
    nodes : int
        How many nodes there are.

    Returns
    -------
    ndarray of shape (nodes,)
        [m^2].
    """
    parts = [weight @ area[run] for run, _, weight in rows.blocks(receivers)]
    return np.bincount(rows.node, np.concatenate(parts), nodes) if parts else np.zeros(nodes)
