# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples: the few elements at which indirect light is solved for, and how all others learn of it.

A fine mesh needs groups above its faces: light that has bounced changes slowly along a surface. Elements that lie
together and look the same way form a cluster, one of them receives for all, and the trend among neighbouring clusters
tells how the light runs on within each. Light straight from lamps is looked for at every element and not here.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .elements import Elements
from .tree import Float, Int

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
    stranger : ndarray of shape (n,)
        Elements that do not see the sample of their cluster, or of one that many do not see.
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
    stranger: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.element)

    @property
    def single(self) -> bool:
        """Whether every element stands for itself."""
        return len(self.element) == len(self.cluster)

    @property
    def unheard(self) -> NDArray[np.bool_]:
        """Return which samples nobody else in their cluster sees, though there are others, shape (m,)."""
        size = np.bincount(self.cluster)
        unheard: NDArray[np.bool_] = (size > 1) & (size - np.bincount(self.cluster, self.stranger) <= 1)
        return unheard

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
    slope, stranger = np.zeros((len(elements), 3, 3)), np.zeros(len(elements), bool)
    return Samples(every, every, elements.area, every, none, slope, none, every, every, stranger)
