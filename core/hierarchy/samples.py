# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples: the few elements at which indirect light is solved for, and how all others learn of it.

A fine mesh needs groups above its faces: light that has bounced changes slowly along a surface. Elements that lie
together and look the same way form a cluster, one of them receives for all, and the trend among neighbouring clusters
tells how the light runs on within each. Light straight from lamps is looked for at every element and not here.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..visibility import Surroundings
from .elements import Elements
from .tree import Float, Int, Tree, build_tree, least_cosine

# Normals of a cluster lie within a cone of this cosine; a wider one is taken where that leaves too many clusters.
_LIKE = (0.87, 0.5, -1.0)
# Halvings of the longest side that is looked for.
_HALVINGS = 16
# Standard deviation across a cluster over that along it: what a bend of that cone makes of a sheet, and no more.
_THIN = 0.12
# Height over the surface at which elements look for their sample, as a share of the way to it: over its bends.
_LIFT = 0.15
# Clusters that a trend is told by, at least; and how much it is held back where they hardly tell it.
_TREND, _HELD_BACK = 6, 0.05
# Share of its light that a trend may take from any place in a cluster.
_STEEPEST = 0.7


@dataclass(frozen=True, eq=False)
class Samples:
    """Elements in clusters, with one element of each as its sample.

    Attributes
    ----------
    element : ndarray of shape (m,)
        The sample of each of m clusters.
    cluster : ndarray of shape (n,)
        Cluster of each element.
    area : ndarray of shape (m,)
        Of the clusters [m^2].
    region : ndarray of shape (m,)
        Where the trend of each cluster comes from: regions of several clusters.
    arm : ndarray of shape (m, 3)
        From the middle of the region's samples to the cluster's sample [m].
    slope : ndarray of shape (regions, 3, 3)
        What makes the sum of `arm` times light a gradient [1/m^2].
    within : ndarray of shape (n, 3)
        From the middle of its cluster to each element [m].
    order : ndarray of shape (n,)
        Elements, cluster by cluster.
    begin : ndarray of shape (m,)
        Where in `order` each cluster begins.
    """

    element: Int
    cluster: Int
    area: Float
    region: Int
    arm: Float
    slope: Float
    within: Float
    order: Int
    begin: Int

    def __len__(self) -> int:
        return len(self.element)

    @property
    def single(self) -> bool:
        """Whether every element stands for itself."""
        return len(self.element) == len(self.cluster)

    def spread(self, values: Float) -> Float:
        """Tell all elements what arrives at the samples.

        Parameters
        ----------
        values : ndarray of shape (m, k)
            Not negative.

        Returns
        -------
        ndarray of shape (n, k)
            With the same sum over all areas.
        """
        if self.single:
            return values[self.cluster]
        sums = np.zeros((len(self.slope), 3, values.shape[1]))
        for axis in range(3):
            for k in range(values.shape[1]):
                sums[:, axis, k] = np.bincount(self.region, self.arm[:, axis] * values[:, k], len(self.slope))
        gradient = (self.slope @ sums)[self.region[self.cluster]]
        change = np.einsum("ni,nik->nk", self.within, gradient)
        # Nowhere below nothing: a steep trend is flattened for the whole cluster, which keeps its sum.
        lowest = np.minimum.reduceat(change[self.order], self.begin, axis=0)
        flatter = np.minimum(1, _STEEPEST * np.abs(values) / np.maximum(-lowest, 1e-300))
        spread: Float = values[self.cluster] + flatter[self.cluster] * change
        return spread


def choose_samples(elements: Elements, occluders: Surroundings, most: int) -> Samples:
    """Cluster elements and choose a sample of each cluster.

    Parameters
    ----------
    elements : Elements
    occluders : Surroundings
        Tells which elements are under something: those are no one's neighbours.
    most : int
        Clusters that there may be. With no more elements, each is a cluster.

    Returns
    -------
    Samples
    """
    n = len(elements)
    if n <= most:
        return each(elements)
    tree = build_tree(elements.centre, elements.normal, 1e3 * _covered(elements, occluders))
    nodes, alike = _smallest(tree, elements, most)
    cluster = np.zeros(n, np.int64)
    cluster[tree.order] = np.repeat(np.arange(len(nodes)), tree.size[nodes])
    region = _regions(tree, nodes, alike)
    element, within = _middles(elements, cluster)
    # Who does not see the sample, as from the other side of a wall, is a cluster of its own.
    alone = np.flatnonzero(_hidden(elements, element[cluster], occluders))
    cluster[alone] = len(nodes) + np.arange(len(alone))
    region = np.append(region, np.max(region) + 1 + np.arange(len(alone)))
    # A cluster whose sample alone was left keeps it; the sample sees itself.
    element, within = _middles(elements, cluster)
    weight, place = np.bincount(region), elements.centre[element]
    arm = place - np.stack([np.bincount(region, place[:, k]) / weight for k in range(3)], axis=1)[region]
    slope = _slopes(region, arm, len(weight))
    order = np.argsort(cluster, kind="stable")
    begin = np.searchsorted(cluster[order], np.arange(len(element)))
    area = np.bincount(cluster, elements.area)
    return Samples(element, cluster, area, region, arm, slope, within, order, begin)


def _middles(elements: Elements, cluster: Int) -> tuple[Int, Float]:
    """Return the element nearest to the middle of each cluster, and the way from that middle to each element."""
    area = np.bincount(cluster, elements.area)
    middle = np.stack([np.bincount(cluster, elements.area * elements.centre[:, k]) / area for k in range(3)], axis=1)
    within = elements.centre - middle[cluster]
    nearest = np.lexsort(((within * within).sum(axis=1), cluster))
    return nearest[np.searchsorted(cluster[nearest], np.arange(len(area)))], within


def _hidden(elements: Elements, sample: Int, occluders: Surroundings) -> NDArray[np.bool_]:
    """Return which elements do not see their sample, from a little above the surface, shape (n,)."""
    others = np.flatnonzero(sample != np.arange(len(sample)))
    one, other = elements.centre[others], elements.centre[sample[others]]
    lift = _LIFT * np.sqrt(((one - other) ** 2).sum(axis=1))[:, None]
    hidden = np.zeros(len(sample), bool)
    hidden[others] = occluders.blocked(
        one + lift * elements.normal[others], other + lift * elements.normal[sample[others]]
    )
    return hidden


def each(elements: Elements) -> Samples:
    """Let every element stand for itself.

    Parameters
    ----------
    elements : Elements

    Returns
    -------
    Samples
        As many as there are elements.
    """
    every, none = np.arange(len(elements)), np.zeros((len(elements), 3))
    return Samples(every, every, elements.area, every, none, np.zeros((len(elements), 3, 3)), none, every, every)


def _smallest(tree: Tree, elements: Elements, most: int) -> tuple[Int, NDArray[np.bool_]]:
    """Return the nodes of the smallest size that leaves no more than `most`, and which nodes hold like elements."""
    low, high = tree.extremes(elements.corners.min(axis=1), elements.corners.max(axis=1))
    side = (high - low).max(axis=1)
    vector = tree.sums(elements.area[:, None] * elements.normal)
    mean = vector / np.maximum(np.sqrt((vector * vector).sum(axis=1)), 1e-300)[:, None]
    cosine, thin = least_cosine(tree, elements.normal, mean), _thin(tree, elements, mean)
    for like in _LIKE:
        alike = (cosine > like) & thin if like > 0 else np.ones(len(side), bool)
        small, large = 0.0, float(side[0])
        nodes = tree.cut_where(alike & (side <= large))
        # A little more than was asked for is better than to take a ceiling and a floor for one.
        if len(nodes) > (1.5 * most if like > 0 else np.inf):
            continue
        for _ in range(_HALVINGS):
            middle = 0.5 * (small + large)
            tried = tree.cut_where(alike & (side <= middle))
            if len(tried) > most:
                small = middle
            else:
                large, nodes = middle, tried
        break
    return nodes, alike


def _covered(elements: Elements, occluders: Surroundings) -> NDArray[np.float64]:
    """Return 1 for the elements that look at a back, as what is under a box does, and 0 for the others, shape (n,)."""
    face, _, front = occluders.nearest(elements.centre, elements.normal)
    return ((face >= 0) & ~front).astype(float)


def _thin(tree: Tree, elements: Elements, mean: Float) -> NDArray[np.bool_]:
    """Return which nodes are one sheet rather than several above each other, shape (nodes,)."""
    A, x = elements.area[:, None], elements.centre - elements.centre.mean(axis=0)
    squares = (x[:, :, None] * x[:, None]).reshape(-1, 9)
    sums = tree.sums(np.concatenate((A, A * x, A * squares), axis=1))
    # Beside what is a million times larger, small areas are lost in the sums: whatever they are, they are thin.
    means = np.divide(sums[:, 1:], sums[:, :1], out=np.zeros_like(sums[:, 1:]), where=sums[:, :1] > 0)
    middle = means[:, :3]
    moment = means[:, 3:].reshape(-1, 3, 3) - middle[:, :, None] * middle[:, None]
    across = np.einsum("ni,nij,nj->n", mean, moment, mean)
    thin: NDArray[np.bool_] = across <= _THIN**2 * np.trace(moment, axis1=1, axis2=2) + 1e-12 * float(np.max(x * x))
    return thin


def _regions(tree: Tree, nodes: Int, alike: NDArray[np.bool_]) -> Int:
    """Return for each of some nodes, in the tree's order, a number that it shares with those beside it."""
    # How many of the nodes lie below each node of the tree, and who is above whom.
    count = np.diff(np.searchsorted(tree.start[nodes], np.stack((tree.start, tree.stop), axis=1)), axis=1)[:, 0]
    inner = np.flatnonzero(tree.child >= 0)
    parent = np.full(len(tree.start), -1)
    parent[tree.child[inner]] = parent[tree.child[inner] + 1] = inner
    region = nodes.copy()
    for _ in range(len(tree.levels)):
        up = parent[region]
        rise = (up >= 0) & (count[region] < _TREND) & alike[up]
        if not rise.any():
            break
        region = np.where(rise, up, region)
    # A node whose neighbours have risen to a region that holds it is a part of that.
    top = np.maximum.accumulate(tree.stop[region])
    begins = np.concatenate(([True], tree.start[region][1:] >= top[:-1]))
    return np.cumsum(begins) - 1


def _slopes(region: Int, arm: Float, count: int) -> Float:
    """Return the inverse of each region's second moments, held back where they are small, shape (count, 3, 3)."""
    moments = np.zeros((count, 3, 3))
    for i in range(3):
        for j in range(3):
            moments[:, i, j] = np.bincount(region, arm[:, i] * arm[:, j], count)
    trace = np.trace(moments, axis1=1, axis2=2)
    floor = _HELD_BACK * trace + 1e-300
    slopes: Float = np.linalg.inv(moments + floor[:, None, None] * np.eye(3) + 1e-30 * np.eye(3))
    slopes[np.bincount(region, minlength=count) < 3] = 0
    return slopes
