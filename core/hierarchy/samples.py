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
from .neighbourhoods import Neighbourhoods, find_neighbourhoods
from .tree import Float, Int

# Height over the surface at which elements look for their sample, as a share of the way to it: over its bends.
_LIFT = 0.15
# How often what does not see the sample of its cluster is given another: at least, and as long as this share of it then
# sees one, and there are no more clusters than so many times as many as there may be.
_LEAST, _ROUNDS, _SEEING, _OVER = 3, 16, 0.1, 2.0
# How few of as many as there may be stand for themselves.
_FEW = 0.25
# How much a trend is held back where clusters hardly tell it.
_HELD_BACK = 0.05
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
        change, flatter, _ = self._changes(values)
        spread: Float = values[self.cluster] + flatter[self.cluster] * change
        return spread

    def trends(self, values: Float) -> Float:
        """Tell how what arrives changes from place to place within each cluster.

        Parameters
        ----------
        values : ndarray of shape (m, k)
            Not negative.

        Returns
        -------
        ndarray of shape (m, 3, k)
            For each meter along each axis.
        """
        _, flatter, gradient = self._changes(values)
        trends: Float = flatter[:, None] * gradient[self.region]
        return trends

    def _changes(self, values: Float) -> tuple[Float, Float, Float]:
        """Return changes within clusters, shape (n, k), what they are held back by (m, k), and regions' gradients."""
        sums = np.zeros((len(self.slope), 3, values.shape[1]))
        for axis in range(3):
            for k in range(values.shape[1]):
                sums[:, axis, k] = np.bincount(self.region, self.arm[:, axis] * values[:, k], len(self.slope))
        gradient = self.slope @ sums
        change = np.einsum("ni,nik->nk", self.within, gradient[self.region[self.cluster]])
        # Nowhere below nothing: a steep trend is flattened for the whole cluster, which keeps its sum.
        lowest = np.minimum.reduceat(change[self.order], self.begin, axis=0)
        flatter = np.minimum(1, _STEEPEST * np.abs(values) / np.maximum(-lowest, 1e-300))
        return change, flatter, gradient


def choose_samples(
    elements: Elements,
    occluders: Surroundings,
    most: int,
    around: Neighbourhoods | None = None,
    sides: NDArray[np.uint8] | None = None,
) -> Samples:
    """Cluster elements and choose a sample of each cluster.

    Parameters
    ----------
    elements : Elements
    occluders : Surroundings
    most : int
        Clusters that there may be. With no more elements, each is a cluster.
    around : Neighbourhoods, optional
        Of the elements, where they are known.
    sides : ndarray of shape (f,), optional
        As for `find_neighbourhoods`, where those are not known.

    Returns
    -------
    Samples
    """
    n = len(elements)
    if n <= most:
        return each(elements)
    around = around or find_neighbourhoods(elements, occluders, sides)
    tree = around.tree
    nodes, alike = around.smallest(most)
    cluster = np.zeros(n, np.int64)
    cluster[tree.order] = np.repeat(np.arange(len(nodes)), tree.size[nodes])
    region = around.regions(nodes, alike)
    _part(cluster, elements, occluders, most)
    region = np.append(region, np.max(region) + 1 + np.arange(np.max(cluster) + 1 - len(nodes)))
    # A cluster whose sample alone was left keeps it; the sample sees itself.
    element, within = _middles(elements, cluster)
    weight, place = np.bincount(region), elements.centre[element]
    arm = place - np.stack([np.bincount(region, place[:, k]) / weight for k in range(3)], axis=1)[region]
    slope = _slopes(region, arm, len(weight))
    order = np.argsort(cluster, kind="stable")
    begin = np.searchsorted(cluster[order], np.arange(len(element)))
    area = np.bincount(cluster, elements.area)
    return Samples(element, cluster, area, region, arm, slope, within, order, begin)


def _part(cluster: Int, elements: Elements, occluders: Surroundings, most: int) -> None:
    """Make new clusters of the elements that do not see the sample of theirs, in place.

    As from the other side of a wall, each is one of its own, once they are few. Sheets above each other come off one by
    one. Of grass, hair or leaves hardly any see each other, and all see much the same: there those that are left of a
    cluster are one.
    """
    left = np.arange(len(cluster))
    for turn in range(_ROUNDS):
        own = np.unique(cluster[left], return_inverse=True)[1].reshape(-1)
        element, _ = _middles(elements.pick(left), own)
        hidden = left[_hidden(elements, left, left[element][own], occluders)]
        seeing, left = len(left) - len(hidden), hidden
        first = np.max(cluster) + 1
        if len(left) <= _FEW * most:
            cluster[left] = first + np.arange(len(left))
            return
        cluster[left] = first + np.unique(cluster[left], return_inverse=True)[1].reshape(-1)
        if turn + 1 >= _LEAST and (seeing < _SEEING * len(left) or np.max(cluster) >= _OVER * most):
            return


def _middles(elements: Elements, cluster: Int) -> tuple[Int, Float]:
    """Return the element nearest to the middle of each cluster, and the way from that middle to each element."""
    area = np.bincount(cluster, elements.area)
    middle = np.stack([np.bincount(cluster, elements.area * elements.centre[:, k]) / area for k in range(3)], axis=1)
    within = elements.centre - middle[cluster]
    nearest = np.lexsort(((within * within).sum(axis=1), cluster))
    return nearest[np.searchsorted(cluster[nearest], np.arange(len(area)))], within


def _hidden(elements: Elements, which: Int, sample: Int, occluders: Surroundings) -> NDArray[np.bool_]:
    """Return which of some elements do not see their sample, from a little above the surface, shape (k,)."""
    others = np.flatnonzero(sample != which)
    one, other = elements.centre[which[others]], elements.centre[sample[others]]
    lift = _LIFT * np.sqrt(((one - other) ** 2).sum(axis=1))[:, None]
    above, over = one + lift * elements.normal[which[others]], other + lift * elements.normal[sample[others]]
    # Nor may one be shut in below that, as behind a picture on a wall.
    hidden = np.zeros(len(sample), bool)
    hidden[others] = occluders.blocked(above, over)
    for low, high in ((one, above), (other, over)):
        clear = np.flatnonzero(~hidden[others])
        hidden[others[clear]] = occluders.blocked(low[clear], high[clear])
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
