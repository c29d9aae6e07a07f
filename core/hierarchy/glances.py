# SPDX-License-Identifier: GPL-3.0-or-later
"""What arrives at many corners: from every bright cluster at each, and from all others at each or at samples of them.

The corners of a fine mesh lie so close that most have the indirect light of their neighbours. There only samples look
at everything, and those corners that do not see their sample or lie where samples differ; lamps are looked at by all.
(Ward, Rubinstein, Clear 1988 interpolate in the same spirit.)
"""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..progress import Progress
from .blending import blended
from .elements import Elements
from .exchange import stream_rows
from .linking import closures
from .probes import points_shut_in, receivers_shut_in
from .quality import Detail, Quality
from .receivers import DirectLight, group_receivers, group_size
from .rows import BRIGHT, gather
from .samples import Samples, choose_samples
from .scenery import node_means
from .sights import Sights, joined, large_sights, of_all
from .solve import Lit
from .tree import Float, Int

STAGE = "Final gather"
# Rows that add up to less see nothing but what is around them: covered, unless they look out.
COVERED = 0.02
# Samples of a neighbourhood that differ by more than this share of their light leave room for shadows in between.
_DIFFER = 0.25


@dataclass(frozen=True, eq=False)
class Corners:
    """Receivers that stand for the corners of a mesh.

    Attributes
    ----------
    point, normal : ndarray of shape (q, 3)
        [m]; unit length, on the side that shows.
    group : ndarray of shape (c,)
        Receiver of each of the scene's corners: one for each vertex and smooth group.
    """

    point: Float
    normal: Float
    group: Int


@dataclass(frozen=True, eq=False)
class Glance:
    """Light at q receivers.

    Attributes
    ----------
    bright, others : ndarray of shape (q, 6)
        Irradiance from bright clusters, and from the others: all of it, and what is emitted [W/m^2].
    covered : ndarray of shape (q,)
        Receivers inside or under other geometry.
    alone : ndarray of shape (q,)
        Receivers that see next to nothing, those that are covered included.
    sights : Sights
        What fills much of what a receiver sees.
    links, rays : int
    """

    bright: Float
    others: Float
    covered: NDArray[np.bool_]
    alone: NDArray[np.bool_]
    sights: Sights
    links: int
    rays: int


def glances(
    corners: Corners,
    lit: Lit,
    shown: Float,
    need: Float,
    quality: Quality,
    workers: Executor,
    size: int | None = None,
) -> Generator[Progress, None, Glance]:
    """Let every corner look at everything.

    Parameters
    ----------
    corners : Corners
    lit : Lit
    shown : ndarray of shape (n, 6)
        What the elements send: all of it, and what they emit [W/m^2].
    need : ndarray of shape (q,)
        How many times as much an error counts as where light is typical.
    quality : Quality
    workers : concurrent.futures.Executor
    size : int, optional
        Most corners in a group; by default as many as make it as wide as one of all corners.

    Yields
    ------
    Progress

    Returns
    -------
    Glance
    """
    everyone = np.arange(len(corners.point))
    return (yield from _glance(corners, everyone, lit, shown, need, quality.gather, workers, size))


def sparse_glances(
    corners: Corners,
    lit: Lit,
    shown: Float,
    need: Float,
    quality: Quality,
    workers: Executor,
    rim: NDArray[np.bool_],
    edges: tuple[Int, Int],
    sky: DirectLight | None = None,
) -> Generator[Progress, None, Glance]:
    """Let every corner look at the lamps, and some look at everything for the others; otherwise as `glances`.

    Parameters
    ----------
    rim : ndarray of shape (q,)
        Corners where surfaces meet and light changes fast: those look themselves, if they are not too many.
    edges : tuple of two ndarrays of shape (e,)
        Corners that are neighbours on a smooth stretch.
    sky : callable, optional
        Light of the sky, which counts among the others: it changes as slowly as what has bounced.
    """
    bright, links, rays = yield from _lamps(corners, lit, quality.gather, workers)
    # What samples see of the lamps is not what their neighbours see: it is told apart.
    known = np.column_stack((shown, lit.lamp))
    samples = _samples(corners, lit, quality)
    looking = np.zeros(len(corners.point), bool)
    looking[samples.element] = True
    sampled = yield from _glance(corners, samples.element, lit, known, need, quality.gather, workers)
    indirect = _without_lamps(sampled) + from_sky(corners, samples.element, sky)
    closer = _closer(samples, indirect[:, :3].mean(axis=1), looking, rim, quality.corners)
    sights = [of_all(sampled.sights, samples.element)]
    others = blended(samples, indirect, corners.point, corners.normal, edges, sampled.alone)
    covered, alone = sampled.covered[samples.cluster], sampled.alone[samples.cluster]
    if len(closer):
        more = yield from _glance(corners, closer, lit, known, need, quality.gather, workers)
        others[closer] = _without_lamps(more) + from_sky(corners, closer, sky)
        covered[closer], alone[closer] = more.covered, more.alone
        sights.append(of_all(more.sights, closer))
        links, rays = links + more.links, rays + more.rays
    return Glance(bright, others, covered, alone, joined(sights), links + sampled.links, rays + sampled.rays)


def _without_lamps(glance: Glance) -> Float:
    """Return what arrives but not straight from lamps, shape (k, 6) [W/m^2]; the last three columns told of lamps."""
    light = glance.bright + glance.others
    indirect: Float = np.maximum(light[:, :6] - np.tile(light[:, 6:], 2), 0)
    return indirect


def from_sky(corners: Corners, which: Int, sky: DirectLight | None) -> Float:
    """Ask for the light of the sky.

    Parameters
    ----------
    corners : Corners
    which : ndarray of shape (k,)
        At whom it arrives.
    sky : callable or None

    Returns
    -------
    ndarray of shape (k, 6)
        Twice, as all light and as what is emitted [W/m^2].
    """
    if sky is None:
        return np.zeros((len(which), 6))
    return np.tile(sky(corners.point[which], corners.normal[which]), 2)


def _samples(corners: Corners, lit: Lit, quality: Quality) -> Samples:
    """Choose the corners that look for others."""
    point, none = corners.point, np.zeros((len(corners.point), 3))
    places = Elements(
        corners=np.repeat(point[:, None], 4, axis=1),
        centre=point,
        normal=corners.normal,
        area=np.ones(len(point)),
        patch=np.zeros(len(point), np.int64),
        reflectance=none,
        emission=none,
    )
    return choose_samples(places, lit.scenery.occluders, quality.corners)


def _closer(samples: Samples, light: Float, looking: NDArray[np.bool_], rim: NDArray[np.bool_], most: int) -> Int:
    """Return the corners that have to look, but not too many: where samples around differ most, and at edges."""
    regions = len(samples.slope)
    low, high = np.full(regions, np.inf), np.zeros(regions)
    order = np.argsort(samples.region, kind="stable")
    begin = np.searchsorted(samples.region[order], np.arange(regions))
    low, high = np.minimum.reduceat(light[order], begin), np.maximum.reduceat(light[order], begin)
    differ = ((high - low) / np.maximum(high + low, 1e-300))[samples.region][samples.cluster]
    torn = np.flatnonzero(((differ > _DIFFER) | rim) & ~looking)
    return np.sort(torn[np.argsort(-differ[torn], kind="stable")[:most]])


def _lamps(
    corners: Corners, lit: Lit, detail: Detail, workers: Executor
) -> Generator[Progress, None, tuple[Float, int, int]]:
    """Gather the light straight from lamps at all corners, shape (q, 6) [W/m^2]."""
    light, links, rays = np.zeros((len(corners.point), 3)), 0, 0
    if lit.lamps is not None:
        shining = np.flatnonzero(lit.lamp.any(axis=1))
        means = node_means(lit.lamps.sources, lit.elements.area[shining], lit.lamp[shining])
        receivers = group_receivers(corners.point, corners.normal)
        for rows in stream_rows(receivers, lit.lamps, detail, workers):
            run = slice(receivers.first[rows.group[0]], receivers.first[rows.group[-1] + 1])
            light[receivers.index[run]] = gather(rows, receivers, means)
            links, rays = links + len(rows.weight), rays + rows.rays
            yield Progress(STAGE, 0.3 * (int(rows.group[-1]) + 1) / len(receivers))
    return np.tile(light, 2), links, rays


def _glance(
    corners: Corners,
    which: Int,
    lit: Lit,
    shown: Float,
    need: Float,
    detail: Detail,
    workers: Executor,
    size: int | None = None,
) -> Generator[Progress, None, Glance]:
    """Gather all light at some corners."""
    point, normal, scenery, elements = corners.point[which], corners.normal[which], lit.scenery, lit.elements
    receivers = group_receivers(point, normal, size or group_size(len(which), len(corners.point)))
    count, width = len(which), shown.shape[1]
    scale = float(np.max(shown, initial=0.0)) or 1.0
    means, lamp = node_means(scenery.sources, elements.area, shown / scale), scenery.brightness[:, None] > BRIGHT
    nodes = np.hstack((np.where(lamp, means, 0), np.where(lamp, 0, means)))
    parts, row_sums, sights, links, rays = [], [], [], 0, 0
    here = np.add.reduceat(need[which][receivers.index], receivers.first[:-1]) / np.diff(receivers.first)
    for rows in stream_rows(receivers, scenery, detail, workers, here):
        parts.append(gather(rows, receivers, nodes))
        row_sums.append(rows.sums)
        sights.append(large_sights(rows, receivers, scenery.sources.tree))
        links += len(rows.weight)
        rays += rows.rays
        yield Progress(STAGE, (int(rows.group[-1]) + 1) / len(receivers))
    gathered, sums = np.concatenate(parts), np.concatenate(row_sums)
    closure = closures(sums, receivers_shut_in(receivers, elements.corners, scenery.occluders))
    bright, others = np.zeros((count, width)), np.zeros((count, width))
    bright[receivers.index] = scale * gathered[:, :width]
    others[receivers.index] = scale * closure[:, None] * gathered[:, width:]
    covered, alone = np.zeros(count, bool), np.zeros(count, bool)
    dark = receivers.index[sums[:, 0] + closure * sums[:, 1] < COVERED]
    covered[dark] = points_shut_in(point[dark], normal[dark], elements.corners, scenery.occluders)
    alone[dark] = True
    return Glance(bright, others, covered, alone, joined(sights), links, rays)
