# SPDX-License-Identifier: GPL-3.0-or-later
"""A binary tree of clusters over patches: what is far is one source.

Clusters follow position *and* orientation, so that a wall becomes a subtree of its own and a curved object falls into
face clusters (Willmott, Heckbert, Garland 1999) before its far sides are taken together (Smits, Arvo, Greenberg 1994).
A node covers a contiguous run of `Tree.order`; parents come before their children, siblings side by side.
"""

from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray as Float
from ..arrays import IntArray as Int
from ..workers import in_order
from .splitting import split

__all__ = ["Float", "Int", "Tree", "build_tree", "least_cosine"]

Kind = TypeVar("Kind", bound=np.generic)

# Elements that are split at a time, about.
_TOGETHER = 1 << 15


@dataclass(frozen=True, eq=False)
class Tree:
    """Nodes over elements (patches or receiver points).

    Attributes
    ----------
    order : ndarray of shape (n,)
        Elements in the order of the leaves.
    start, stop : ndarray of shape (m,)
        Run of `order` that each node covers.
    child : ndarray of shape (m,)
        First of the two children (the second follows it); -1 for a leaf.
    levels : tuple of (int, int)
        Run of nodes on each level, the root's first.
    """

    order: Int
    start: Int
    stop: Int
    child: Int
    levels: tuple[tuple[int, int], ...]

    @property
    def size(self) -> Int:
        """Elements below each node, ndarray of shape (m,)."""
        return self.stop - self.start

    def sums(self, values: Float) -> Float:
        """Add up a value of each element over every node.

        Parameters
        ----------
        values : ndarray of shape (n, k)
            In the elements' own order.

        Returns
        -------
        ndarray of shape (m, k)
        """
        # Column by column in memory: each is added up in one go.
        total = np.zeros((values.shape[1], len(self.order) + 1))
        np.cumsum(values.T.take(self.order, axis=1), axis=1, out=total[:, 1:])
        sums: Float = (total.take(self.stop, axis=1) - total.take(self.start, axis=1)).T
        return sums

    def at_elements(self, values: NDArray[Kind]) -> NDArray[Kind]:
        """Return what the leaves have of a value of each node, shape (m,) to (n,), in the elements' own order.

        Every leaf holds one element.
        """
        leaf = np.flatnonzero(self.child < 0)
        found = np.zeros(len(self.order), values.dtype)
        found[self.order[self.start[leaf]]] = values[leaf]
        return found

    def extremes(self, lower: Float, upper: Float) -> tuple[Float, Float]:
        """Bound the elements of every node, from the leaves upwards.

        Parameters
        ----------
        lower, upper : ndarray of shape (n, k)
            Bounds of each element.

        Returns
        -------
        lower, upper : ndarray of shape (m, k)
        """
        low, high = lower[self.order[self.start]], upper[self.order[self.start]]
        for first, last in reversed(self.levels):
            inner = first + np.flatnonzero(self.child[first:last] >= 0)
            child = self.child[inner]
            low[inner] = np.minimum(low[child], low[child + 1])
            high[inner] = np.maximum(high[child], high[child + 1])
        return low, high

    def cut(self, most: int) -> Int:
        """Give the highest nodes of at most `most` elements; together they cover every element once."""
        return self.cut_where(self.size <= most)

    def cut_where(self, small: NDArray[np.bool_]) -> Int:
        """Give the highest nodes that are marked, and leaves elsewhere; together they cover every element once."""
        small = small | (self.child < 0)
        # Below a node that is taken, none is.
        taken = small.copy()
        for first, last in self.levels:
            inner = first + np.flatnonzero(self.child[first:last] >= 0)
            child = self.child[inner]
            taken[child] |= taken[inner]
            taken[child + 1] |= taken[inner]
            small[child] &= ~taken[inner]
            small[child + 1] &= ~taken[inner]
        nodes = np.flatnonzero(small)
        return nodes[np.argsort(self.start[nodes], kind="stable")]


def least_cosine(tree: Tree, normal: Float, mean: Float) -> Float:
    """Return a lower bound of the cosine between each node's mean normal and those of its elements.

    Parameters
    ----------
    tree : Tree
    normal : ndarray of shape (n, 3)
        Of the elements, unit length.
    mean : ndarray of shape (m, 3)
        Of the nodes, unit length.

    Returns
    -------
    ndarray of shape (m,)
        By bounding boxes of the normals: exact for planes, safe for curved clusters.
    """
    low, high = tree.extremes(normal, normal)
    least = np.where(mean > 0, low, high)
    bound: Float = np.clip((mean * least).sum(axis=1), -1, 1)
    return bound


def build_tree(
    position: Float,
    normal: Float,
    shade: Float | None = None,
    *,
    compact: bool = False,
    most: int = 1,
    workers: Executor | None = None,
) -> Tree:
    """Split elements by the longest axis of position, orientation and plane offset until each stands alone.

    Parameters
    ----------
    position : ndarray of shape (n, 3)
        Centres [m].
    normal : ndarray of shape (n, 3)
        Unit normals.
    shade : ndarray of shape (n,), optional
        Binary logarithm of how bright each is: what is unevenly lit is parted, too.
    compact : bool
        Keep clusters small rather than of one orientation, where that makes better sources of light.
    most : int
        Elements that need not be split any further.
    workers : concurrent.futures.Executor, optional
        Who splits large levels, and is not waiting for this; the tree does not depend on it, bit for bit.

    Returns
    -------
    Tree
    """
    n = len(position)
    position, normal = np.asfortranarray(position), np.asfortranarray(normal)
    shade = np.zeros(n) if shade is None else shade
    order = np.arange(n)
    starts, stops = [np.array([0])], [np.array([n])]
    children: list[Int] = []
    levels = [(0, 1)]
    while True:
        start, stop = starts[-1], stops[-1]
        first, last = levels[-1]
        inner = np.flatnonzero(stop - start > most)
        child = np.full(last - first, -1)
        child[inner] = last + 2 * np.arange(len(inner))
        children.append(child)
        if not len(inner):
            break
        halves = partial(_halved, order, position=position, normal=normal, shade=shade, compact=compact)
        parts = _parts(start[inner], stop[inner])
        middle = np.concatenate(list(in_order(workers, halves, parts, len(parts)) if workers else map(halves, parts)))
        starts.append(np.column_stack((start[inner], middle)).ravel())
        stops.append(np.column_stack((middle, stop[inner])).ravel())
        levels.append((last, last + 2 * len(inner)))
    return Tree(order, np.concatenate(starts), np.concatenate(stops), np.concatenate(children), tuple(levels))


def _parts(start: Int, stop: Int) -> list[tuple[Int, Int]]:
    """Return runs of elements in parts that are split at a time: their temporaries stay near a core."""
    done = np.cumsum(stop - start)
    ends = np.flatnonzero(np.diff(done // _TOGETHER, append=-1)) + 1
    return list(zip(np.split(start, ends[:-1]), np.split(stop, ends[:-1]), strict=True))


def _halved(order: Int, runs: tuple[Int, Int], *, position: Float, normal: Float, shade: Float, compact: bool) -> Int:
    """Split runs of elements in place, see `split`."""
    return split(order, *runs, position, normal, shade, compact)
