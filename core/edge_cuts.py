# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the edges of a mesh are cut: the same for all faces at an edge, as it depends on the edge alone."""

from dataclasses import dataclass

import numpy as np

from .arrays import BoolArray, IntArray
from .grids import edge_parts, fewest_parts, longest_edges
from .places import places
from .runs import counted
from .scene import Scene
from .triangulation import Pieces


@dataclass(frozen=True, eq=False)
class EdgeCuts:
    """All edges of the faces of a mesh and of their pieces.

    Attributes
    ----------
    low, high : ndarray of shape (e,)
        Their vertices, in an order that depends on nothing but where these are.
    parts : ndarray of shape (e,)
        Into how many parts each is cut.
    first : ndarray of shape (e,)
        Number of the first new vertex on each.
    outer : ndarray of shape (e,)
        Whether it is an edge of a face, and not only of pieces.
    key : ndarray of shape (e,)
        What each is found by, ascending.
    base : int
        How many vertices the coarse mesh has.
    """

    low: IntArray
    high: IntArray
    parts: IntArray
    first: IntArray
    outer: BoolArray
    key: IntArray
    base: int

    def find(self, one: IntArray, other: IntArray) -> IntArray:
        """Return the edges between vertices; any edge for a vertex and itself."""
        key = np.minimum(one, other) * self.base + np.maximum(one, other)
        return np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)

    def point(self, one: IntArray, other: IntArray, step: IntArray) -> IntArray:
        """Return the vertex at a cut of the edge between two vertices, counted from the first of them."""
        index = self.find(one, other)
        parts = np.where(one == other, 0, self.parts[index])
        new = self.first[index] - 1 + np.where(self.low[index] == one, step, parts - step)
        return np.where(step == 0, one, np.where(step == parts, other, new))

    def split(self) -> tuple[IntArray, IntArray]:
        """Return the vertices of each part of an edge of a face, and those of that edge, shape (n, 2) both."""
        index = np.flatnonzero(self.outer & (self.low != self.high))
        owner, step = counted(self.parts[index])
        low, high = self.low[index][owner], self.high[index][owner]
        parts = np.stack([self.point(low, high, step), self.point(low, high, step + 1)], axis=1)
        return parts, np.stack([low, high], axis=1)


def edge_cuts(scene: Scene, whole: Pieces, max_edge: float | None, subdivide: int) -> EdgeCuts:
    """Find all edges, and decide how often each is cut.

    Parameters
    ----------
    scene : Scene
        The mesh.
    whole : Pieces
        Its faces' convex parts.
    max_edge : float or None
        No part may be longer [m], but on faces with a length of their own.
    subdivide : int
        Factor on the scene's divisions, which are the fewest parts.

    Returns
    -------
    EdgeCuts
        The finest that any of the faces at an edge asks for, or at another edge at the same place: a seam stays closed.
        Faces without area ask for nothing.
    """
    base = len(scene.vertices)
    ends = scene.corner_vertex[whole.corner]
    one = np.concatenate([scene.corner_vertex, ends.ravel()])
    other = np.concatenate([scene.corner_vertex[scene.following_corner], np.roll(ends, -1, axis=1).ravel()])
    face = np.concatenate([scene.corner_face, np.repeat(whole.face, 4)])
    key, found = np.unique(np.minimum(one, other) * base + np.maximum(one, other), return_inverse=True)
    found = found.reshape(-1)
    low, high = key // max(base, 1), key % max(base, 1)
    a, b = scene.vertices[low], scene.vertices[high]
    # By place and not by number, so that faces that touch but share no vertex are cut at the very same points.
    axis = np.argmax(a != b, axis=1)[:, None]
    swap = np.take_along_axis(a, axis, axis=1)[:, 0] > np.take_along_axis(b, axis, axis=1)[:, 0]
    length = np.linalg.norm(a - b, axis=1)

    longest, least = longest_edges(scene, max_edge), fewest_parts(scene, subdivide)
    wanted = edge_parts(length[found], longest[face], least[face])
    wanted[~scene.live[face]] = 1
    parts = np.ones(len(key), dtype=np.int64)
    np.maximum.at(parts, found, wanted)
    parts[length == 0.0] = 1
    parts = _alike(places(scene.vertices), low, high, parts)
    outer = np.zeros(len(key), dtype=bool)
    outer[found[: len(scene.corner_vertex)]] = True
    first = base + np.cumsum(parts - 1) - (parts - 1)
    return EdgeCuts(np.where(swap, high, low), np.where(swap, low, high), parts, first, outer, key, base)


def _alike(place: IntArray, low: IntArray, high: IntArray, parts: IntArray) -> IntArray:
    """Return the parts of edges between vertices, the most of all that lie at the same place."""
    one, other = place[low], place[high]
    key = np.minimum(one, other) * len(place) + np.maximum(one, other)
    edge = np.unique(key, return_inverse=True)[1].reshape(-1)
    most = np.zeros(len(key), dtype=np.int64)
    np.maximum.at(most, edge, parts)
    return most[edge]
