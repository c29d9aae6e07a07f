# SPDX-License-Identifier: GPL-3.0-or-later
"""Points on the sources of light, for rays to go to: where more light is, and at the near end of what is close by."""

import numpy as np

from .nearness import draw_near
from .sources import Sources
from .tree import Float, Int
from .vectors import dots, picked

# Share of an element, from each edge, without points.
_RIM = 2e-3
# Receivers within so many radii of an element see it unevenly.
_CLOSE = 1.5


class SourcePoints:
    """Draws points on the elements below a node, evenly by a weight.

    Parameters
    ----------
    sources : Sources
    corners : ndarray of shape (n, 4, 3)
        Of the elements [m].
    weight : ndarray of shape (n,)
        Points on each element, in proportion: its area, and more where more light is.

    Attributes
    ----------
    wide : ndarray of shape (m,)
        Nodes that look in many directions: of these, rays tell all that they bring.
    """

    def __init__(self, sources: Sources, corners: Float, weight: Float) -> None:
        order = sources.tree.order
        self._sources, self.wide = sources, sources.wide
        self._corners, self._normals = np.asfortranarray(corners[order]), picked(sources.normals, order)
        a, b, c, d = self._corners.transpose(1, 0, 2)
        self._triangle = (c == d).all(axis=1)
        self._below = np.concatenate(([0.0], np.cumsum(weight[order])))
        # Everything about an element in the order of the leaves.
        bend = np.where(self._triangle[:, None], 0.0, a - b + c - d)
        self._bent = bool(bend.any())
        spanned = [a, b - a, d - a, self._normals, *([bend] if self._bent else [])]
        self._packed = np.asfortranarray(np.concatenate(spanned, axis=1))

    def polygons(self, leaf: Int) -> Float:
        """Return the corners of the elements that leaves are, shape (k, 4, 3) [m]."""
        return picked(self._corners, self._sources.tree.start[leaf])

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
        slot = start.copy()
        inner = np.flatnonzero(stop - start > 1)
        below = self._below
        low, high = below[start[inner]], below[stop[inner]]
        target = low + u[inner] * (high - low)
        found = np.clip(np.searchsorted(below, target, side="right") - 1, start[inner], stop[inner] - 1)
        slot[inner] = found
        # What is left of u after choosing the element is as good as new.
        u = u.copy()
        u[inner] = np.clip((target - below[found]) / np.maximum(below[found + 1] - below[found], 1e-300), 0, 1)
        # Not at the very edge, where another surface may stand.
        u, v = _RIM + (1 - 2 * _RIM) * u, _RIM + (1 - 2 * _RIM) * v
        # A triangle is half a parallelogram: fold the other half back.
        fold = self._triangle[slot] & (u + v > 1)
        u, v = np.where(fold, 1 - u, u)[:, None], np.where(fold, 1 - v, v)[:, None]
        packed = picked(self._packed, slot)
        point = packed[:, :3] + u * packed[:, 3:6] + v * packed[:, 6:9]
        if self._bent:
            point += (u * v) * packed[:, 12:]
        return point, packed[:, 9:12]

    def draw_near(self, point: Float, node: Int, u: Float, v: Float) -> tuple[Int, Float, Float]:
        """Draw points on single elements for receivers close to them.

        Parameters
        ----------
        point : ndarray of shape (k, 3)
            Receivers [m].
        node, u, v
            See `draw`.

        Returns
        -------
        close : ndarray of shape (c,)
            Which nodes those are.
        drawn, weight
            See `nearness.draw_near`, shape (c, 3) and (c,).
        """
        sources = self._sources
        close = np.flatnonzero(sources.tree.child[node] < 0)
        s = node[close]
        apart = picked(point, close) - picked(sources.centre, s)
        near = dots(apart, apart) < (_CLOSE * sources.radius[s]) ** 2
        close, slot = close[near], sources.tree.start[s[near]]
        corners, normal = picked(self._corners, slot), picked(self._normals, slot)
        return close, *draw_near(picked(point, close), u[close], v[close], corners, normal)
