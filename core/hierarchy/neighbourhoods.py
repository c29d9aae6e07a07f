# SPDX-License-Identifier: GPL-3.0-or-later
"""Which elements are neighbours: a tree of sheets that look one way, which samples of any number are chosen from."""

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..visibility import Surroundings
from .elements import Elements
from .probes import points_facing_dark
from .tree import Float, Int, Tree, build_tree, least_cosine

# Normals of a cluster lie within a cone of this cosine, and whether it is to be one sheet; where that leaves too many
# clusters, first several sheets may be one, then those that look another way.
_LIKE = ((0.87, True), (0.5, True), (0.5, False), (-np.inf, False))
# Times as many clusters as like elements alone ask for, and as there should be, at most.
_ROOM, _OVER = 1.25, 1.5
# Clusters that a trend is told by, at least.
_TREND = 6
# Halvings of the longest side that is looked for.
_HALVINGS = 16
# Standard deviation across a cluster over that along it: what a bend of that cone makes of a sheet, and no more.
_THIN = 0.12


@dataclass(frozen=True, eq=False)
class Neighbourhoods:
    """Elements by where they are and how they look, whatever the number of samples.

    Attributes
    ----------
    tree : Tree
        Over the elements.
    side : ndarray of shape (nodes,)
        Longest side of each node's bounding box [m].
    cosine : ndarray of shape (nodes,)
        Lower bound of the cosine between a node's mean normal and those of its elements.
    thin : ndarray of shape (nodes,)
        Nodes that are one sheet rather than several above each other.
    """

    tree: Tree
    side: Float
    cosine: Float
    thin: NDArray[np.bool_]

    def smallest(self, most: int) -> tuple[Int, NDArray[np.bool_]]:
        """Choose the nodes of the smallest size that leaves no more than `most`, or few more.

        Parameters
        ----------
        most : int
            Half as many again where elements look so many ways.

        Returns
        -------
        nodes : ndarray of shape (k,)
            In the tree's order; together they cover every element once.
        alike : ndarray of shape (nodes,)
            Which nodes of the tree hold like elements.
        """
        tree, side = self.tree, self.side
        for like, thin in _LIKE:
            alike = (self.cosine > like) & (self.thin | (not thin))
            small, large = 0.0, float(side[0])
            nodes = tree.cut_where(alike & (side <= large))
            # Where little things take up all that was asked for, what is wide is still cut.
            enough = max(most, _ROOM * len(nodes))
            # A little more than was asked for is better than to take a ceiling and a floor for one.
            if like > 0 and enough > _OVER * most:
                continue
            for _ in range(_HALVINGS):
                middle = 0.5 * (small + large)
                tried = tree.cut_where(alike & (side <= middle))
                if len(tried) > enough:
                    small = middle
                else:
                    large, nodes = middle, tried
            break
        return nodes, alike

    def regions(self, nodes: Int, alike: NDArray[np.bool_]) -> Int:
        """Put nodes together that lie side by side, enough of them to tell a trend by.

        Parameters
        ----------
        nodes : ndarray of shape (k,)
            In the tree's order, as `smallest` chooses them.
        alike : ndarray of shape (nodes,)
            Which nodes of the tree hold like elements.

        Returns
        -------
        ndarray of shape (k,)
            The same number for all of a region.
        """
        tree = self.tree
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


def find_neighbourhoods(
    elements: Elements,
    occluders: Surroundings,
    sides: NDArray[np.uint8] | None = None,
    workers: Executor | None = None,
) -> Neighbourhoods:
    """Sort elements into a tree that samples are chosen from.

    Parameters
    ----------
    elements : Elements
    occluders : Surroundings
        Tells which elements are under something: those are neighbours of each other only.
    sides : ndarray of shape (f,), optional
        Which sides of all faces that block have light; their fronts when not given.
    workers : concurrent.futures.Executor, optional
        See `build_tree`.

    Returns
    -------
    Neighbourhoods
    """
    covered = points_facing_dark(elements.centre, elements.normal, sides, occluders)
    tree = build_tree(elements.centre, elements.normal, 1e3 * covered.astype(float), workers=workers)
    low, high = tree.extremes(elements.corners.min(axis=1), elements.corners.max(axis=1))
    vector = tree.sums(elements.area[:, None] * elements.normal)
    mean = vector / np.maximum(np.sqrt((vector * vector).sum(axis=1)), 1e-300)[:, None]
    cosine, thin = least_cosine(tree, elements.normal, mean), _thin(tree, elements, mean)
    return Neighbourhoods(tree, (high - low).max(axis=1), cosine, thin)


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
