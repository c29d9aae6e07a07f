# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchical transport: who lights whom, in links to clusters instead of a matrix of patches.

References
----------
P. Hanrahan, D. Salzman, L. Aupperle, A rapid hierarchical radiosity algorithm, SIGGRAPH 1991.
B. Smits, J. Arvo, D. Greenberg, A clustering algorithm for radiosity in complex environments, SIGGRAPH 1994.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .elements import Elements
from .receivers import Receivers
from .rows import Rows, gather, received
from .samples import Samples
from .scenery import node_means
from .sources import Sources
from .tree import Float, Tree

# What is received from a lamp, and from all others, may be put right by this factor at most: more would let errors of
# hidden places out, such as the gap between a lamp and its ceiling.
BALANCE = 1.15
OTHERS = 1.05


@dataclass(frozen=True, eq=False)
class HierarchicalTransport:
    """Links from groups of samples to clusters of elements.

    Attributes
    ----------
    elements : Elements
    samples : Samples
        Which of them receive for all.
    sources : Sources
    receivers : Receivers
        Centres of the samples.
    rows : tuple of Rows
    lamp : ndarray of shape (n,)
        Elements much brighter than is typical.
    sums : ndarray of shape (n,)
        Share of its surroundings that each element sees shine; by reciprocity, that of its own light that is received.
    arrives : ndarray of shape (n,)
        The same, added up where it is received: not quite the same, since receivers are points.
    balance : ndarray of shape (n,)
        What each element's radiosity is multiplied with, so that all together receive what was sent.
    """

    elements: Elements
    samples: Samples
    sources: Sources
    receivers: Receivers
    rows: tuple[Rows, ...]
    lamp: NDArray[np.bool_]
    sums: Float
    arrives: Float
    balance: Float

    @property
    def area(self) -> Float:
        """Areas of the elements, shape (n,) [m^2]."""
        return self.elements.area

    @property
    def links(self) -> int:
        """How many pairs of an element and a cluster there are."""
        return sum(len(rows.weight) for rows in self.rows)

    @property
    def rays(self) -> int:
        """How many rays were cast."""
        return sum(rows.rays for rows in self.rows)

    def gather(self, radiosity: Float) -> Float:
        """Return the irradiance of the elements, shape (n, k), for radiosities of shape (n, k) [W/m^2]."""
        scale = float(np.abs(radiosity).max(initial=0.0)) or 1.0
        nodes = node_means(self.sources, self.area, self.balance[:, None] * radiosity / scale)
        return scale * self.samples.spread(_gathered(self.rows, self.receivers, nodes))

    def sent(self) -> Float:
        """Return which share of each element's light the solver lets others receive, shape (n,)."""
        return self.balance * self.arrives

    def balanced(self, radiosity: Float) -> "HierarchicalTransport":
        """Return this transport with its energy in balance.

        Lamps are put right one by one: the light of a small lamp at a wall is sent by few elements to few. All others
        are put right together, so that no error of a single element is spread.

        Parameters
        ----------
        radiosity : ndarray of shape (n, k)
            Of the elements, a guess or a solution [W/m^2].

        Returns
        -------
        HierarchicalTransport
        """
        sure = self.lamp & (self.arrives > 0)
        balance = np.ones(len(self.area))
        lamps = np.where(sure, self.area, 0)
        balance[sure] = put_right(self.sources.tree, lamps * self.sums, lamps * self.arrives)[sure]
        power = np.where(sure, 0, self.area * radiosity.sum(axis=1))
        missing, others = float(power @ (self.sums - self.arrives)), float(power @ self.arrives)
        if others > abs(missing):
            balance[~sure] += np.clip(missing / others, 1 / OTHERS - 1, OTHERS - 1)
        return replace(self, balance=balance)

    def column(self, j: int) -> Float:
        """Return F_ij of all elements i for one j, shape (n,)."""
        alone = np.zeros((len(self.area), 1))
        alone[j] = 1
        return self.gather(alone)[:, 0]

    def row_sums(self) -> Float:
        """Return for each element the share of its light that meets an element, shape (n,)."""
        return self.sums


def _gathered(rows: tuple[Rows, ...] | list[Rows], receivers: Receivers, nodes: Float) -> Float:
    """Return the irradiance of all receivers in the caller's order, from the radiosity of the nodes."""
    # Shortened before they are looked up: many links share a node.
    nodes = nodes.astype(np.float32)
    irradiance = np.zeros((len(receivers.index), nodes.shape[1]))
    irradiance[receivers.index] = np.concatenate([gather(part, receivers, nodes) for part in rows])
    return irradiance


def arrivals(transport: HierarchicalTransport) -> Float:
    """Return which share of each element's light is received by way of its links, shape (n,)."""
    sources, area = transport.sources, transport.samples.area[transport.receivers.index]
    nodes = np.zeros(len(sources.area))
    for part in transport.rows:
        nodes += received(part, transport.receivers, area, len(nodes))
    return of_leaves(sources, nodes)


def of_leaves(sources: Sources, received: Float) -> Float:
    """Return which share of each element's light is received, shape (n,).

    Parameters
    ----------
    sources : Sources
    received : ndarray of shape (m,)
        What is received from each node of radiosity one, by links to that node itself [m^2].
    """
    nodes = received / sources.area
    # What a node sends, its children send as well: add up from the root to the leaves.
    tree = sources.tree
    for first, last in tree.levels:
        inner = first + np.flatnonzero(tree.child[first:last] >= 0)
        nodes[tree.child[inner]] += nodes[inner]
        nodes[tree.child[inner] + 1] += nodes[inner]
    return tree.at_elements(nodes)


def put_right(tree: Tree, sent: Float, arrives: Float) -> Float:
    """Return what the light of lamps is multiplied with so that all of it arrives that was sent, shape (l,).

    A piece of a lamp close to a wall lights the middles of large elements there, or misses them, which tells nothing of
    this piece. Where that comes to more than `BALANCE`, the cluster of lamps that it belongs to is asked.

    Parameters
    ----------
    tree : Tree
        Of the lamps, or of more.
    sent, arrives : ndarray of shape (l,)
        Light of each that meets an element, and that elements receive, in the same unit.
    """
    told = tree.sums(np.column_stack((sent, arrives)))
    share = told[:, 0] / np.maximum(told[:, 1], 1e-300)
    sure = (share >= 1 / BALANCE) & (share <= BALANCE)
    share[0] = np.clip(share[0], 1 / BALANCE, BALANCE)
    for first, last in tree.levels:
        inner = first + np.flatnonzero(tree.child[first:last] >= 0)
        for child in (tree.child[inner], tree.child[inner] + 1):
            share[child] = np.where(sure[child], share[child], share[inner])
    return tree.at_elements(share)
