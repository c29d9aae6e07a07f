# SPDX-License-Identifier: GPL-3.0-or-later
"""How corners that do not look themselves learn from the samples round them, without borders between clusters.

Each sample tells what arrives in its neighbourhood, with the trend there. Where neighbourhoods overlap they fade into
each other, so that light runs on smoothly across the mesh. (Ward, Heckbert 1992; partition of unity: Shepard 1968.)
"""

import numpy as np
from numpy.typing import NDArray

from ..runs import counted
from .filter import pairs_once, smoothed
from .samples import Samples
from .tree import Float, Int

# A sample tells of what is as far away as its cluster is large, times this.
_REACH = 2.0
# ... and looks the same way by at least this cosine.
_LEAST_ALIKE = 0.5
# Weight of a corner's own sample where nothing else tells of it.
_OWN = 1e-6
# Differences of neighbouring samples that count half as noise, and how often they are asked.
_SAME, _ROUNDS = 0.15, 3
# Corners that are looked at together.
_BLOCK = 1 << 15


def blended(
    samples: Samples, values: Float, point: Float, normal: Float, edges: tuple[Int, Int], alone: NDArray[np.bool_]
) -> Float:
    """Tell all corners what arrives at the samples.

    Parameters
    ----------
    samples : Samples
        Of the corners.
    values : ndarray of shape (m, k)
        At the samples, not negative; the first three columns are light.
    point, normal : ndarray of shape (q, 3)
        Corners [m]; unit length.
    edges : tuple of two ndarrays of shape (e,)
        Corners that are neighbours on a smooth stretch.
    alone : ndarray of shape (m,)
        Samples that nobody else is to learn from.

    Returns
    -------
    ndarray of shape (q, k)
    """
    cluster, count, alone = samples.cluster, len(samples), alone | samples.unheard
    one, other = pairs_once(cluster[edges[0]], cluster[edges[1]])
    values = smoothed(values, values[:, :3], (one, other), alone, np.inf, _ROUNDS, _SAME)
    trends = samples.trends(values)
    middle = point[samples.element] - samples.within[samples.element]
    squared = np.maximum.reduceat((samples.within**2).sum(axis=1)[samples.order], samples.begin)
    reach = np.maximum(_REACH**2 * squared, 1e-300)
    # Each cluster itself first, then those beside it.
    every = np.arange(count)
    near, beside = np.concatenate((every, one, other)), np.concatenate((every, other, one))
    kept = (near == beside) | ~alone[beside]
    order = np.argsort(near[kept], kind="stable")
    near, beside = near[kept][order], beside[kept][order]
    begin = np.searchsorted(near, np.arange(count + 1))
    light = np.zeros((len(point), values.shape[1]))
    for first in range(0, len(point), _BLOCK):
        own = cluster[first : first + _BLOCK]
        at, link = counted(np.diff(begin)[own], begin[own])
        told, who = beside[link], first + at
        way = point[who] - middle[told]
        fading = np.maximum(1 - (way * way).sum(axis=1) / reach[told], 0) ** 2
        alike = (normal[who] * normal[samples.element[told]]).sum(axis=1)
        weight = fading * np.maximum(alike - _LEAST_ALIKE, 0) + _OWN * (told == own[at])
        said = np.maximum(values[told] + np.einsum("ni,nik->nk", way, trends[told]), 0) * weight[:, None]
        sums = np.stack([np.bincount(at, part, len(own)) for part in said.T], axis=1)
        light[first : first + _BLOCK] = sums / np.bincount(at, weight, len(own))[:, None]
    return light
