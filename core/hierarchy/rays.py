# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a node each receiver sees, by rays to points spread over the node's patches."""

import numpy as np

from ..visibility import Occluders
from .sources import Sources
from .tree import Float, Int

# Additive recurrences of the plastic number: the most even spread of points in the square (Roberts 2018).
_STEP = np.array([0.7548776662466927, 0.5698402909980532])
_HASH = 0.6180339887498949
# Rays that a link is tried with before it gets all it deserves.
_TRIED = 4


class SourcePoints:
    """Draws points on the patches below a node, evenly by area."""

    def __init__(self, sources: Sources, corners: Float, area: Float) -> None:
        order = sources.tree.order
        self._sources = sources
        self._order = order
        self._corners = corners
        self._triangle = (corners[:, 2] == corners[:, 3]).all(axis=1)
        self._below = np.concatenate(([0.0], np.cumsum(area[order])))

    def draw(self, node: Int, u: Float, v: Float) -> tuple[Float, Float]:
        """Return a point of each node and the normal there.

        Parameters
        ----------
        node : ndarray of shape (k,)
        u, v : ndarray of shape (k,)
            Numbers in [0, 1).

        Returns
        -------
        point, normal : ndarray of shape (k, 3)
        """
        tree = self._sources.tree
        start, stop = tree.start[node], tree.stop[node]
        target = self._below[start] + u * (self._below[stop] - self._below[start])
        slot = np.clip(np.searchsorted(self._below, target, side="right") - 1, start, stop - 1)
        # What is left of u after choosing the patch is as good as new.
        u = np.clip((target - self._below[slot]) / (self._below[slot + 1] - self._below[slot]), 0, 1)
        patch = self._order[slot]
        # A triangle is half a parallelogram: fold the other half back.
        fold = self._triangle[patch] & (u + v > 1)
        u, v = np.where(fold, 1 - u, u)[:, None], np.where(fold, 1 - v, v)[:, None]
        a, b, c, d = self._corners[patch].transpose(1, 0, 2)
        flat = self._triangle[patch][:, None]
        points: Float = np.where(
            flat, a + u * (b - a) + v * (c - a), (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)
        )
        return points, self._sources.normals[patch]


def visible_share(
    point: Float,
    normal: Float,
    receiver: Int,
    node: Int,
    rays: Int,
    targets: SourcePoints,
    occluders: Occluders,
) -> tuple[Float, int]:
    """Cast rays from receivers to nodes and return which share of the light gets through.

    Parameters
    ----------
    point, normal : ndarray of shape (r, 3)
        Receivers.
    receiver, node : ndarray of shape (k,)
        Pairs.
    rays : ndarray of shape (k,)
        How many each pair deserves, at least one. A few are tried first; the others follow where those disagree.
    targets : SourcePoints
    occluders : Occluders

    Returns
    -------
    share : ndarray of shape (k,)
        0 to 1; samples count by the light they would bring.
    cast : int
        How many rays there were.
    """
    first = np.minimum(rays, _TRIED)
    clear, total = _sampled(point, normal, receiver, node, first, np.zeros_like(rays), targets, occluders)
    mixed = np.flatnonzero((rays > first) & (clear > 0) & (clear < (1 - 1e-9) * total))
    rest = rays[mixed] - first[mixed]
    if len(mixed):
        more = _sampled(point, normal, receiver[mixed], node[mixed], rest, first[mixed], targets, occluders)
        clear[mixed] += more[0]
        total[mixed] += more[1]
    return clear / total, int(first.sum() + rest.sum())


def _sampled(
    point: Float,
    normal: Float,
    receiver: Int,
    node: Int,
    rays: Int,
    done: Int,
    targets: SourcePoints,
    occluders: Occluders,
) -> tuple[Float, Float]:
    """Return the light of the samples that get through and of all, after `done` samples of each pair before."""
    pair = np.repeat(np.arange(len(node)), rays)
    turn = np.arange(len(pair)) - np.repeat(np.cumsum(rays) - rays, rays) + done[pair]
    r, s = receiver[pair], node[pair]
    # Each receiver begins somewhere else in the sequence, so that the errors of neighbours cancel instead of agreeing.
    index = turn[:, None] * _STEP + r[:, None] * _STEP[::-1] + (s * _HASH)[:, None]
    u, v = (index - np.floor(index)).T
    target, facing = targets.draw(s, u, v)
    origin = point[r]
    clear = ~occluders.blocked(origin, target)
    to = target - origin
    squared = (to * to).sum(axis=1)
    cosines = np.maximum((normal[r] * to).sum(axis=1), 0) * np.maximum(-(facing * to).sum(axis=1), 0)
    # Never nothing, so that a pair whose samples all look past each other still has a share.
    light = cosines / np.maximum(squared * squared, 1e-300)
    light += 1e-6 * float(np.max(light, initial=1e-290))
    return np.bincount(pair, light * clear, len(node)), np.bincount(pair, light, len(node))
