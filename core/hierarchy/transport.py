# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchical transport: who lights whom, in links to clusters instead of a matrix of patches.

References
----------
P. Hanrahan, D. Salzman, L. Aupperle, A rapid hierarchical radiosity algorithm, SIGGRAPH 1991.
B. Smits, J. Arvo, D. Greenberg, A clustering algorithm for radiosity in complex environments, SIGGRAPH 1994.
"""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import RadiosityError
from ..memory import available_memory
from ..progress import Progress
from ..visibility import Surroundings
from .elements import Elements
from .links import unevenness
from .probes import groups_shut_in
from .quality import Detail
from .rays import SourcePoints
from .receivers import GROUP_SIZE, SPARSE_SIZE, Receivers, group_receivers
from .rows import BRIGHT, Rows, Scenery, build_rows, gather, received, stream_rows, tasks
from .samples import Samples
from .sources import Sources, build_sources
from .tree import Float

STAGE = "Links"
# Stops of brightness, about a typical one, that clusters are told apart by.
_DARKEST, _BRIGHTEST = -5.0, 15.0
# Of a typical irradiance: where nothing shines, rays go anywhere.
_FAINT = 0.01
# A closed room's rows are put right by at most this; more is no rounding but a back side that does not shine.
_CLOSURE = 0.1
# What is received from a lamp, and from all others, may be put right by this factor at most: more would let errors of
# hidden places out, such as the gap between a lamp and its ceiling.
BALANCE = 1.15
_OTHERS = 1.05
# So many elements tell how much all others see.
_ASKED = 512
# More lamps than this are not looked at one by one.
MOST_LAMPS = 4000


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
    bright : ndarray of shape (m,)
        Nodes much brighter than is typical; many rays have seen to it that their links are right.
    closure : ndarray of shape (m,)
        What each sample's other links are multiplied with, so that in a closed room it adds up to one.
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
    bright: NDArray[np.bool_]
    closure: Float
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
        arriving = closed_sum(_gathered(self.rows, self.receivers, parted(nodes, self.bright)), self.closure)
        return scale * self.samples.spread(arriving)

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
        balance[sure] = np.clip(self.sums[sure] / self.arrives[sure], 1 / BALANCE, BALANCE)
        power = self.area * radiosity.sum(axis=1)
        missing = float(power @ (self.sums - balance * self.arrives))
        others = float(power[~sure] @ self.arrives[~sure])
        if others > abs(missing):
            balance[~sure] += np.clip(missing / others, 1 / _OTHERS - 1, _OTHERS - 1)
        return replace(self, balance=balance)

    def column(self, j: int) -> Float:
        """Return F_ij of all elements i for one j, shape (n,)."""
        alone = np.zeros((len(self.area), 1))
        alone[j] = 1
        return self.gather(alone)[:, 0]

    def row_sums(self) -> Float:
        """Return for each element the share of its light that meets an element, shape (n,)."""
        return self.sums


def node_means(sources: Sources, area: Float, radiosity: Float) -> Float:
    """Return the mean radiosity of every node, shape (m, k), from that of the elements, shape (n, k)."""
    sums: Float = sources.tree.sums(area[:, None] * radiosity)
    return sums / sources.area[:, None]


def parted(nodes: Float, bright: NDArray[np.bool_]) -> Float:
    """Return the bright nodes' values beside those of the others, shape (m, 2 k)."""
    return np.column_stack((np.where(bright[:, None], nodes, 0), np.where(bright[:, None], 0, nodes)))


def closed_sum(gathered: Float, closure: Float) -> Float:
    """Add up the light of bright nodes and of the others, put right; shape (n, 2 k) to (n, k)."""
    k = gathered.shape[1] // 2
    total: Float = gathered[:, :k] + closure[:, None] * gathered[:, k:]
    return total


def closures(sums: Float, shut: NDArray[np.bool_]) -> Float:
    """Return what makes the rows of those who see no way out add up to one.

    Parameters
    ----------
    sums : ndarray of shape (n, 2)
        Rows over the bright nodes, and over the others.
    shut : ndarray of shape (n,)
        Who sees no way out.

    Returns
    -------
    ndarray of shape (n,)
        1 for those who do, and where more is missing than a few rays can be wrong by.
    """
    missing = 1 - sums.sum(axis=1)
    closed = shut & (np.abs(missing) < np.minimum(_CLOSURE, 0.5 * sums[:, 1]))
    return 1 + np.where(closed, missing / np.where(closed, sums[:, 1], 1), 0)


def build_scenery(elements: Elements, radiosity: Float, typical: float, occluders: Surroundings) -> Scenery:
    """Cluster elements by where they are and how bright they may be.

    Parameters
    ----------
    elements : Elements
    radiosity : ndarray of shape (n, 3)
        A guess [W/m^2].
    typical : float
        Irradiance that errors are judged by [W/m^2].
    occluders : Surroundings

    Returns
    -------
    Scenery
    """
    bright = radiosity.mean(axis=1) / typical
    shade = np.clip(np.log2(np.maximum(bright, 2.0**_DARKEST)), _DARKEST, _BRIGHTEST)
    sources = build_sources(elements.corners, elements.centre, elements.normal, elements.area, shade)
    return _scenery(sources, elements, bright, occluders)


def _scenery(sources: Sources, elements: Elements, bright: Float, occluders: Surroundings) -> Scenery:
    targets = SourcePoints(sources, elements.corners, elements.area * (bright + _FAINT))
    brightness = node_means(sources, elements.area, bright[:, None])[:, 0]
    return Scenery(sources, elements.corners, brightness, unevenness(sources, brightness), targets, occluders)


def relit(scenery: Scenery, elements: Elements, radiosity: Float, typical: float) -> Scenery:
    """Return the same clusters under other light; parameters as for `build_scenery`."""
    return _scenery(scenery.sources, elements, radiosity.mean(axis=1) / typical, scenery.occluders)


def hierarchical_transport(
    elements: Elements, samples: Samples, scenery: Scenery, detail: Detail, workers: Executor
) -> Generator[Progress, None, HierarchicalTransport]:
    """Link all samples to clusters.

    Parameters
    ----------
    elements : Elements
    samples : Samples
        Who receives for all.
    scenery : Scenery
        From `build_scenery`.
    detail : Detail
    workers : concurrent.futures.Executor
        Who computes; the result does not depend on it, bit for bit.

    Yields
    ------
    Progress

    Returns
    -------
    HierarchicalTransport

    Raises
    ------
    RadiosityError
        When the links would not fit into memory.
    """
    size = GROUP_SIZE if samples.single else SPARSE_SIZE
    receivers = group_receivers(elements.centre[samples.element], elements.normal[samples.element], size)
    rows: list[Rows] = []
    done = 0
    for part in stream_rows(receivers, scenery, detail, workers):
        rows.append(part)
        done += len(part.group)
        check_memory(rows, done / len(receivers))
        yield Progress(STAGE, done / len(receivers))
    return linked(elements, samples, scenery, receivers, rows, detail)


def linked(
    elements: Elements, samples: Samples, scenery: Scenery, receivers: Receivers, rows: list[Rows], detail: Detail
) -> HierarchicalTransport:
    """Put rows together: add them up, close those of closed rooms, and see what arrives.

    Parameters
    ----------
    elements : Elements
    samples : Samples
    scenery : Scenery
    receivers : Receivers
        Of the samples.
    rows : list of Rows
        For all groups of receivers, in order.
    detail : Detail
        That they were made with.

    Returns
    -------
    HierarchicalTransport
        Not yet balanced.
    """
    bright = scenery.brightness > BRIGHT
    sums = np.zeros((len(samples), 2))
    sums[receivers.index] = np.concatenate([part.sums for part in rows])
    shut = np.zeros(len(samples), bool)
    shut[receivers.index] = np.repeat(
        groups_shut_in(receivers, elements.corners, scenery.occluders), np.diff(receivers.first)
    )
    closure = closures(sums, shut)
    total = (sums[:, 0] + closure * sums[:, 1])[samples.cluster]
    tree = scenery.sources.tree
    leaf = np.flatnonzero(tree.child < 0)
    lamp = np.zeros(len(elements), bool)
    lamp[tree.order[tree.start[leaf]]] = bright[leaf]
    which = np.flatnonzero(lamp)
    if len(which) <= MOST_LAMPS:
        total[which] = seen(elements.pick(which), shut[samples.cluster[which]], scenery, elements, detail)
    open_ = ~lamp & ~shut[samples.cluster]
    total[open_] *= _evenly(total, open_, scenery, elements, detail)
    one = np.ones(len(elements))
    transport = HierarchicalTransport(
        elements, samples, scenery.sources, receivers, tuple(rows), lamp, bright, closure, total, one, one
    )
    return replace(transport, arrives=_arrives(transport))


def seen(
    lamps: Elements, shut: NDArray[np.bool_], scenery: Scenery, elements: Elements, detail: Detail
) -> Float:
    """Return which share of the light of a few elements meets an element, by rays that go everywhere alike.

    A lamp sees what it lights, so rays that go where it is bright find that it sees more than it does.

    Parameters
    ----------
    lamps : Elements
    shut : ndarray of shape (l,)
        Which of them see no way out.
    scenery : Scenery
    elements : Elements
        All of them.
    detail : Detail

    Returns
    -------
    ndarray of shape (l,)
    """
    if not len(lamps):
        return np.zeros(0)
    plain = replace(
        scenery,
        brightness=np.ones(len(scenery.brightness)),
        uneven=np.zeros(len(scenery.brightness)),
        targets=SourcePoints(scenery.sources, elements.corners, elements.area),
    )
    receivers = group_receivers(lamps.centre, lamps.normal)
    sums = np.zeros((len(lamps), 2))
    for groups in tasks(receivers):
        run = slice(receivers.first[groups[0]], receivers.first[groups[-1] + 1])
        sums[receivers.index[run]] = build_rows(receivers, groups, plain, detail).sums
    # Brightness is one everywhere, so all of it is in the second column.
    share: Float = sums[:, 0] + closures(sums, shut) * sums[:, 1]
    return share


def _evenly(
    sums: Float, which: NDArray[np.bool_], scenery: Scenery, elements: Elements, detail: Detail
) -> float:
    """Return by how much elements see less shine than their rays said, which went where it is bright.

    It is asked of some, more where much light is sent from, and the same for all.
    """
    tree = scenery.sources.tree
    leaf = np.flatnonzero(tree.child < 0)
    power = np.zeros(len(elements))
    power[tree.order[tree.start[leaf]]] = scenery.brightness[leaf]
    below = np.cumsum(np.where(which, power * elements.area, 0)[tree.order])
    if below[-1] <= 0:
        return 1.0
    chosen = tree.order[np.searchsorted(below, (np.arange(_ASKED) + 0.5) / _ASKED * below[-1])]
    chosen, count = np.unique(chosen, return_counts=True)
    even = seen(elements.pick(chosen), np.zeros(len(chosen), bool), scenery, elements, detail)
    return float(np.clip((count @ even) / max(count @ sums[chosen], 1e-300), 1 / _OTHERS, _OTHERS))


def check_memory(rows: list[Rows], share: float) -> None:
    """Refuse links that will not fit, judged by the share of them that is there."""
    held = sum(part.weight.nbytes + part.node.nbytes for part in rows)
    missing, free = held * (1 / share - 1), available_memory()
    if missing > free:
        raise RadiosityError(
            f"The links need {(held + missing) / 2**30:.1f} GiB of memory, and {(held + free) / 2**30:.1f} GiB are "
            "free: take a lower quality, or larger patches"
        )


def _gathered(rows: tuple[Rows, ...] | list[Rows], receivers: Receivers, nodes: Float) -> Float:
    """Return the irradiance of all receivers in the caller's order, from the radiosity of the nodes."""
    single = nodes.astype(np.float32)
    irradiance = np.zeros((len(receivers.index), nodes.shape[1]))
    irradiance[receivers.index] = np.concatenate([gather(part, receivers, single) for part in rows])
    return irradiance


def _arrives(transport: HierarchicalTransport) -> Float:
    """Return which share of each element's light is received, shape (n,)."""
    sources, receivers, area = transport.sources, transport.receivers, transport.samples.area
    plain, closed = area[receivers.index], (area * transport.closure)[receivers.index]
    nodes = np.zeros(len(sources.area))
    for part in transport.rows:
        bright = received(part, receivers, plain, len(nodes))
        nodes += np.where(transport.bright, bright, received(part, receivers, closed, len(nodes)))
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
    leaf = np.flatnonzero(tree.child < 0)
    arrives = np.zeros(len(tree.order))
    arrives[tree.order[tree.start[leaf]]] = nodes[leaf]
    return arrives
