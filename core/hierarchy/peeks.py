# SPDX-License-Identifier: GPL-3.0-or-later
"""Peeks: what corners see with a few rays of their own.

A dozen rays tell roughly what arrives, and what is seen by neighbours who would see the same from here makes it
smoother (Ward, Rubinstein, Clear 1988: as far as surfaces are away).
"""

from collections.abc import Generator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..lighting.sky import SkyLamp
from ..progress import Progress, scaled
from ..visibility import panes_of, sky_occluders
from ..workers import in_order
from .element_hits import ElementHits
from .glances import STAGE, Corners
from .probes import ways_round
from .solve import Lit
from .tree import Float, Int

# Neighbours see the same up to this distance, as a share of how far away surfaces are, and turn of the normal.
_ALIKE = 0.6
# Who is so much alike needs no rays of his own.
_ENOUGH = 0.7
# Share of the work that is done after those who speak for others.
_FIRST = 0.5
# Rays that are cast together, and how many such parts ahead.
_BLOCK, _AHEAD = 1 << 16, 4


_COLUMNS = ("which", "light", "variance", "sees", "apart")


@dataclass(frozen=True, eq=False)
class Peeks:
    """What some corners see.

    Attributes
    ----------
    which : ndarray of shape (k,)
        The corners.
    light : ndarray of shape (k, 6)
        What arrives from what blocks and from the sky, but not from lamps: all of it, and what is emitted [W/m^2].
    variance : ndarray of shape (k,)
        Of its mean over the colors, by chance [W^2/m^4].
    sees : ndarray of shape (k,)
        Share of the rays that met something from the side that has light, or nothing.
    apart : ndarray of shape (k,)
        Harmonic mean of how far away that is [m].
    rays : int
    """

    which: Int
    light: Float
    variance: Float
    sees: Float
    apart: Float
    rays: int

    def pick(self, at: Int) -> "Peeks":
        """Return what some of the corners see, with all rays."""
        return replace(self, **{name: getattr(self, name)[at] for name in _COLUMNS})


def peeks(
    corners: Corners,
    which: Int,
    piece: Int,
    lit: Lit,
    sent: Float,
    skies: Sequence[SkyLamp],
    rays: int,
    workers: Executor,
) -> Generator[Progress, None, Peeks]:
    """Let corners cast a few rays each, or one for several that would see the same.

    Parameters
    ----------
    corners : Corners
    which : ndarray of shape (k,)
        Those that are to know.
    piece : ndarray of shape (q,)
        Which piece of a mesh all corners are on: those of one may see the same.
    lit : Lit
        With thickets in its scenery.
    sent : ndarray of shape (n, 6)
        What the elements send but for lamps: all of it, and what they emit [W/m^2].
    skies : sequence of SkyLamp
    rays : int
        Of each that casts any.
    workers : concurrent.futures.Executor

    Yields
    ------
    Progress

    Returns
    -------
    Peeks
    """
    _, first, of = np.unique(piece[which], return_index=True, return_inverse=True)
    own = yield from scaled(_cast(corners, which[first], lit, sent, skies, rays, workers), 0, _FIRST)
    speaker = of.reshape(-1)
    alike = _alike(own, speaker, corners, own.which[speaker], which) > _ENOUGH
    alike[first] = True
    others = np.flatnonzero(~alike)
    told = own.pick(speaker[alike])
    same = replace(told, which=which[alike], rays=own.rays)
    if not len(others):
        return same
    return both(same, (yield from scaled(_cast(corners, which[others], lit, sent, skies, rays, workers), _FIRST, 1)))


def _cast(
    corners: Corners,
    which: Int,
    lit: Lit,
    sent: Float,
    skies: Sequence[SkyLamp],
    rays: int,
    workers: Executor,
) -> Generator[Progress, None, Peeks]:
    """Let each of some corners cast its own rays, otherwise as `peeks`."""
    assert lit.scenery.thickets is not None
    hits = lit.scenery.thickets.hits
    reach = 2 * float(np.linalg.norm(np.ptp(lit.elements.corners.reshape(-1, 3), axis=0))) + 1e-300

    def compute(part: Int) -> tuple[Float, ...]:
        return _peek(corners.point[part], corners.normal[part], part, rays, reach, lit, hits, sent, skies)

    step = max(1, _BLOCK // rays)
    blocks = [which[first : first + step] for first in range(0, len(which), step)]
    parts = []
    for part in in_order(workers, compute, blocks, _AHEAD):
        parts.append(part)
        yield Progress(STAGE, len(parts) / len(blocks))
    light, variance, sees, apart = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Peeks(which, light, variance, sees, apart, rays * len(which))


def _peek(
    point: Float,
    normal: Float,
    number: Int,
    rays: int,
    reach: float,
    lit: Lit,
    hits: ElementHits,
    sent: Float,
    skies: Sequence[SkyLamp],
) -> tuple[Float, Float, Float, Float]:
    """Return light, variance, and what is seen of some corners, see `Peeks`."""
    way = ways_round(np.repeat(normal[:, None], rays, axis=1), number).reshape(-1, 3)
    origin = np.repeat(point, rays, axis=0)
    element, distance = hits.met(origin, way)
    met, free = np.flatnonzero(element >= 0), np.isinf(distance)
    light = np.zeros((len(origin), 6))
    end = origin + np.minimum(distance, reach)[:, None] * way
    light[met] = sent[element[met]]
    panes = panes_of(lit.scenery.occluders)
    if panes is not None:
        light[met] *= np.tile(panes.tint(origin[met], end[met]), 2)
    light += np.tile(_sky(point, normal, origin, way, reach, free, lit, skies), 2)
    grey = light[:, :3].mean(axis=1).reshape(-1, rays)
    sees = (free | (element >= 0)).reshape(-1, rays).mean(axis=1)
    apart = 1 / np.maximum((1 / np.maximum(distance, 1e-300)).reshape(-1, rays).mean(axis=1), 1e-300)
    return light.reshape(-1, rays, 6).mean(axis=1), grey.var(axis=1, ddof=1) / rays, sees, apart


def _sky(
    point: Float,
    normal: Float,
    origin: Float,
    way: Float,
    reach: float,
    free: NDArray[np.bool_],
    lit: Lit,
    skies: Sequence[SkyLamp],
) -> Float:
    """Return what rays see of the sky, of which those that are free meet nothing, shape (m, 3) [W/m^2]."""
    light = np.zeros((len(origin), 3))
    occluders = lit.scenery.occluders
    blockers = sky_occluders(occluders)
    if blockers is not occluders:
        free = ~blockers.blocked(origin, origin + reach * way)
    out = np.flatnonzero(free)
    panes = panes_of(blockers)
    for sky in skies:
        if sky.shadows:
            seen = np.pi * sky.seen(way[out])
            light[out] += seen if panes is None else seen * panes.tint(origin[out], origin[out] + reach * way[out])
        else:
            light += np.repeat(sky.unshadowed(point, normal), len(origin) // len(point), axis=0)
    return light


def both(one: Peeks, other: Peeks) -> Peeks:
    """Return what some corners see and what others do."""
    columns = {name: np.concatenate((getattr(one, name), getattr(other, name))) for name in _COLUMNS}
    return Peeks(**columns, rays=one.rays + other.rays)


def _alike(peeks: Peeks, at: Int, corners: Corners, one: Int, other: Int) -> Float:
    """Return how far pairs of corners see the same, 0 to 1, shape (k,), as far as surfaces are away from some."""
    apart = np.maximum(peeks.apart[at], 1e-300)
    way = np.sqrt(((corners.point[one] - corners.point[other]) ** 2).sum(axis=1))
    turn = np.sqrt(np.maximum(1 - (corners.normal[one] * corners.normal[other]).sum(axis=1), 0))
    alike: Float = np.maximum(1 - (way / apart + turn) / _ALIKE, 0)
    return alike


def evened(peeks: Peeks, corners: Corners, edges: tuple[Int, Int]) -> Peeks:
    """Let corners learn from neighbours that see the same.

    Parameters
    ----------
    peeks : Peeks
    corners : Corners
    edges : tuple of two ndarrays of shape (e,)
        Corners that are neighbours on a smooth stretch.

    Returns
    -------
    Peeks
        With means, and their variance.
    """
    place = np.full(len(corners.point), -1)
    place[peeks.which] = np.arange(len(peeks.which))
    one, other = (place[end] for end in edges)
    both = (one >= 0) & (other >= 0)
    one, other = one[both], other[both]
    weight = np.minimum(
        _alike(peeks, one, corners, peeks.which[one], peeks.which[other]),
        _alike(peeks, other, corners, peeks.which[one], peeks.which[other]),
    )
    count = len(place[peeks.which])
    total = 1 + np.bincount(one, weight, count) + np.bincount(other, weight, count)

    def sums(values: Float, weight: Float) -> Float:
        return (
            values + np.bincount(one, weight * values[other], count) + np.bincount(other, weight * values[one], count)
        )

    light = np.stack([sums(column, weight) for column in peeks.light.T], axis=1) / total[:, None]
    return replace(peeks, light=light, variance=sums(peeks.variance, weight**2) / total**2)
