# SPDX-License-Identifier: GPL-3.0-or-later
"""Which convex parts face each other, and what enters the space between them.

The space between two convex parts is their convex hull, the shaft. A polygon that stays outside, or only touches the
shaft's skin, cannot block; one that enters counts with the portion in front of both parts' planes only.

References
----------
E. Haines, J. Wallace, Shaft culling for efficient ray-traced radiosity, Eurographics Workshop on Rendering 1991.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from ..arrays import FloatArray
from .convex_parts import ConvexPart, area_vector, cross, in_front, unit_normal

# Distances up to this share of the size of a pair count as touching.
TOUCHING = 1e-7


@dataclass(frozen=True, eq=False)
class View:
    """Two convex polygons that face each other.

    Attributes
    ----------
    polygons : tuple of int
        The two polygons that they are parts of.
    first, second : ndarray of shape (k, 3)
        What of the two parts is in front of the other's plane [m].
    normals : ndarray of shape (2, 3)
        Unit normals of the two.
    blockers : tuple of ndarray of shape (k, 3)
        Convex polygons that may stand between them, in front of both [m].
    margin : float
        Distance that counts as touching [m].
    """

    polygons: tuple[int, int]
    first: FloatArray
    second: FloatArray
    normals: FloatArray
    blockers: tuple[FloatArray, ...]
    margin: float


def views(parts: Sequence[ConvexPart]) -> Iterator[View]:
    """Yield every pair of parts of different polygons that have something in front of each other's planes.

    Parameters
    ----------
    parts : sequence of ConvexPart
        All of them block; pairs are yielded once, in order.
    """
    corners = np.concatenate([part.corners for part in parts])
    starts = np.concatenate([[0], np.cumsum([len(part.corners) for part in parts])])
    rows = [slice(a, b) for a, b in pairwise(starts)]
    # Of every corner from every part's plane.
    distances = np.stack([part.distances(corners) for part in parts])
    highest = np.stack([distances[:, row].max(axis=1) for row in rows], axis=1)
    lows = np.stack([part.corners.min(axis=0) for part in parts])
    highs = np.stack([part.corners.max(axis=0) for part in parts])
    for p, q in combinations(range(len(parts)), 2):
        margin = TOUCHING * float(np.linalg.norm(np.maximum(highs[p], highs[q]) - np.minimum(lows[p], lows[q])))
        if parts[p].polygon == parts[q].polygon or highest[p, q] <= margin or highest[q, p] <= margin:
            continue
        first = in_front(parts[p].corners, distances[q, rows[p]], margin)
        second = in_front(parts[q].corners, distances[p, rows[q]], margin)
        both = np.concatenate((first, second))
        near = (highest[p] > margin) & (highest[q] > margin)
        near &= (highs > both.min(axis=0) + margin).all(axis=1) & (lows < both.max(axis=0) - margin).all(axis=1)
        near[[p, q]] = False
        portions = [_between(parts[int(b)], parts[p], parts[q], margin) for b in np.flatnonzero(near)]
        blockers = _entering([portion for portion in portions if len(portion)], first, second, margin)
        normals = np.stack((parts[p].normal, parts[q].normal))
        yield View((parts[p].polygon, parts[q].polygon), first, second, normals, tuple(blockers), margin)


def contact_areas(parts: Sequence[ConvexPart], n_polygons: int) -> FloatArray:
    """Return the areas that polygons of opposite normals have in common in one plane.

    Parameters
    ----------
    parts : sequence of ConvexPart
        Of `n_polygons` polygons.

    Returns
    -------
    ndarray of shape (n_polygons, n_polygons)
        Symmetric [m^2].
    """
    areas = np.zeros((n_polygons, n_polygons))
    for p, q in combinations(parts, 2):
        both = np.concatenate((p.corners, q.corners))
        margin = TOUCHING * float(np.linalg.norm(np.ptp(both, axis=0)))
        if p.normal @ q.normal > -0.5 or np.abs(p.distances(both)).max() > margin:
            continue
        common = p.corners
        edges = np.roll(q.corners, -1, axis=0) - q.corners
        for corner, inward in zip(q.corners, cross(q.normal, edges), strict=True):
            if len(common):
                common = in_front(common, (common - corner) @ inward / np.linalg.norm(inward), margin)
        if len(common):
            areas[p.polygon, q.polygon] += np.linalg.norm(area_vector(common))
    return areas + areas.T


def _between(blocker: ConvexPart, first: ConvexPart, second: ConvexPart, margin: float) -> FloatArray:
    """Return the portion of a blocker in front of two parts."""
    portion = in_front(blocker.corners, first.distances(blocker.corners), margin)
    return in_front(portion, second.distances(portion), margin) if len(portion) else portion


def _entering(blockers: list[FloatArray], first: FloatArray, second: FloatArray, margin: float) -> Iterator[FloatArray]:
    """Yield the blockers that no plane separates from the shaft between two convex polygons.

    The planes tried are the shaft's own and the blocker's; the few that others would have sorted out cost time only.
    """
    if not blockers:
        return
    normals, offsets = _shaft_planes(first, second, margin)
    both = np.concatenate((first, second))
    for blocker in blockers:
        outside = (normals @ blocker.T - offsets[:, None]).max(axis=1) <= margin
        own = (both - blocker[0]) @ unit_normal(blocker)
        if not outside.any() and own.min() < -margin and own.max() > margin:
            yield blocker


def _shaft_planes(first: FloatArray, second: FloatArray, margin: float) -> tuple[FloatArray, FloatArray]:
    """Return unit normals, facing in, and offsets of the shaft's sides.

    Each holds an edge of one polygon and a corner of the other, and has all of both polygons on one side.
    """
    both = np.concatenate((first, second))
    found: list[tuple[FloatArray, FloatArray]] = []
    for one, other in ((first, second), (second, first)):
        edges = np.roll(one, -1, axis=0) - one
        normals = cross(edges[:, None], other - one[:, None])
        offsets = (normals * one[:, None]).sum(axis=2).ravel()
        normals = normals.reshape(-1, 3)
        lengths = np.linalg.norm(normals, axis=1)
        solid = lengths > margin * margin
        normals, offsets = normals[solid] / lengths[solid, None], offsets[solid] / lengths[solid]
        heights = normals @ both.T - offsets[:, None]
        for sign, bounds in ((1.0, heights.min(axis=1) >= -margin), (-1.0, heights.max(axis=1) <= margin)):
            found.append((sign * normals[bounds], sign * offsets[bounds]))
    return np.concatenate([n for n, _ in found]), np.concatenate([o for _, o in found])
