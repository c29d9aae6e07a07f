# SPDX-License-Identifier: GPL-3.0-or-later
"""Doubts: corners that may see something else than who looks for them.

Among leaves, grass or shelves the light of each corner is another: the sky through a gap, or none. Whoever is not one
piece with his sample, or does not see it, may doubt what he is told. Who does not see it peeks; of the others some do,
and all where that differs by more than chance. What they see is believed as far as their rays can be.
"""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..facing.connected import connected
from ..progress import Progress, scaled
from ..runs import counted
from .glances import COVERED, Corners
from .outlook import Outlook
from .peeks import Peeks, evened, peeks
from .quality import Quality
from .samples import Samples
from .thickets import rays_of
from .tree import Float, Int

# Rays of all who peek, as a share of those of all who look, and the fewest and most of each.
_SHARE, _FEWEST, _MOST = 0.5, 16, 256
# So many of a region that see their sample peek first, and all do where those are to be believed by more than this.
_SCOUTS, _BELIEVED = 8, 0.5
# Share of the work that is done after those.
_FIRST = 0.25


@dataclass(frozen=True, eq=False)
class OwnLight:
    """What arrives at q corners, some of which know better than they were told.

    Attributes
    ----------
    light : ndarray of shape (q, 6)
        All of it but from lamps, and what is emitted [W/m^2].
    sure : ndarray of shape (q,)
        Who knows as well as those who look at everything.
    open : ndarray of shape (q,)
        Who is sure to see something.
    rays : int
    """

    light: Float
    sure: NDArray[np.bool_]
    open: NDArray[np.bool_]
    rays: int


def own_light(
    corners: Corners,
    samples: Samples,
    seen: Float,
    told: Float,
    outlook: Outlook | None,
    edges: tuple[Int, Int],
    quality: Quality,
    workers: Executor,
) -> Generator[Progress, None, OwnLight]:
    """Let corners find out what arrives where they are told something else.

    Parameters
    ----------
    corners : Corners
    samples : Samples
        Who looks for them.
    seen : ndarray of shape (m, 6 or 12)
        What arrives there but not from lamps, see `OwnLight`; in further columns the part of it that no ray meets.
    told : ndarray of shape (q, 6 or 12)
        What the corners are told of that.
    outlook : Outlook or None
        What they can see but for lamps; None where nobody can look.
    edges : tuple of two ndarrays of shape (e,)
        Corners that are neighbours on a smooth stretch.
    quality : Quality
    workers : concurrent.futures.Executor

    Yields
    ------
    Progress

    Returns
    -------
    OwnLight
    """
    light, nobody = told[:, :6].copy(), np.zeros(len(told), bool)
    if outlook is None:
        return OwnLight(light, nobody, nobody, 0)
    piece = _pieces(samples, edges)
    doubts = samples.stranger | (piece != piece[samples.element][samples.cluster])
    region = samples.region[samples.cluster]
    near = np.flatnonzero(doubts & ~samples.stranger)
    scouts = near[_scouts(near, region)]
    first = yield from scaled(peeks(corners, scouts, piece, outlook, _FEWEST, workers), 0, _FIRST)
    doubts = samples.stranger | (doubts & (_believed(first, told, region) > _BELIEVED)[region])
    which = np.flatnonzero(doubts)
    budget = _SHARE * quality.corners * rays_of(quality.gather)
    rays = int(np.clip(budget / max(len(which), 1), _FEWEST, _MOST))
    own = yield from scaled(peeks(corners, which, piece, outlook, rays, workers), _FIRST, 1)
    own = evened(own, corners, edges)
    trust = _believed(own, told, region)
    light[which] += trust[region[which], None] * _difference(own, told)
    sure, sees = doubts & (trust > _BELIEVED)[region], nobody.copy()
    sees[which] = own.sees > COVERED
    # What a sample sees itself is more than what the others round it say, where most have light of their own.
    mostly = 2 * np.bincount(region, sure) > np.bincount(region)
    alone = mostly[samples.region]
    light[samples.element[alone]] = seen[alone, :6]
    return OwnLight(light, sure, sure & sees, first.rays + own.rays)


def _pieces(samples: Samples, edges: tuple[Int, Int]) -> Int:
    """Return which corners of a cluster are one piece of the mesh: the same number, shape (q,)."""
    one, other = edges
    within = samples.cluster[one] == samples.cluster[other]
    return connected(one[within], other[within], len(samples.cluster))


def _scouts(doubting: Int, region: Int) -> NDArray[np.bool_]:
    """Return which of those who doubt peek first: a few of each region, from all over it, shape (k,)."""
    run, place = counted(count := np.bincount(region[doubting]))
    first = np.zeros(len(doubting), bool)
    order = np.argsort(region[doubting], kind="stable")
    first[order] = place * _SCOUTS // count[run] != (place - 1) * _SCOUTS // count[run]
    return first


def _difference(own: Peeks, told: Float) -> Float:
    """Return how much more corners see than they are told, but for what no ray meets, shape (k, 6)."""
    told = told[own.which]
    differ: Float = own.light - told[:, :6]
    if told.shape[1] > 6:
        differ += told[:, 6:]
    return differ


def _believed(own: Peeks, told: Float, region: Int) -> Float:
    """Return how far what corners see is to be believed beside what they are told, 0 to 1, shape (regions,).

    So that the error is least on the mean of a region (empirical Bayes: Efron, Morris 1973).
    """
    count, at = int(np.max(region)) + 1, region[own.which]
    apart = _difference(own, told)[:, :3].mean(axis=1)
    differ, chance = np.bincount(at, apart * apart, count), np.bincount(at, own.variance, count)
    return np.divide(np.maximum(differ - chance, 0), differ, out=np.zeros(count), where=differ > 0)
