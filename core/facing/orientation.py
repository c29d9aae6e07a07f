# SPDX-License-Identifier: GPL-3.0-or-later
"""How faces are turned against their neighbours, and which of them leave no edge open.

Two faces at an edge agree when they run along it in opposite directions. Turning some faces makes all that hang
together by edges agree, unless the surface has one side only, as Moebius's band.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, IntArray
from ..scene import Scene
from .connected import connected
from .seams import sewn_vertices


@dataclass(frozen=True, eq=False)
class Orientation:
    """How the faces of a scene are turned.

    Attributes
    ----------
    turned : ndarray of shape (f,)
        The lesser part of the faces that hang together by edges, where two parts are turned against each other.
    sealed : ndarray of shape (f,)
        Faces with exactly one neighbour at each edge, on surfaces with two sides.
    """

    turned: BoolArray
    sealed: BoolArray


def orientation(scene: Scene, vertex: IntArray | None = None) -> Orientation:
    """Compare all faces with their neighbours.

    Parameters
    ----------
    scene : Scene
        Faces of different objects, and those that are left out, are no neighbours. Edges with more than two faces do
        not tell how these are turned.
    vertex : ndarray of shape (c,), optional
        The vertex of each corner: faces with two of them in common are neighbours. Else that of `sewn_vertices`.

    Returns
    -------
    Orientation
    """
    face, one, other, proper = _neighbours(scene, sewn_vertices(scene) if vertex is None else vertex)
    count = len(scene.face_object)
    open_edges = np.bincount(face[proper], minlength=count) - np.bincount(np.append(one[0], other[0]), minlength=count)
    sealed = scene.live & (open_edges == 0)
    turned = np.zeros(count, dtype=np.bool_)
    agree = one[1] != other[1]
    if agree.all():
        return Orientation(turned, sealed)
    # Every face as it is, and turned: what agrees hangs together.
    a, b = one[0], other[0] + np.where(agree, 0, count)
    label = connected(np.append(a, (a + count) % (2 * count)), np.append(b, (b + count) % (2 * count)), 2 * count)
    here, there = label[:count], label[count:]
    two_sided = here != there
    # Both ways to turn a part have a label; the lesser one stands for the part.
    part, first = np.minimum(here, there), here < there
    sizes = [np.bincount(part[two_sided & chosen], minlength=2 * count) for chosen in (first, ~first)]
    turned = two_sided & np.where(first, (sizes[0] < sizes[1])[part], (sizes[1] <= sizes[0])[part])
    return Orientation(turned, sealed & two_sided)


def _neighbours(
    scene: Scene, start: IntArray
) -> tuple[IntArray, tuple[IntArray, BoolArray], tuple[IntArray, BoolArray], BoolArray]:
    """Return the face of each corner, both faces at each edge that has two and their directions, and the real edges."""
    face, end = scene.corner_face, start[scene.following_corner]
    proper = scene.live[face] & (start != end)
    edge = np.flatnonzero(proper)
    low, high = np.minimum(start, end)[edge], np.maximum(start, end)[edge]
    of = scene.face_object[face[edge]]
    order = np.lexsort((high, low, of))
    edge, low, high, of = edge[order], low[order], high[order], of[order]
    fresh = np.append(True, (low[1:] != low[:-1]) | (high[1:] != high[:-1]) | (of[1:] != of[:-1]))[: len(edge)]
    first = np.flatnonzero(fresh)
    first = first[np.diff(np.append(first, len(edge))) == 2]
    one, other = edge[first], edge[first + 1]
    up = start < end
    return face, (face[one], up[one]), (face[other], up[other]), proper
