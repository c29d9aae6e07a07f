# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of the transport: for each group of receivers the nodes it is lit by, with form factor times visible share."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..runs import counted
from .kernels import Single
from .receivers import Receivers
from .tree import Float, Int
from .vectors import picked

# Nodes this many times as bright as is typical need no putting right.
BRIGHT = 12.0
# What a receiver sees of an element for it to matter which part of it that is.
MUCH = 0.04


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


def merged(one: Rows, other: Rows, receivers: Receivers) -> Rows:
    """Return rows of the same groups as rows that hold the links of both.

    Parameters
    ----------
    one, other : Rows
    receivers : Receivers

    Returns
    -------
    Rows
    """
    count = np.diff(receivers.first)[one.group]
    at = np.concatenate([np.repeat(np.arange(len(count)), np.diff(rows.first)) for rows in (one, other)])
    order = np.argsort(at, kind="stable")
    begin = np.cumsum(count[at]) - count[at]
    link, place = counted(count[at[order]])
    # Which weight comes to which place, and the other way round.
    source = begin[order][link] + place
    goal = np.empty_like(source)
    goal[source] = np.arange(len(source))
    large = goal[np.concatenate((one.large, len(one.weight) + other.large))]
    rising = np.argsort(large)
    return Rows(
        group=one.group,
        first=one.first + other.first,
        node=np.concatenate((one.node, other.node))[order],
        begin=one.begin + other.begin,
        weight=np.concatenate((one.weight, other.weight))[source],
        sums=one.sums + other.sums,
        large=large[rising],
        middle=np.concatenate((one.middle, other.middle))[rising],
        rays=one.rays + other.rays,
    )


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
    sent = picked(radiosity, rows.node).astype(np.float32, copy=False)
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
