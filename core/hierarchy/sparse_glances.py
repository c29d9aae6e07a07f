# SPDX-License-Identifier: GPL-3.0-or-later
"""What arrives at the corners of a fine mesh, of which some look for the others.

They lie so close that most have the indirect light of their neighbours. So only samples look at everything, and those
corners that do not see their sample or lie where samples differ; at elements that are lamps many more look. (Ward,
Rubinstein, Clear 1988 interpolate in the same spirit.)
"""

from collections.abc import Generator
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray

from ..occlusion.shared_out import SharedOut
from ..progress import Progress, scaled
from .bends import Bends
from .blending import blended
from .clustering import choose_samples
from .doubts import own_light
from .elements import Elements
from .glances import Corners, Glance, glance_at
from .lamplight import lamplight
from .neighbourhoods import find_neighbourhoods
from .outlook import Outlook
from .quality import Quality
from .receivers import DirectLight
from .samples import Samples
from .sights import joined, of_all
from .solve import Lit
from .strangers import along_mesh
from .tree import Float, Int

# Samples of a neighbourhood that differ by more than this share of their light leave room for shadows in between.
_DIFFER = 0.25
# How many times as far as usual it is from a lone corner to the next.
_LONE = 8.0
# One of so many corners looks at the lamps, but at least so many times as many as look at all else.
_OF_CORNERS, _MORE = 16, 2
# Share of the final gather that is done after the lamps, the samples, and what is doubted.
_LAMPS, _SAMPLES, _DOUBTS = 0.4, 0.6, 0.75


def sparse_glances(
    corners: Corners,
    lit: Lit,
    shown: Float,
    need: Float,
    quality: Quality,
    workers: Executor,
    rim: NDArray[np.bool_],
    edges: tuple[Int, Int],
    typical: float,
    sky: DirectLight | None,
    outlook: Outlook | None,
) -> Generator[Progress, None, Glance]:
    """Let many corners look at the lamps, and some look at everything for the others; otherwise as `glances`.

    Parameters
    ----------
    rim : ndarray of shape (q,)
        Corners where surfaces meet and light changes fast: those look themselves, if they are not too many.
    edges : tuple of two ndarrays of shape (e,)
        Corners that are neighbours on a smooth stretch.
    typical : float
        Irradiance that errors are judged by [W/m^2].
    sky : callable, optional
        Light of the sky, which counts among the others: it changes as slowly as what has bounced.
    outlook : Outlook or None
        What rays can see; None where nobody can be asked.
    """
    many, samples = _samples(corners, lit, quality, workers)
    lone = lone_corners(corners.point, edges, quality.corners // 2)
    lamps = lamplight(corners, lit, many, edges, lone, typical, quality.gather, workers)
    direct, links, rays = yield from scaled(lamps, 0, _LAMPS)
    # What samples see of the lamps is not what their neighbours see: it is told apart. So is what rays do not meet.
    known = np.column_stack((shown, lit.lamp))
    if outlook and not outlook.hits.blocks.all():
        known = np.hstack((known, np.where(outlook.hits.blocks[:, None], 0, outlook.sent)))
    looking = np.zeros(len(corners.point), bool)
    looking[samples.element] = True
    steps = glance_at(corners, samples.element, lit, known, need, quality.gather, workers)
    sampled = yield from scaled(steps, _LAMPS, _SAMPLES)
    indirect = _without_lamps(sampled)
    indirect[:, :6] += from_sky(corners, samples.element, sky)
    others = blended(samples, indirect, corners.point, corners.normal, edges, sampled.alone)
    covered, alone = sampled.covered[samples.cluster], sampled.alone[samples.cluster]
    others, learned = along_mesh(others, samples.stranger, covered | alone, edges)
    covered[learned] = alone[learned] = False
    sights = [of_all(sampled.sights, samples.element)]
    doubts = own_light(corners, samples, indirect, others, outlook, edges, quality, workers)
    own = yield from scaled(doubts, _SAMPLES, _DOUBTS)
    others, covered, alone = own.light, covered & ~own.open, alone & ~own.open
    # A few rays are not enough for all of a wall.
    looking |= own.sure & ~lone
    closer = _closer(samples, indirect[:, :3].mean(axis=1), looking, rim, lone, quality.corners)
    if len(closer):
        steps = glance_at(corners, closer, lit, known[:, :9], need, quality.gather, workers)
        more = yield from scaled(steps, _DOUBTS, 1)
        others[closer] = _without_lamps(more) + from_sky(corners, closer, sky)
        covered[closer], alone[closer] = more.covered, more.alone
        sights.append(of_all(more.sights, closer))
        links, rays = links + more.links, rays + more.rays
    links, rays = links + sampled.links, rays + sampled.rays + own.rays
    return Glance(np.tile(direct, 2), others, covered, alone, joined(sights), links, rays)


def _without_lamps(glance: Glance) -> Float:
    """Return what arrives but not straight from lamps, which columns 6 to 8 tell of, shape (k, 6 or 12) [W/m^2]."""
    light = glance.bright + glance.others
    others = np.maximum(light[:, :6] - np.tile(light[:, 6:9], 2), 0)
    return np.hstack((others, light[:, 9:]))


def from_sky(corners: Corners, which: Int, sky: DirectLight | None, bends: Bends | None = None) -> Float:
    """Ask for the light of the sky.

    Parameters
    ----------
    corners : Corners
    which : ndarray of shape (k,)
        At whom it arrives.
    sky : callable or None
    bends : Bends, optional
        Of those that it arrives at.

    Returns
    -------
    ndarray of shape (k, 6)
        Twice, as all light and as what is emitted [W/m^2].
    """
    if sky is None:
        return np.zeros((len(which), 6))
    return np.tile(sky(corners.point[which], corners.normal[which], horizons=bends), 2)


def _samples(corners: Corners, lit: Lit, quality: Quality, workers: Executor) -> tuple[Samples, Samples]:
    """Choose the corners that look at the lamps for others, and those that look at all else."""
    point, none = corners.point, np.zeros((len(corners.point), 3))
    places = Elements(
        corners=np.repeat(point[:, None], 4, axis=1),
        centre=point,
        normal=corners.normal,
        area=np.ones(len(point)),
        patch=np.zeros(len(point), np.int64),
        reflectance=none,
        emission=none,
        solid=np.ones(len(point)),
    )
    occluders = SharedOut(lit.scenery.occluders, workers)
    around = find_neighbourhoods(places, occluders, lit.sides, workers)
    most = max(len(point) // _OF_CORNERS, _MORE * quality.corners)
    many = choose_samples(places, occluders, most, around)
    return many, choose_samples(places, occluders, quality.corners, around, finer=many)


def lone_corners(point: Float, edges: tuple[Int, Int], most: int) -> NDArray[np.bool_]:
    """Return which corners have no neighbour nearby as most have, shape (q,), the loneliest if there are too many.

    Those of a wall of one face among fine things stand for all of it, and what would look for them may be a curtain
    before it.
    """
    one, other = edges
    way = point[one] - point[other]
    squared = (way * way).sum(axis=1)
    nearest = np.full(len(point), np.inf)
    np.minimum.at(nearest, one, squared)
    np.minimum.at(nearest, other, squared)
    # What has no neighbours at all is a point, and shows nothing.
    nearest[np.isinf(nearest)] = 0
    lone = np.zeros(len(point), bool)
    lone[np.argsort(-nearest, kind="stable")[:most]] = True
    lone &= nearest > _LONE**2 * np.median(nearest)
    return lone


def _closer(
    samples: Samples,
    light: Float,
    looking: NDArray[np.bool_],
    rim: NDArray[np.bool_],
    lone: NDArray[np.bool_],
    most: int,
) -> Int:
    """Return the corners that have to look, but not too many: lone ones, where samples differ most, and at edges."""
    regions = len(samples.slope)
    low, high = np.full(regions, np.inf), np.zeros(regions)
    order = np.argsort(samples.region, kind="stable")
    begin = np.searchsorted(samples.region[order], np.arange(regions))
    low, high = np.minimum.reduceat(light[order], begin), np.maximum.reduceat(light[order], begin)
    differ = ((high - low) / np.maximum(high + low, 1e-300))[samples.region][samples.cluster]
    differ[lone] = np.inf
    torn = np.flatnonzero(((differ > _DIFFER) | rim) & ~looking)
    return np.sort(torn[np.argsort(-differ[torn], kind="stable")[:most]])
