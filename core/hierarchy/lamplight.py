# SPDX-License-Identifier: GPL-3.0-or-later
"""Light straight from elements that are lamps, at the corners of a fine mesh: some look, and where it changes all do.

What arrives where nothing is in the way is known without a ray, so samples tell which share of that gets through. Where
those next to each other see about as much of the lamps, corners in between have the share that fades from one to the
other; round the edges of shadows every corner looks for itself.
"""

from collections.abc import Generator, Iterator
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray

from ..progress import Progress, scaled
from ..workers import in_order
from .blending import blended
from .exchange import stream_rows
from .filter import pairs_once
from .glances import STAGE, Corners
from .quality import Detail
from .receivers import group_receivers
from .rows import gather
from .samples import Samples
from .scenery import node_means
from .solve import Lit
from .tree import Float, Int
from .unblocked import unblocked_irradiance

# Samples next to each other that differ by more than this share of their light and of what is typical have an edge of a
# shadow between them.
_DIFFER = 0.2
# Share of the work that is done after the samples, and after what needs no rays.
_FIRST, _SECOND = 0.25, 0.4
# Corners that are lit without rays at a time, and how many such blocks ahead.
_BLOCK, _AHEAD = 1 << 14, 4
# Corners that look at a time: more than elsewhere, since each sees but a few lamps.
_TOGETHER = 1 << 13

Steps = Generator[Progress, None, tuple[Float, int, int]]


def lamplight(
    corners: Corners,
    lit: Lit,
    samples: Samples,
    edges: tuple[Int, Int],
    lone: NDArray[np.bool_],
    typical: float,
    detail: Detail,
    workers: Executor,
) -> Steps:
    """Gather the light straight from lamps at all corners.

    Parameters
    ----------
    corners : Corners
    lit : Lit
    samples : Samples
        Of the corners: who looks first.
    edges : tuple of two ndarrays of shape (e,)
        Corners that are neighbours on a smooth stretch.
    lone : ndarray of shape (q,)
        Corners that nobody else looks for.
    typical : float
        Irradiance that errors are judged by [W/m^2].
    detail : Detail
    workers : concurrent.futures.Executor

    Yields
    ------
    Progress

    Returns
    -------
    light : ndarray of shape (q, 3)
        [W/m^2].
    links, rays : int
    """
    if lit.lamps is None:
        return np.zeros((len(corners.point), 3)), 0, 0
    if samples.single:
        return (yield from _seen(corners, np.arange(len(corners.point)), lit, detail, workers))
    sampled, links, rays = yield from scaled(_seen(corners, samples.element, lit, detail, workers), 0, _FIRST)
    bare = np.zeros((len(corners.point), 3))
    for done, (which, light) in enumerate(_bare(corners, samples.order, lit, workers)):
        bare[which] = light
        yield Progress(STAGE, _FIRST + (_SECOND - _FIRST) * min(1, (done + 1) * _BLOCK / len(bare)))
    whole = bare[samples.element]
    share = np.divide(sampled, whole, out=np.zeros_like(sampled), where=whole > 0)
    light = bare * blended(samples, share, corners.point, corners.normal, edges, ~whole.any(axis=1))
    light[samples.element] = sampled
    torn = lone | _torn(samples, share.mean(axis=1), whole.mean(axis=1), edges, typical)
    torn[samples.element] = False
    closer = np.flatnonzero(torn & bare.any(axis=1))
    if len(closer):
        steps = _seen(corners, closer, lit, detail, workers)
        light[closer], more_links, more_rays = yield from scaled(steps, _SECOND, 1)
        links, rays = links + more_links, rays + more_rays
    return light, links, rays


def _bare(corners: Corners, order: Int, lit: Lit, workers: Executor) -> Iterator[tuple[Int, Float]]:
    """Yield the corners, in such an order and some at a time, and the light that would come if nothing was between."""
    assert lit.lamps is not None
    sources, shining = lit.lamps.sources, np.flatnonzero(lit.lamp.any(axis=1))
    means = node_means(sources, lit.elements.area[shining], lit.lamp[shining])
    emitters = lit.elements.corners[shining]

    def compute(which: Int) -> tuple[Int, Float]:
        point, normal = corners.point[which], corners.normal[which]
        return which, unblocked_irradiance(point, normal, sources, emitters, means)

    parts = [order[first : first + _BLOCK] for first in range(0, len(order), _BLOCK)]
    return in_order(workers, compute, parts, _AHEAD)


def _torn(samples: Samples, share: Float, whole: Float, edges: tuple[Int, Int], typical: float) -> NDArray[np.bool_]:
    """Return which corners are among samples that see more and less of the lamps, shape (q,)."""
    one, other = pairs_once(samples.cluster[edges[0]], samples.cluster[edges[1]])
    # Who looks away from the lamps says nothing about what is between.
    low, high = np.where(whole > 0, share, np.inf), np.where(whole > 0, share, -np.inf)
    least, most = low.copy(), high.copy()
    for at, beside in ((one, other), (other, one)):
        np.minimum.at(least, at, low[beside])
        np.maximum.at(most, at, high[beside])
    known = (whole > 0) & (least <= most)
    least, most = np.where(known, least, 0) * whole, np.where(known, most, 0) * whole
    differ = most - least > _DIFFER * (most + least + typical)
    torn: NDArray[np.bool_] = (differ | ~known)[samples.cluster]
    return torn


def _seen(corners: Corners, which: Int, lit: Lit, detail: Detail, workers: Executor) -> Steps:
    """Let some corners look at the lamps, otherwise as `lamplight`; shape (k, 3)."""
    assert lit.lamps is not None
    light, links, rays = np.zeros((len(which), 3)), 0, 0
    shining = np.flatnonzero(lit.lamp.any(axis=1))
    means = node_means(lit.lamps.sources, lit.elements.area[shining], lit.lamp[shining])
    point, normal = corners.point[which], corners.normal[which]
    receivers = group_receivers(point, normal, workers=workers)
    for rows in stream_rows(receivers, lit.lamps, detail, workers, most=_TOGETHER):
        run = slice(receivers.first[rows.group[0]], receivers.first[rows.group[-1] + 1])
        light[receivers.index[run]] = gather(rows, receivers, means)
        links, rays = links + len(rows.weight), rays + rows.rays
        yield Progress(STAGE, (int(rows.group[-1]) + 1) / len(receivers))
    return light, links, rays
