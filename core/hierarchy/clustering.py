# SPDX-License-Identifier: GPL-3.0-or-later
"""Clustering: which elements are alike, lie together and see each other, so that one of them is a sample for all.

Fewer samples are chosen from more of them: who sees his own sample, and that one another, is told by that.
"""

import numpy as np
from numpy.typing import NDArray

from ..sequences import GOLDEN
from ..visibility import Surroundings
from .elements import Elements
from .neighbourhoods import Neighbourhoods, find_neighbourhoods
from .samples import Samples, each
from .tree import Float, Int

# Height over the surface at which elements look for their sample, as a share of the way to it: over its bends.
_LIFT = 0.15
# How often what does not see the sample of its cluster is given another: at least, and as long as this share of it then
# sees one, and there are no more clusters than so many times as many as there may be.
_LEAST, _ROUNDS, _SEEING, _OVER = 3, 16, 0.1, 2.0
# How few of as many as there may be stand for themselves.
_FEW = 0.25
# Share of a cluster that may not see its sample before that speaks for nobody.
_HIDDEN = 0.25
# How much a trend is held back where clusters hardly tell it.
_HELD_BACK = 0.05


def choose_samples(
    elements: Elements,
    occluders: Surroundings,
    most: int,
    around: Neighbourhoods | None = None,
    sides: NDArray[np.uint8] | None = None,
    finer: Samples | None = None,
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
    finer : Samples, optional
        More of them, of the same neighbourhoods: those speak for their clusters, and only they are asked whom they see.

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
    finer = finer or each(elements)
    centre, normal, weight = elements.centre, elements.normal, elements.area
    if not finer.single:
        # What of the finer ones reaches over the edge of a node goes where their sample is.
        kept, cluster = np.unique(cluster[finer.element], return_inverse=True)
        cluster, region = cluster.reshape(-1), np.unique(region[kept], return_inverse=True)[1].reshape(-1)
        centre, normal, weight = centre[finer.element], normal[finer.element], finer.area
    apart = _part(cluster, centre, normal, weight, occluders, most)
    stranger = apart[finer.cluster] | finer.stranger
    region = np.append(region, np.max(region) + 1 + np.arange(np.max(cluster) + 1 - len(region)))
    # A cluster whose sample alone was left keeps it; the sample sees itself.
    scattered = (np.bincount(cluster, apart) > _HIDDEN * np.bincount(cluster))[cluster]
    element = finer.element[_nearest(centre, weight, cluster, scattered)]
    cluster = cluster[finer.cluster]
    # A sample that many of its cluster do not see is a stranger to the others, too.
    hidden = np.bincount(cluster, stranger) > _HIDDEN * np.bincount(cluster)
    stranger |= hidden[cluster]
    stranger[element] = False
    within = _from_middles(elements.centre, elements.area, cluster)
    arm = _from_middles(elements.centre[element], np.ones(len(element)), region)
    slope = _slopes(region, arm, int(np.max(region)) + 1)
    order = np.argsort(cluster, kind="stable")
    begin = np.searchsorted(cluster[order], np.arange(len(element)))
    area = np.bincount(cluster, elements.area)
    return Samples(element, cluster, area, region, arm, slope, within, order, begin, stranger)


def _part(
    cluster: Int, centre: Float, normal: Float, area: Float, occluders: Surroundings, most: int
) -> NDArray[np.bool_]:
    """Make new clusters of the elements that do not see the sample of theirs, in place; return who still does not.

    As from the other side of a wall, each is one of its own, once they are few. Sheets above each other come off one by
    one. Of grass, hair or leaves hardly any see each other, and all see much the same: there those that are left of a
    cluster are one.
    """
    left, stranger = np.arange(len(cluster)), np.zeros(len(cluster), bool)
    for turn in range(_ROUNDS + 1):
        own = np.unique(cluster[left], return_inverse=True)[1].reshape(-1)
        sample = left[_nearest(centre[left], area[left], own)][own]
        hidden = left[_hidden(centre, normal, left, sample, occluders)]
        seeing, left = len(left) - len(hidden), hidden
        first = np.max(cluster) + 1
        if len(left) <= _FEW * most:
            cluster[left] = first + np.arange(len(left))
            break
        if turn == _ROUNDS or (turn >= _LEAST and (seeing < _SEEING * len(left) or first > _OVER * most)):
            stranger[left] = True
            break
        cluster[left] = first + np.unique(cluster[left], return_inverse=True)[1].reshape(-1)
    return stranger


def _from_middles(centre: Float, area: Float, cluster: Int) -> Float:
    """Return the way from the middle of each one's cluster, shape (n, 3) [m]."""
    total = np.bincount(cluster, area)
    middle = np.stack([np.bincount(cluster, area * axis) / total for axis in centre.T], axis=1)
    within: Float = centre - middle[cluster]
    return within


def _nearest(centre: Float, area: Float, cluster: Int, scattered: NDArray[np.bool_] | None = None) -> Int:
    """Return who is nearest to the middle of each cluster; where many do not see each other, one by lot.

    In the middle of a bush it is darker than on most of its leaves. A lot falls to each as its area is (Efraimidis,
    Spirakis 2006).
    """
    within = _from_middles(centre, area, cluster)
    away = (within * within).sum(axis=1)
    if scattered is not None:
        lot = (np.arange(len(away)) * GOLDEN + 0.5) % 1.0
        away = np.where(scattered, -np.log(lot) / area, away)
    nearest = np.lexsort((away, cluster))
    return nearest[np.searchsorted(cluster[nearest], np.arange(np.max(cluster) + 1))]


def _hidden(centre: Float, normal: Float, which: Int, sample: Int, occluders: Surroundings) -> NDArray[np.bool_]:
    """Return which of some elements do not see their sample, from a little above the surface, shape (k,)."""
    others = np.flatnonzero(sample != which)
    one, other = centre[which[others]], centre[sample[others]]
    lift = _LIFT * np.sqrt(((one - other) ** 2).sum(axis=1))[:, None]
    above, over = one + lift * normal[which[others]], other + lift * normal[sample[others]]
    # Nor may one be shut in below that, as behind a picture on a wall.
    hidden = np.zeros(len(sample), bool)
    hidden[others] = occluders.blocked(above, over)
    for low, high in ((one, above), (other, over)):
        clear = np.flatnonzero(~hidden[others])
        hidden[others[clear]] = occluders.blocked(low[clear], high[clear])
    return hidden


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
