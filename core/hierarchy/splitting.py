# SPDX-License-Identifier: GPL-3.0-or-later
"""How a cluster falls into two: along the longest axis of position, orientation, plane offset and brightness."""

import numpy as np

from ..arrays import FloatArray as Float
from ..arrays import IntArray as Int
from ..runs import counted
from .vectors import dots, picked

# A split that leaves less than this share of a node on one side is replaced by one through the median.
_LEAST_SHARE = 1 / 8
# Weights of orientation, of the plane's offset and of a stop of brightness against position, for the longest axis.
_NORMAL_WEIGHT = 0.7
_OFFSET_WEIGHT = 3.0
_SHADE_WEIGHT = 0.3
# A split by position is taken where it leaves less than this share of the work.
_CHEAPER = 0.75
# ... or by brightness, if that spreads further and position leaves this share of its variance: of a room of single
# sheets the day outside is where the dark inside is.
_MIXED = 0.9
# From how many radii flat nodes, bent ones, and those of many directions pass for one source, about; and what is flat,
# and what is only bent: thickness and the length of the mean normal.
_CURVED, _WIDE = 2.0, 2.5
_FLAT, _ALIKE = 1e-5, 0.97


def split(order: Int, start: Int, stop: Int, position: Float, normal: Float, shade: Float, compact: bool) -> Int:
    """Reorder runs of elements in place, each into two halves.

    Parameters
    ----------
    order : ndarray of shape (n,)
        Elements.
    start, stop : ndarray of shape (m,)
        Runs of `order`, of two elements at least.
    position, normal, shade, compact
        See `build_tree`.

    Returns
    -------
    ndarray of shape (m,)
        Where the second half of each begins.
    """
    size = stop - start
    first = np.concatenate(([0], np.cumsum(size)[:-1]))
    segment = np.repeat(np.arange(len(size)), size)
    slot = np.arange(size.sum()) - np.repeat(first - start, size)
    element = order[slot]
    # Coordinates relative to each node's middle, so that a plane's offset does not depend on where the origin is.
    x, n = picked(position, element), picked(normal, element)
    low, high = np.minimum.reduceat(x, first), np.maximum.reduceat(x, first)
    extent = high - low
    reach = extent.max(axis=1)
    x = x - (0.5 * (low + high))[segment]
    offset, far = _OFFSET_WEIGHT * dots(x, n), reach[segment]
    stops = _SHADE_WEIGHT * far * shade[element]
    feature = np.stack((*x.T, *(n.T * (_NORMAL_WEIGHT * far)), offset, stops)).T
    low, high = np.minimum.reduceat(feature, first), np.maximum.reduceat(feature, first)
    axis = (high - low).argmax(axis=1)
    if compact:
        told = np.stack((*x.T, *n.T, offset / _OFFSET_WEIGHT, stops)).T
        _prefer_place(feature, low, high, axis, first, segment, told)
    value = feature[np.arange(len(segment)), axis[segment]]
    cut = 0.5 * (low + high)[np.arange(len(axis)), axis]
    right = value > cut[segment]
    count = np.add.reduceat(right.astype(np.int64), first)
    # A lopsided split would make the tree as deep as it is wide: take the median there.
    lopsided = np.minimum(count, size - count) < np.where(axis < 7, _LEAST_SHARE * size, 1)
    if lopsided.any():
        here = np.flatnonzero(lopsided[segment])
        ranked = here[np.lexsort((value[here], segment[here]))]
        # `here` runs segment by segment, as `ranked` does, so a place in the one is a rank in the other.
        right[ranked] = here - first[segment[here]] >= size[segment[here]] // 2
        count = np.add.reduceat(right.astype(np.int64), first)
    # Each element's place: behind those of its segment that come before it on its side, and behind all on the left.
    ranks = np.cumsum(right)
    ahead = ranks - right - (ranks - right)[first][segment]
    place = np.where(right, (stop - count)[segment] + ahead, slot - ahead)
    order[place] = element
    middle: Int = stop - count
    return middle


def _prefer_place(feature: Float, low: Float, high: Float, axis: Int, first: Int, segment: Int, told: Float) -> None:
    """Split nodes by position, or by brightness, where that is better than by orientation or plane.

    Parting a room's walls makes flat nodes, but parting the tables' tops of a house from all else makes a node that is
    as large as the house, and near to everything.

    Parameters
    ----------
    feature : ndarray of shape (k, 8)
        That nodes may be split by, position first and brightness last, element by element.
    low, high : ndarray of shape (m, 8)
        Bounds of each node's features.
    axis : ndarray of shape (m,)
        The feature proposed for each; changed in place.
    first : ndarray of shape (m,)
        First element of each node.
    segment : ndarray of shape (k,)
        Node of each element.
    told : ndarray of shape (k, 8)
        Position, normal and plane offset, all in true proportion, and brightness.
    """
    asked = np.flatnonzero((axis >= 3) & (axis < 7))
    if not len(asked):
        return
    size = np.diff(np.append(first, len(segment)))[asked]
    which, place = counted(size, first[asked])
    begin = np.cumsum(size) - size
    told = picked(told, place)
    offset, stops = told[:, 6], told[:, 7]
    squares = (dots(told[:, :3], told[:, :3]), offset * offset, stops * stops)
    values = np.stack((np.ones(len(place)), *told.T, *squares)).T
    total = np.add.reduceat(values, begin)
    span = (high - low)[asked]
    wide = span[:, :3].argmax(axis=1)
    costs = []
    for choice in (axis[asked], wide):
        cut = 0.5 * (low + high)[asked, choice]
        part = np.add.reduceat(values * (feature[place, choice[which]] > cut[which])[:, None], begin)
        costs.append(_opened(part) + _opened(total - part))
    better = costs[1] < _CHEAPER * costs[0]
    mixed = _unlike(part) + _unlike(total - part) > _MIXED * _unlike(total)
    mixed &= span[:, 7] > span[np.arange(len(span)), wide]
    axis[asked[better]] = np.where(mixed, 7, wide)[better]


def _unlike(sums: Float) -> Float:
    """Return how far the brightness of nodes' elements spreads: the sum of squares about their mean."""
    spread: Float = sums[:, 11] - sums[:, 8] ** 2 / np.maximum(sums[:, 0], 1)
    return spread


def _opened(sums: Float) -> Float:
    """Return how often nodes would be opened, relatively, from sums over their elements.

    Parameters
    ----------
    sums : ndarray of shape (m, 12)
        Of 1, x, n, the plane's offset, brightness, and of the squares of x, offset and brightness.

    Returns
    -------
    ndarray of shape (m,)
        As the square of the distance from which a node passes for one source.
    """
    mean = sums / np.maximum(sums[:, :1], 1)
    squared = np.maximum(mean[:, 9] - (mean[:, 1:4] ** 2).sum(axis=1), 0)
    alike = np.sqrt((mean[:, 4:7] ** 2).sum(axis=1))
    thick = np.maximum(mean[:, 10] - mean[:, 7] ** 2, 0)
    flat = (alike > 1 - _FLAT) & (thick < _FLAT * squared)
    distance = np.where(flat, 1.0, np.where(alike > _ALIKE, _CURVED, _WIDE))
    opened: Float = distance * distance * squared
    return opened
