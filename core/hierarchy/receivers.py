# SPDX-License-Identifier: GPL-3.0-or-later
"""Receivers of light, in groups that share one list of sources.

Receivers are points with a normal: patch centres for the solution, mesh corners for the final gather. Neighbours see
nearly the same clusters, so the hierarchy is walked once for a group and its links form a small dense block.
"""

from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..lighting.soft_shadows import Horizons
from .tree import Float, Int, build_tree

GROUP_SIZE = 16
# Samples lie far apart for the size of what is around them: in large groups, all that is within would count as near.
SPARSE_SIZE = 2


class DirectLight(Protocol):
    """Light that no element sends."""

    def __call__(
        self,
        points: Float,
        normals: Float,
        /,
        *,
        dense: bool = False,
        shadowed: bool = True,
        horizons: Horizons | None = None,
    ) -> Float:
        """Return the irradiance at points with normals, (n, 3) and (n, 3) to (n, 3); see `lamp_irradiance`."""
        ...


def group_size(looking: int, among: int) -> int:
    """Return how many receivers to put in a group, so that it is about as wide as one of all would be.

    Parameters
    ----------
    looking, among : int
        How many receive, and how many they speak for.
    """
    return max(SPARSE_SIZE, GROUP_SIZE * looking // max(among, 1))


@dataclass(frozen=True, eq=False)
class Receivers:
    """Points that light is gathered at, sorted by group. Vectors lie in Fortran's order, see `vectors`.

    Attributes
    ----------
    index : ndarray of shape (r,)
        Where each receiver stood in the caller's order.
    point : ndarray of shape (r, 3)
        [m].
    normal : ndarray of shape (r, 3)
        Unit length.
    first : ndarray of shape (g + 1,)
        First receiver of each group.
    centre : ndarray of shape (g, 3)
        Of each group [m].
    radius : ndarray of shape (g,)
        Of the sphere about `centre` that holds the group [m].
    axis : ndarray of shape (g, 3)
        Mean normal.
    cone : ndarray of shape (g,)
        Sine of the largest angle between `axis` and a normal of the group; 1 for more than a right angle.
    depth : ndarray of shape (g,)
        Largest distance of a receiver from the plane through `centre` across `axis` [m].
    """

    index: Int
    point: Float
    normal: Float
    first: Int
    centre: Float
    radius: Float
    axis: Float
    cone: Float
    depth: Float

    def __len__(self) -> int:
        return len(self.radius)


def group_receivers(point: Float, normal: Float, size: int = GROUP_SIZE, workers: Executor | None = None) -> Receivers:
    """Sort receivers into groups of neighbours that look the same way.

    Parameters
    ----------
    point, normal : ndarray of shape (r, 3)
        [m]; unit length.
    size : int
        Most receivers in a group.
    workers : concurrent.futures.Executor, optional
        See `build_tree`.

    Returns
    -------
    Receivers
    """
    tree = build_tree(point, normal, most=size, workers=workers)
    nodes = tree.cut(size)
    index = tree.order
    first = np.append(tree.start[nodes], len(index))
    point, normal = np.asfortranarray(point[index]), np.asfortranarray(normal[index])
    count = np.diff(first)
    group = np.repeat(np.arange(len(count)), count)
    begin = first[:-1]
    centre = 0.5 * (np.minimum.reduceat(point, begin) + np.maximum.reduceat(point, begin))
    apart = point - centre[group]
    radius = np.sqrt(np.maximum.reduceat((apart * apart).sum(axis=1), begin))
    axis = np.add.reduceat(normal, begin)
    axis /= np.maximum(np.sqrt((axis * axis).sum(axis=1, keepdims=True)), 1e-300)
    cosine = np.clip(np.minimum.reduceat((normal * axis[group]).sum(axis=1), begin), -1, 1)
    # Rounding must not make a cone of a plane.
    cosine[cosine > 1 - 1e-9] = 1
    cone = np.where(cosine > 0, np.sqrt(1 - cosine * cosine), 1.0)
    depth = np.maximum.reduceat(np.abs((apart * axis[group]).sum(axis=1)), begin)
    place, mean = np.asfortranarray(centre), np.asfortranarray(axis)
    return Receivers(index, point, normal, first, place, radius, mean, cone, depth)
