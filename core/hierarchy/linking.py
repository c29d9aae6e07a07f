# SPDX-License-Identifier: GPL-3.0-or-later
"""How a hierarchical transport is made: rows for all samples, closed in closed rooms, and refused where memory ends."""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..occlusion.shared_out import SharedOut
from ..progress import Progress
from .elements import Elements
from .exchange import build_rows, stream_rows, tasks
from .foresight import links_memory, refuse_beyond_memory
from .probes import receivers_shut_in
from .quality import Detail
from .receivers import Receivers, group_receivers, group_size
from .rows import BRIGHT, Rows, closed
from .samples import Samples
from .scenery import Scenery
from .source_points import SourcePoints
from .transport import HierarchicalTransport, arrivals
from .tree import Float

STAGE = "Links"
# A closed room's rows are put right by at most this; more is no rounding but a back side that does not shine.
_CLOSURE = 0.1
# So many elements tell how much all others see, so many of them together, each by this factor at most.
_ASKED, _AROUND, _AMISS = 512, 16, 2.0
# More lamps than this are not looked at one by one.
MOST_LAMPS = 4000


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
        When the links would not fit into memory: before the first, if that can be foreseen.
    """
    size = group_size(len(samples), len(elements))
    receivers = group_receivers(elements.centre[samples.element], elements.normal[samples.element], size)
    needed = links_memory(receivers, scenery, detail)
    refuse_beyond_memory(needed)
    yield Progress(STAGE, 0.0, memory=needed)
    rows: list[Rows] = []
    done = 0
    for part in stream_rows(receivers, scenery, detail, workers):
        rows.append(part)
        done += len(part.group)
        check_memory(rows, done / len(receivers))
        yield Progress(STAGE, done / len(receivers))
    return linked(elements, samples, scenery, receivers, rows, detail, workers)


def linked(
    elements: Elements,
    samples: Samples,
    scenery: Scenery,
    receivers: Receivers,
    rows: list[Rows],
    detail: Detail,
    workers: Executor,
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
        For all groups of receivers, in order; their closed ones take their places.
    detail : Detail
        That they were made with.
    workers : concurrent.futures.Executor

    Returns
    -------
    HierarchicalTransport
        Not yet balanced.
    """
    bright = scenery.brightness > BRIGHT
    sums = np.zeros((len(samples), 2))
    sums[receivers.index] = np.concatenate([part.sums for part in rows])
    shut = np.zeros(len(samples), bool)
    asked = SharedOut(scenery.occluders, workers)
    shut[receivers.index] = receivers_shut_in(receivers, elements.corners, asked)
    closure = closures(sums, shut, detail)
    total = _shares(sums, closure, detail)[samples.cluster]
    lamp = scenery.sources.tree.at_elements(bright)
    which = np.flatnonzero(lamp)
    if len(which) <= MOST_LAMPS:
        total[which] = seen(elements.pick(which), shut[samples.cluster[which]], scenery, elements, detail)
    right = _evenly(total, ~lamp, shut[samples.cluster], scenery, elements, detail)
    total = np.where(lamp, total, np.minimum(right * total, _most(detail)))
    # One by one and in the list, since nowhere is there room for all of them twice.
    for index, part in enumerate(rows):
        rows[index] = closed(part, receivers, closure[receivers.index], bright)
    one = np.ones(len(elements))
    transport = HierarchicalTransport(elements, samples, scenery.sources, receivers, tuple(rows), lamp, total, one, one)
    return replace(transport, arrives=arrivals(transport))


def seen(lamps: Elements, shut: NDArray[np.bool_], scenery: Scenery, elements: Elements, detail: Detail) -> Float:
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
    receivers = group_receivers(lamps.centre, lamps.normal, group_size(len(lamps), len(elements)))
    sums = np.zeros((len(lamps), 2))
    for groups in tasks(receivers):
        run = slice(receivers.first[groups[0]], receivers.first[groups[-1] + 1])
        sums[receivers.index[run]] = build_rows(receivers, groups, plain, detail).sums
    # Brightness is one everywhere, so all of it is in the second column.
    share: Float = sums[:, 0] + closures(sums, shut, detail) * sums[:, 1]
    return share


def _evenly(
    sums: Float, dim: NDArray[np.bool_], shut: NDArray[np.bool_], scenery: Scenery, elements: Elements, detail: Detail
) -> Float:
    """Return what makes the sums of dim elements right where there are ways out: their rays went where it is bright.

    It is asked of some, and each answer is that of all around, who may have missed a small way out. There are the more
    of them the more light is passed on, since the sunlit outside of a house is brighter than all that is in it, and
    sends its light away.
    """
    tree, right = scenery.sources.tree, np.ones(len(sums))
    sent = tree.at_elements(scenery.brightness) * elements.area * sums
    below = np.cumsum(np.where(dim, sent, 0)[tree.order])
    if below[-1] <= 0 or shut[dim].all():
        return right
    chosen = tree.order[np.searchsorted(below, (np.arange(_ASKED) + 0.5) / _ASKED * below[-1])]
    asked, again = np.unique(chosen, return_inverse=True)
    even = seen(elements.pick(asked), np.zeros(len(asked), bool), scenery, elements, detail)[again]
    told = np.minimum(even / sums[chosen], _AMISS).reshape(-1, _AROUND).mean(axis=1)
    told[shut[chosen].reshape(-1, _AROUND).all(axis=1)] = 1
    right[tree.order] = told[np.minimum(below / below[-1] * len(told), len(told) - 1).astype(np.int64)]
    return right


def closures(sums: Float, shut: NDArray[np.bool_], detail: Detail) -> Float:
    """Return what makes the rows of those who see no way out add up to one, and those of the others to no more.

    Parameters
    ----------
    sums : ndarray of shape (n, 2)
        Rows over the bright nodes, and over the others.
    shut : ndarray of shape (n,)
        Who sees no way out.
    detail : Detail
        That the rows were made with.

    Returns
    -------
    ndarray of shape (n,)
        1 for those who do, and where more is missing than a few rays can be wrong by.
    """
    missing, others = 1 - sums.sum(axis=1), sums[:, 1]
    closed = shut & (np.abs(missing) < np.minimum(_CLOSURE, 0.5 * others))
    # Nor does anybody else see more than all that is around; of rows that few rays decide, as many are too small.
    closed |= missing < min(-_CLOSURE, 1 - _most(detail))
    closure: Float = 1 + np.where(closed, np.maximum(missing / np.where(closed & (others > 0), others, 1), -1), 0)
    return closure


def _shares(sums: Float, closure: Float, detail: Detail) -> Float:
    """Return what rows add up to once they are closed, shape (n,)."""
    shares: Float = np.minimum(sums[:, 0] + closure * sums[:, 1], _most(detail))
    return shares


def _most(detail: Detail) -> float:
    """Return the most that a row may add up to.

    Single rays scatter so widely that light would be lost on the mean if what is too much, alone, were taken away.
    """
    return 1.0 if detail.most_rays > 1 else np.inf


def check_memory(rows: list[Rows], share: float) -> None:
    """Refuse links that will not fit, judged by the share of them that is there."""
    held = sum(part.weight.nbytes + part.node.nbytes for part in rows)
    refuse_beyond_memory(held / share, held)
