# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a node each receiver sees, by rays to points spread over the node's patches."""

from dataclasses import dataclass

import numpy as np

from ..runs import counted
from ..sequences import GOLDEN, PLASTIC
from ..visibility import Occluders, dimmed
from .source_points import SourcePoints
from .tree import Float, Int
from .vectors import dots, picked

_STEP = np.array(PLASTIC)
# Points that face away are drawn again, so often and so far along in both numbers.
_DRAWN_AGAIN, _ELSEWHERE = 3, 0.3819660112501051
# Cosine that counts as in the plane.
_GRAZING = 1e-7
# Rays that a link is tried with before it gets all it deserves.
_TRIED = 8
# Rays that are prepared at a time: their temporaries stay in a core's second-level cache.
_BLOCK = 16384


@dataclass(frozen=True, eq=False)
class Sighting:
    """What rays tell of k pairs of a receiver and a node.

    Attributes
    ----------
    share : ndarray of shape (k,)
        Of the light that gets through, 0 to 1; samples count by the light they would bring.
    brought : ndarray of shape (k,)
        What a sample brings on the mean, cosines over squared distance, or nothing where it is hidden or faces away
        [1/m^2]: the integral itself, for nodes whose parts shine into too many directions for any kernel.
    filled, filling : ndarray of shape (k,)
        The same as if panes kept nothing back, but for the place that they fill themselves.
    middle : ndarray of shape (m, 3)
        Where the light that gets through comes from on the mean, of those pairs for which that was asked [m].
    cast : int
        How many rays there were.
    """

    share: Float
    brought: Float
    filled: Float
    filling: Float
    middle: Float
    cast: int


def visible_share(
    point: Float,
    normal: Float,
    receiver: Int,
    node: Int,
    rays: Int,
    large: Int,
    targets: SourcePoints,
    occluders: Occluders,
) -> Sighting:
    """Cast rays from receivers to nodes and return how much of the light gets through.

    Parameters
    ----------
    point, normal : ndarray of shape (r, 3)
        Receivers.
    receiver, node : ndarray of shape (k,)
        Pairs.
    rays : ndarray of shape (k,)
        How many each pair deserves, at least one. A few are tried first; the others follow where those disagree.
    large : ndarray of shape (m,)
        Pairs of which it matters where on the node the light comes from, ascending.
    targets : SourcePoints
    occluders : Occluders
    """
    first = np.minimum(rays, _TRIED)
    sums, cast = _sampled(point, normal, receiver, node, first, np.zeros_like(rays), large, targets, occluders)
    mixed = np.flatnonzero((rays > first) & (sums[0] > 0) & (sums[2] < (1 - 1e-9) * sums[1]))
    rest = rays[mixed] - first[mixed]
    if len(mixed):
        among = np.flatnonzero(np.isin(mixed, large, assume_unique=True))
        more, further = _sampled(
            point, normal, receiver[mixed], node[mixed], rest, first[mixed], among, targets, occluders
        )
        sums[:, mixed] += more
        cast += further
    tried = first.copy()
    tried[mixed] += rest
    middle = (sums[4:, large] / np.where(sums[0, large] > 0, sums[0, large], 1)).T
    whole = np.where(sums[1] > 0, sums[1], 1)
    return Sighting(sums[0] / whole, sums[0] / tried, sums[3] / whole, sums[3] / tried, middle, cast)


def _sampled(
    point: Float,
    normal: Float,
    receiver: Int,
    node: Int,
    rays: Int,
    done: Int,
    large: Int,
    targets: SourcePoints,
    occluders: Occluders,
) -> tuple[Float, int]:
    """Cast rays and add up what the samples of each pair bring.

    Returns
    -------
    sums : ndarray of shape (7, k)
        Light of the samples as it gets through, of all, of those that nothing blocks, the same but for what panes fill
        themselves, and, for large pairs, the first times where they are.
    cast : int
    """
    pair, turn = counted(rays, done)
    origin, target = np.zeros((len(pair), 3), order="F"), np.zeros((len(pair), 3), order="F")
    light = np.zeros(len(pair))
    for first in range(0, len(pair), _BLOCK):
        part = slice(first, first + _BLOCK)
        r, s = receiver[pair[part]], node[pair[part]]
        origin[part] = picked(point, r)
        target[part], light[part] = _targets(origin[part], picked(normal, r), r, s, turn[part], targets)
    # What a sample that brings nothing would see does not matter.
    asked = np.flatnonzero(light > 0)
    clear = np.zeros(len(pair), bool)
    clear[asked] = ~occluders.blocked(picked(origin, asked), picked(target, asked))
    unblocked = light * clear
    share, left = dimmed(origin, target, clear, occluders)
    through = unblocked * share
    sums = np.zeros((7, len(node)))
    sums[:4] = [np.bincount(pair, part, len(node)) for part in (through, light, unblocked, unblocked * left)]
    wanted = np.zeros(len(node), bool)
    wanted[large] = True
    here = np.flatnonzero(wanted[pair])
    sums[4:] = [np.bincount(pair[here], through[here] * axis, len(node)) for axis in target[here].T]
    return sums, len(asked)


def _targets(
    origin: Float, normal: Float, receiver: Int, node: Int, turn: Int, targets: SourcePoints
) -> tuple[Float, Float]:
    """Return points on nodes, and the light that each would bring."""
    # Each receiver begins somewhere else in the sequence, so that the errors of neighbours cancel instead of agreeing.
    at = node * GOLDEN
    index = np.stack([turn * step + receiver * other + at for step, other in zip(_STEP, _STEP[::-1], strict=True)]).T
    target, light = _drawn(origin, normal, node, index, targets)
    # A point that faces away tells nothing of those that do not.
    blind = np.flatnonzero((light == 0) & ~targets.wide[node])
    for _ in range(_DRAWN_AGAIN):
        if not len(blind):
            break
        index[blind] += _ELSEWHERE
        target[blind], light[blind] = _drawn(
            picked(origin, blind), picked(normal, blind), node[blind], picked(index, blind), targets
        )
        blind = blind[light[blind] == 0]
    return target, light


def _drawn(origin: Float, normal: Float, node: Int, index: Float, targets: SourcePoints) -> tuple[Float, Float]:
    """Draw a point of each node by numbers of which the fraction counts, shape (k, 2); otherwise as `_targets`."""
    u, v = (index - np.floor(index)).T
    target, facing = targets.draw(node, u, v)
    weight = np.ones(len(node))
    close, target_close, weight_close = targets.draw_near(origin, node, u, v)
    target[close], weight[close] = target_close, weight_close
    to = target - origin
    there = -dots(facing, to)
    squared = dots(to, to)
    # Seen from within its plane, an element has a form factor as from its front.
    edge = _GRAZING * np.sqrt(squared)
    there = np.where(there > -edge, np.maximum(there, edge), 0)
    cosines = np.maximum(dots(normal, to), 0) * there
    return target, weight * cosines / np.maximum(squared * squared, 1e-300)
