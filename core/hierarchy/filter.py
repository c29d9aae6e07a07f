# SPDX-License-Identifier: GPL-3.0-or-later
"""A filter for indirect light at the corners: what a few rays say differently of neighbours is no shadow.

Light from clusters is gathered with a ray or two a link, so it carries a little noise of its own at every vertex.
Neighbours on the same smooth stretch have nearly the same indirect light; where they do not, it is left as it is. Lamps
are not filtered: their shadows are sharp for a reason. (Rushmeier, Ward 1994; Kontkanen, Rasanen, Keller 2004.)
"""

import numpy as np
from numpy.typing import NDArray

from ..scene import Scene
from .tree import Float, Int

ROUNDS = 3
# Differences of neighbours that count half, relative to all their light, or to typical light where they have more:
# beside a lamp what is no more than a shade is large for the picture.
_SAME = 0.06


def smoothed(
    values: Float,
    light: Float,
    edges: tuple[Int, Int],
    covered: NDArray[np.bool_],
    typical: float,
    rounds: int = ROUNDS,
    same: float = _SAME,
    near: Float | None = None,
) -> Float:
    """Blend indirect light with that of neighbours along the edges of the mesh.

    Parameters
    ----------
    values : ndarray of shape (q, k)
        Indirect irradiance at each receiver in the first three columns, and what is to be blended like it [W/m^2].
    light : ndarray of shape (q, 3)
        All of it: what differences are judged by.
    edges : tuple of two ndarrays of shape (e,)
        Who is a neighbour of whom, see `mesh_edges`.
    covered : ndarray of shape (q,)
        Receivers that nobody is to learn from.
    typical : float
        Irradiance [W/m^2].
    rounds : int
        How often neighbours are asked.
    same : float
        Differences of neighbours that count half.
    near : ndarray of shape (q,), optional
        Light from what each stands right beside [W/m^2]. In a corner there is more of it than at an edge, however alike
        all of the light is: those do not learn from each other.

    Returns
    -------
    ndarray of shape (q, k)
    """
    one, other = edges
    there = ~(covered[one] | covered[other])
    one, other = one[there], other[there]
    count = len(values)
    grey, alike = np.minimum(light.mean(axis=1), typical), np.ones(len(one))
    for level in (values[:, :3].mean(axis=1), near):
        if level is not None:
            apart = (level[one] - level[other]) / np.maximum(grey[one] + grey[other], 1e-270)
            alike /= 1 + np.minimum(np.abs(2 * apart / same), 1e3) ** 4
    degree = np.bincount(one, minlength=count) + np.bincount(other, minlength=count)
    # Each gives and takes the same, so that no light is made; half of the way, so that nothing swings.
    share = (0.5 * alike / np.maximum(degree[one], degree[other]))[:, None]

    def blended(light: Float) -> Float:
        for _ in range(rounds):
            flow = share * (light[other] - light[one])
            into = [np.bincount(one, part, count) - np.bincount(other, part, count) for part in flow.T]
            light = light + np.stack(into, axis=1)
        return light

    # Twicing (Tukey 1977): what is taken from a bend in the light comes back, what is taken from its noise does not.
    once = blended(values)
    return np.maximum(once + blended(values - once), 0)


def mesh_edges(scene: Scene, group: Int) -> tuple[Int, Int]:
    """Return the pairs of receivers that edges join, each once.

    Parameters
    ----------
    scene : Scene
    group : ndarray of shape (c,)
        Receiver of each of its corners.

    Returns
    -------
    one, other : ndarray of shape (e,)
    """
    return pairs_once(group, group[scene.following_corner])


def pairs_once(one: Int, other: Int) -> tuple[Int, Int]:
    """Return the pairs of different numbers, each once and the lower number first; shape (k,) to (e,)."""
    low, high = np.minimum(one, other), np.maximum(one, other)
    size = int(np.max(high, initial=0)) + 1
    key = np.unique(low[low != high] * size + high[low != high])
    return key // size, key % size
