# SPDX-License-Identifier: GPL-3.0-or-later
"""Peeks: what corners see with a few rays of their own.

A dozen rays tell roughly what arrives, and what is seen by neighbours who would see the same from here makes it
smoother (Ward, Rubinstein, Clear 1988: as far as surfaces are away).
"""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from ..progress import Progress, scaled
from ..workers import in_order
from .glances import STAGE, Corners
from .outlook import Outlook
from .probes import ways_round
from .tree import Float, Int

# Neighbours see the same up to this distance, as a share of how far away surfaces are, and turn of the normal.
_ALIKE = 0.6
# Who is so much alike needs no rays of his own.
_ENOUGH = 0.7
# Share of the work that is done after those who speak for others.
_FIRST = 0.5
# Rays that are cast together, and how many such parts ahead.
_BLOCK, _AHEAD = 1 << 16, 4


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


def peeks(
    corners: Corners,
    which: Int,
    piece: Int,
    outlook: Outlook,
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
    outlook : Outlook
    rays : int
        Of each that casts any.
    workers : concurrent.futures.Executor

    Yields
    ------
    Progress

    Returns
    -------
    Peeks
        In the order of `which`.
    """
    _, first, speaker = np.unique(piece[which], return_index=True, return_inverse=True)
    speaker = speaker.reshape(-1)
    own = yield from scaled(_cast(corners, which[first], outlook, rays, workers), 0, _FIRST)
    *_, apart = own
    alike = _alike(apart[speaker], corners, which[first][speaker], which) > _ENOUGH
    alike[first] = True
    others = which[~alike]
    more = yield from scaled(_cast(corners, others, outlook, rays, workers), _FIRST, 1)
    speaker[~alike] = len(first) + np.arange(len(others))
    light, variance, sees, apart = (np.concatenate(pair)[speaker] for pair in zip(own, more, strict=True))
    return Peeks(which, light, variance, sees, apart, rays * (len(first) + len(others)))


def _cast(
    corners: Corners, which: Int, outlook: Outlook, rays: int, workers: Executor
) -> Generator[Progress, None, tuple[Float, Float, Float, Float]]:
    """Let each of some corners cast its own rays; return light, variance, what is seen and how far, see `Peeks`."""

    def compute(part: Int) -> tuple[Float, Float, Float, Float]:
        way = ways_round(np.repeat(corners.normal[part, None], rays, axis=1), part).reshape(-1, 3)
        light, lit, distance = outlook.look(np.repeat(corners.point[part], rays, axis=0), way)
        light, lit = light.reshape(-1, rays, 6), lit.reshape(-1, rays)
        near = (1 / np.maximum(distance, 1e-300)).reshape(-1, rays).mean(axis=1)
        chance = light[:, :, :3].mean(axis=2).var(axis=1, ddof=1) / rays
        return light.mean(axis=1), chance, lit.mean(axis=1), 1 / np.maximum(near, 1e-300)

    step = max(1, _BLOCK // rays)
    blocks = [which[begin : begin + step] for begin in range(0, len(which), step)]
    none = np.zeros(0)
    parts = [(np.zeros((0, 6)), none, none, none)]
    for part in in_order(workers, compute, blocks, _AHEAD):
        parts.append(part)
        yield Progress(STAGE, (len(parts) - 1) / len(blocks))
    light, variance, sees, apart = (np.concatenate(column) for column in zip(*parts, strict=True))
    return light, variance, sees, apart


def _alike(apart: Float, corners: Corners, one: Int, other: Int) -> Float:
    """Return how far pairs of corners see the same, 0 to 1, where surfaces are so far away, shape (k,)."""
    way = np.sqrt(((corners.point[one] - corners.point[other]) ** 2).sum(axis=1))
    turn = np.sqrt(np.maximum(1 - (corners.normal[one] * corners.normal[other]).sum(axis=1), 0))
    alike: Float = np.maximum(1 - (way / np.maximum(apart, 1e-300) + turn) / _ALIKE, 0)
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
    peeking = (one >= 0) & (other >= 0)
    one, other = one[peeking], other[peeking]
    apart = np.minimum(peeks.apart[one], peeks.apart[other])
    weight = _alike(apart, corners, peeks.which[one], peeks.which[other])
    count = len(peeks.which)

    def sums(values: Float, weight: Float) -> Float:
        into = np.bincount(one, weight * values[other], count) + np.bincount(other, weight * values[one], count)
        total: Float = values + into
        return total

    total = sums(np.ones(count), weight)
    light = np.stack([sums(column, weight) for column in peeks.light.T], axis=1) / total[:, None]
    return replace(peeks, light=light, variance=sums(peeks.variance, weight**2) / total**2)
