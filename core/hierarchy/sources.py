# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchy of sources: what every cluster of patches looks like from afar.

A planar cluster is told by its area, centroid and second moments. Four points at one standard deviation along its
principal axes integrate any quadratic over it exactly (on a rectangle they are the Gauss-Legendre points). A curved one
is told by its four grandchildren, each with an area vector of its own: the vectors of a ball sum to nothing, those of
its quarters do not. One whose grandchildren still look in many directions, such as a far chair, is told by the area
that it shows in each direction, a quadratic form of its normals: the even part of Lambert's cosine to second order
(Basri, Jacobs 2003). So a far cluster costs four evaluations of the kernel at most, whatever it holds.
"""

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .moments import moments, principal_points
from .tree import Float, Int, Tree, build_tree, least_cosine
from .vectors import dots, picked

# Relative thickness (variance along the normal over variance in the plane) that still counts as planar.
_FLAT = 1e-6
# What a curved cluster's quadrature points stand for may bend by this sine; others are told by the area that they show.
_BEND = 0.35
# Max(x, 0) on [-1, 1] to second order: 3/32 + x/2 + 15/32 x^2.
_SHOWN = (3 / 32, 1 / 2, 15 / 32)
# (1 + x)^2 / 4 is never below it: a bright part that faces an observer shows, whatever else there is.
_MOST_SHOWN = (1 / 4, 1 / 2, 1 / 4)
# Of that, what shows at least: the other may vanish where most of a node faces away.
_LEAST_SHOWN = 1 / 4


@dataclass(frozen=True, eq=False)
class Sources:
    """Nodes of a tree over elements, as sources of light. Vectors lie in Fortran's order, see `vectors`.

    Attributes
    ----------
    tree : Tree
        Over the elements.
    area : ndarray of shape (m,)
        [m^2].
    normal : ndarray of shape (m, 3)
        Mean normal, unit length.
    below : ndarray of shape (m, 4)
        Nodes that the quadrature points of a curved node stand for; the node itself for a flat one.
    cone : ndarray of shape (m,)
        Largest angle between `normal` and an element's normal, as its sine; 1 for more than a right angle.
    wide : ndarray of shape (m,)
        True for nodes whose quadrature points stand for too many directions each.
    total : ndarray of shape (m, 3)
        Sum of the area vectors of the elements [m^2].
    spread : ndarray of shape (m, 6)
        Sum of area times normal times normal: xx, yy, zz, xy, yz, zx [m^2].
    flat : ndarray of shape (m,)
        True for nodes in one plane.
    centre : ndarray of shape (m, 3)
        Centroid [m].
    radius : ndarray of shape (m,)
        Half diagonal of a rectangle with the same second moments [m].
    middle, half : ndarray of shape (m, 3)
        Bounding box [m].
    quadrature : ndarray of shape (m, 4, 3)
        Points that stand for the node [m].
    vector : ndarray of shape (m, 4, 3)
        Area vectors of those points [m^2].
    facing : ndarray of shape (m,)
        The most area that an observer can see of the node [m^2].
    normals : ndarray of shape (n, 3)
        Of the elements, unit length.
    solid : ndarray of shape (m,)
        Share of what the elements enclose that is their area: less than 1 for screens.
    """

    tree: Tree
    area: Float
    normal: Float
    below: Int
    cone: Float
    wide: NDArray[np.bool_]
    total: Float
    spread: Float
    flat: NDArray[np.bool_]
    centre: Float
    radius: Float
    middle: Float
    half: Float
    quadrature: Float
    vector: Float
    facing: Float
    normals: Float
    solid: Float


def build_sources(
    corners: Float,
    centre: Float,
    normal: Float,
    area: Float,
    shade: Float | None = None,
    workers: Executor | None = None,
    solid: Float | None = None,
) -> Sources:
    """Cluster patches into a hierarchy of sources.

    Parameters
    ----------
    corners : ndarray of shape (n, 4, 3)
        Patches [m].
    centre, normal : ndarray of shape (n, 3)
        Centroids [m] and unit normals.
    area : ndarray of shape (n,)
        [m^2], positive.
    shade : ndarray of shape (n,), optional
        Binary logarithm of how bright each is, see `build_tree`.
    workers : concurrent.futures.Executor, optional
        See `build_tree`.
    solid : ndarray of shape (n,), optional
        Share of what each encloses that is its area, 1 if not given.

    Returns
    -------
    Sources
    """
    tree = build_tree(centre, normal, shade, compact=True, workers=workers)
    low, high = tree.extremes(corners.min(axis=1), corners.max(axis=1))
    total, node_centre, covariance = moments(tree, corners, centre, area)
    vector = tree.sums(area[:, None] * normal)
    length = np.sqrt((vector * vector).sum(axis=1))
    mean = vector / np.maximum(length, 1e-300)[:, None]
    cosine = least_cosine(tree, normal, mean)
    points = principal_points(node_centre, covariance, mean)
    trace = np.trace(covariance, axis1=1, axis2=2)
    thickness = np.einsum("mi,mij,mj->m", mean, covariance, mean)
    cone = np.where(cosine > 0, np.sqrt(np.clip(1 - cosine * cosine, 0, 1)), 1.0)
    flat = (cosine > 1 - 1e-6) & (thickness <= _FLAT * trace)
    vectors = np.repeat(0.25 * vector[:, None], 4, axis=1)
    curved = np.flatnonzero(~flat)
    quarter, share = _grandchildren(tree, curved)
    points[curved] = node_centre[quarter]
    vectors[curved] = share[:, :, None] * vector[quarter]
    wide = np.zeros(len(flat), bool)
    wide[curved] = cone[quarter].max(axis=1) > _BEND
    x, y, z = normal.T
    spread = tree.sums(area[:, None] * np.column_stack((x * x, y * y, z * z, x * y, y * z, z * x)))
    facing = np.sqrt((vectors * vectors).sum(axis=2)).sum(axis=1)
    squares = (spread[:, :3] ** 2).sum(axis=1) + 2 * (spread[:, 3:] ** 2).sum(axis=1)
    most = _SHOWN[0] * total + _SHOWN[1] * length + _SHOWN[2] * np.sqrt(squares)
    below = np.repeat(np.arange(len(flat))[:, None], 4, axis=1)
    below[curved] = quarter
    return Sources(
        tree=tree,
        area=total,
        normal=np.asfortranarray(mean),
        below=below,
        cone=cone,
        wide=wide,
        total=np.asfortranarray(vector),
        spread=np.asfortranarray(spread),
        flat=flat,
        centre=np.asfortranarray(node_centre),
        radius=np.sqrt(3 * trace),
        middle=np.asfortranarray(0.5 * (low + high)),
        half=np.asfortranarray(0.5 * (high - low)),
        quadrature=np.asfortranarray(points),
        vector=np.asfortranarray(vectors),
        facing=np.where(wide, most, facing),
        normals=np.asfortranarray(normal),
        solid=_solid(tree, area, solid),
    )


def _solid(tree: Tree, area: Float, solid: Float | None) -> Float:
    """Return the share of what the elements of each node enclose that is their area."""
    if solid is None or (solid == 1.0).all():
        return np.ones(len(tree.child))
    filled, enclosed = tree.sums(np.column_stack((area, area / solid))).T
    share: Float = np.divide(filled, enclosed, out=np.ones(len(filled)), where=enclosed > 0)
    return share.clip(0.0, 1.0)


def shown_area(sources: Sources, node: Int, way: Float) -> Float:
    """Return the area that nodes show to observers, shadows of their own parts aside.

    Parameters
    ----------
    sources : Sources
    node : ndarray of shape (k,)
    way : ndarray of shape (k, 3)
        Unit vectors towards the observers.

    Returns
    -------
    ndarray of shape (k,)
        [m^2].
    """
    parts = _shown_parts(sources, node, way)
    shown: Float = np.maximum(_series(_SHOWN, parts), _LEAST_SHOWN * _series(_MOST_SHOWN, parts))
    return shown


def most_shown_area(sources: Sources, node: Int, way: Float) -> Float:
    """Return an area that nodes certainly do not exceed, otherwise as `shown_area`."""
    return _series(_MOST_SHOWN, _shown_parts(sources, node, way))


def _shown_parts(sources: Sources, node: Int, way: Float) -> tuple[Float, Float, Float]:
    """Return the sums over the elements of their area times 1, the cosine to an observer, and its square."""
    x, y, z = way.T
    xx, yy, zz, xy, yz, zx = picked(sources.spread, node).T
    even = xx * x * x + yy * y * y + zz * z * z + 2 * (xy * x * y + yz * y * z + zx * z * x)
    return sources.area[node], dots(picked(sources.total, node), way), even


def _series(factors: tuple[float, float, float], parts: tuple[Float, Float, Float]) -> Float:
    """Return a polynomial of the cosines, summed over the elements, not negative."""
    total: Float = np.maximum(sum(factor * part for factor, part in zip(factors, parts, strict=True)), 0)
    return total


def _grandchildren(tree: Tree, nodes: Int) -> tuple[Int, Float]:
    """Return four nodes below each of some nodes, and which part of each counts: leaves stand in for their children."""
    below, share = nodes[:, None], np.ones((len(nodes), 1))
    for width in (2, 4):
        child = tree.child[below]
        leaf = child < 0
        below = np.stack((np.where(leaf, below, child), np.where(leaf, below, child + 1)), axis=2)
        share = np.repeat(share * np.where(leaf, 0.5, 1.0), 2, axis=1)
        below = below.reshape(len(nodes), width)
    return below, share
