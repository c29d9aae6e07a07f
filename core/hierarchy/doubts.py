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
from .glances import Corners
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
    """What arrives at corners that know better than they were told.

    Attributes
    ----------
    which : ndarray of shape (k,)
        The corners.
    light : ndarray of shape (k, 6)
        All of it but from lamps, and what is emitted [W/m^2].
    sees : ndarray of shape (k,)
        Share of the rays that met something lit, or nothing.
    sure : ndarray of shape (k,)
        Who knows as well as those who look at everything.
    sample : ndarray of shape (m,)
        Samples among many of those: what they see themselves is more than what the others say.
    rays : int
    """

    which: Int
    light: Float
    sees: Float
    sure: NDArray[np.bool_]
    sample: NDArray[np.bool_]
    rays: int


def own_light(
    corners: Corners,
    samples: Samples,
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
    told : ndarray of shape (q, 6 or 12)
        What they say arrives but not from lamps, see `OwnLight`; in further columns the part of it that no ray meets.
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
    if outlook is None:
        none = np.zeros(0, np.int64)
        return OwnLight(none, np.zeros((0, 6)), np.zeros(0), none > 0, np.zeros(len(samples), bool), 0)
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
    light = told[which, :6] + trust[region[which], None] * _difference(own, told)
    sure = trust[region[which]] > _BELIEVED
    mostly = 2 * np.bincount(region[which], sure, len(trust)) > np.bincount(region)
    return OwnLight(which, light, own.sees, sure, mostly[samples.region], first.rays + own.rays)


def _pieces(samples: Samples, edges: tuple[Int, Int]) -> Int:
    """Return which corners of a cluster are one piece of the mesh: the same number, shape (q,)."""
    one, other = edges
    within = samples.cluster[one] == samples.cluster[other]
    return connected(one[within], other[within], len(samples.cluster))


def _scouts(doubting: Int, region: Int) -> NDArray[np.bool_]:
    """Return which of those who doubt peek first: a few of each region, from all over it, shape (k,)."""
    order = np.argsort(region[doubting], kind="stable")
    ordered = region[doubting][order]
    count = np.bincount(ordered)[ordered]
    place = np.arange(len(order)) - np.searchsorted(ordered, ordered)
    first = np.zeros(len(order), bool)
    first[order] = place * _SCOUTS // count != (place - 1) * _SCOUTS // count
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
