# SPDX-License-Identifier: GPL-3.0-or-later
"""What arrives at corners that look at everything: from bright clusters, and from all others."""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..occlusion.shared_out import SharedOut
from ..progress import Progress
from .bends import Bends, over_horizons
from .exchange import stream_rows
from .linking import closures
from .probes import all_shut_in, points_shut_in
from .quality import Detail, Quality
from .receivers import group_receivers, group_size
from .rows import BRIGHT, gather
from .scenery import node_means
from .sights import Sights, joined, large_sights
from .solve import Lit
from .tree import Float, Int

STAGE = "Final gather"
# Rows that add up to less see nothing but what is around them: covered, unless they look out.
COVERED = 0.02


@dataclass(frozen=True, eq=False)
class Corners:
    """Receivers that stand for the corners of a mesh.

    Attributes
    ----------
    point, normal : ndarray of shape (q, 3)
        [m]; unit length, on the side that shows.
    group : ndarray of shape (c,)
        Receiver of each of the scene's corners: one for each vertex and smooth group, but for notches.
    whole : ndarray of shape (c,), optional
        What is to look alike, where that is told apart.
    """

    point: Float
    normal: Float
    group: Int
    whole: Int | None = None


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
    bends: Bends | None = None,
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
    bends : Bends, optional
        Of all corners; where not given, they see all that is above them.

    Yields
    ------
    Progress

    Returns
    -------
    Glance
    """
    everyone = np.arange(len(corners.point))
    return (yield from glance_at(corners, everyone, lit, shown, need, quality.gather, workers, size, bends))


def glance_at(
    corners: Corners,
    which: Int,
    lit: Lit,
    shown: Float,
    need: Float,
    detail: Detail,
    workers: Executor,
    size: int | None = None,
    bends: Bends | None = None,
) -> Generator[Progress, None, Glance]:
    """Gather all light at some corners.

    Parameters
    ----------
    corners : Corners
    which : ndarray of shape (k,)
        Those that look.
    lit, shown, need, workers, size, bends
        See `glances`.
    detail : Detail
        Of the links.

    Yields
    ------
    Progress

    Returns
    -------
    Glance
    """
    point, normal, scenery, elements = corners.point[which], corners.normal[which], lit.scenery, lit.elements
    receivers = group_receivers(point, normal, size or group_size(len(which), len(corners.point)))
    count, width = len(which), shown.shape[1]
    scale = float(np.max(shown, initial=0.0)) or 1.0
    means, lamp = node_means(scenery.sources, elements.area, shown / scale), scenery.brightness[:, None] > BRIGHT
    nodes = np.hstack((np.where(lamp, means, 0), np.where(lamp, 0, means)))
    parts, row_sums, sights, links, rays = [], [], [], 0, 0
    bends = bends.pick(which) if bends else None
    emits = np.minimum(means[:, 3:6].sum(axis=1) / np.maximum(means[:, :3].sum(axis=1), 1e-300), 1)
    here = np.add.reduceat(need[which][receivers.index], receivers.first[:-1]) / np.diff(receivers.first)
    for rows in stream_rows(receivers, scenery, detail, workers, here):
        rows = over_horizons(rows, receivers, bends, scenery.sources, emits) if bends else rows
        parts.append(gather(rows, receivers, nodes))
        row_sums.append(rows.sums)
        sights.append(large_sights(rows, receivers, scenery.sources.tree))
        links += len(rows.weight)
        rays += rows.rays
        yield Progress(STAGE, (int(rows.group[-1]) + 1) / len(receivers))
    gathered, sums = np.concatenate(parts), np.concatenate(row_sums)
    # Where some see a way out, others may have missed it: what is closed would show beside what is not.
    asked = SharedOut(scenery.occluders, workers)
    shut = all_shut_in(receivers, elements.corners, asked)
    closure = closures(sums, np.full(count, shut), detail)
    bright, others = np.zeros((count, width)), np.zeros((count, width))
    bright[receivers.index] = scale * gathered[:, :width]
    others[receivers.index] = scale * closure[:, None] * gathered[:, width:]
    covered, alone = np.zeros(count, bool), np.zeros(count, bool)
    dark = receivers.index[sums[:, 0] + closure * sums[:, 1] < COVERED]
    covered[dark] = points_shut_in(point[dark], normal[dark], elements.corners, asked)
    alone[dark] = True
    return Glance(bright, others, covered, alone, joined(sights), links, rays)
