# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the corners of a mesh are after its modifiers: light that fell on the evaluated faces goes back to them.

Blender does not tell, but most modifiers keep an order that does: what they add comes behind what there was, and
subdivision puts the parts of each face in its place. What nothing is known of goes by the nearest corner.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from ...core.mending import FARTHEST
from ...core.runs import counted
from .meshes import LocalMesh, Topology

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]

# More levels of subdivision than anybody can bake.
_MOST_LEVELS = 8
# How far a corner is moved along its normal and towards the middle of its face before the nearest one is looked for,
# as a share of the mesh's diagonal: corners at one place are told apart by where their faces look and lie.
_LIFT = 0.02
# How far apart the corners of different materials are moved, in diagonals.
_APART = 4.0
# What counts as one place, in diagonals: ten times what single precision makes of it.
_GRAIN = 1e-5
# Corners that are searched one by one.
_MOST_PLACES = 200_000


class Carried(Enum):
    """How the corners of a mesh find their light on the evaluated one."""

    SAME = "it has the same faces"
    FOUND = "its own corners are still there"
    NEAREST = "from the nearest corners"
    NOWHERE = "there are no corners to take it from, or to bring it to"


def corner_map(original: LocalMesh, evaluated: LocalMesh) -> tuple[IntArray, Carried]:
    """Find the corners of a mesh on what its modifiers made of it.

    Parameters
    ----------
    original, evaluated : LocalMesh

    Returns
    -------
    corner : ndarray of shape (c,)
        Corner of the evaluated mesh for each of the original's; empty where there are none.
    carried : Carried
        How they were found.
    """
    before, after = original.topology, evaluated.topology
    if len(before.corner_vertex) == 0 or len(after.corner_vertex) == 0:
        return np.zeros(0, dtype=np.int64), Carried.NOWHERE
    if before.same(after):
        return np.arange(len(before.corner_vertex)), Carried.SAME
    for search in (_still_there, _subdivided, _cut):
        found = search(before, after)
        if found is not None:
            return found, Carried.FOUND
    return _nearest(original, evaluated), Carried.NEAREST


def _still_there(before: Topology, after: Topology) -> IntArray | None:
    """Find the original faces in front of those that were added (Array, Mirror, Solidify, Edge Split)."""
    corners, starts = len(before.corner_vertex), before.face_start
    if len(after.corner_vertex) < corners or not np.array_equal(after.face_start[: len(starts)], starts):
        return None
    vertex = after.corner_vertex[:corners]
    # A vertex that was split is a new one at some of its corners, but not at all of them.
    kept = vertex == before.corner_vertex
    known = np.zeros(before.vertex_count, dtype=bool)
    known[vertex[kept]] = True
    same = (kept | (vertex >= before.vertex_count)).all() and known[before.corner_vertex].all()
    return np.arange(corners) if same else None


def _subdivided(before: Topology, after: Topology) -> IntArray | None:
    """Find each corner among the parts of its face, which follow each other, by the vertex, which keeps its number."""
    sizes = np.diff(before.face_start)
    face = np.repeat(np.arange(len(sizes)), sizes)
    for level in range(1, _MOST_LEVELS + 1):
        parts = np.where(sizes == 4, 4**level, sizes * 4 ** (level - 1))
        first = np.cumsum(np.append(0, parts))
        if first[-1] >= len(after.face_start):
            return None
        corners = after.face_start[first[-1]]
        if corners != 4 * first[-1] or not (np.diff(after.face_start[: first[-1] + 1]) == 4).all():
            continue
        owner = np.repeat(np.arange(len(sizes)), 4 * parts)
        found = _by_vertex(face, before.corner_vertex, owner, after.corner_vertex[:corners], before.vertex_count)
        if found is not None:
            return found
    return None


def _cut(before: Topology, after: Topology) -> IntArray | None:
    """Find corners on faces that were cut between the vertices they have (Triangulate).

    Each face of the result lies within the one that has all of its vertices, and corners go by vertex and face.
    """
    if before.vertex_count != after.vertex_count:
        return None
    count = before.vertex_count
    face = np.repeat(np.arange(len(before.face_start) - 1), np.diff(before.face_start))
    part = np.repeat(np.arange(len(after.face_start) - 1), np.diff(after.face_start))
    # Every pair of an original corner and an evaluated one at the same vertex.
    order = np.argsort(after.corner_vertex, kind="stable")
    at = np.searchsorted(after.corner_vertex[order], np.arange(count + 1))
    each = np.diff(at)[before.corner_vertex]
    one, place = counted(each, at[before.corner_vertex])
    other = order[place]
    # Of those keep the ones whose neighbours along their face are vertices of the original face, too.
    inside = np.ones(len(one), dtype=bool)
    member = np.unique(face * count + before.corner_vertex)
    for step in (1, -1):
        key = face[one] * count + after.corner_vertex[_beside(after, part, step)[other]]
        inside &= member[np.searchsorted(member, key).clip(max=len(member) - 1)] == key
    one, first = np.unique(one[inside], return_index=True)
    return other[inside][first] if len(one) == len(face) else None


def _beside(mesh: Topology, face: IntArray, step: int) -> IntArray:
    """Return the corner that follows each one round its face, or the one before."""
    start, size = mesh.face_start[face], np.diff(mesh.face_start)[face]
    return start + (np.arange(len(face)) - start + step) % size


def _by_vertex(face: IntArray, vertex: IntArray, owner: IntArray, there: IntArray, count: int) -> IntArray | None:
    """Return for each (face, vertex) the only corner with the same (owner, vertex); None if one has none or two."""
    wanted, known = face * count + vertex, owner * count + there
    which = np.flatnonzero(there < count)
    which = which[np.argsort(known[which], kind="stable")]
    if len(which) == 0:
        return None
    place = np.searchsorted(known[which], wanted)
    found = which[place.clip(max=len(which) - 1)]
    once = np.searchsorted(known[which], wanted, side="right") - place == 1
    return found if once.all() else None


def _nearest(original: LocalMesh, evaluated: LocalMesh) -> IntArray:
    """Find the corner that is nearest in place, in where its face looks and lies, and of the same material."""
    from mathutils.kdtree import KDTree

    points = np.concatenate([original.used[0], evaluated.used[0]]).astype(np.float64)
    points = points[(np.abs(points) <= FARTHEST).all(axis=1)]
    if not len(points):
        return np.zeros(len(original.topology.corner_vertex), np.int64)
    low, size = points.min(axis=0), float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    there, wanted = (_lifted(mesh, low, size) for mesh in (evaluated, original))
    # What stands at one place once is enough, and most corners are where they were.
    places, index = np.unique(_place(there), return_index=True)
    keys, first, back = np.unique(_place(wanted), return_index=True, return_inverse=True)
    slot = np.searchsorted(places, keys).clip(max=len(places) - 1)
    found = index[slot]
    moved = np.flatnonzero(places[slot] != keys)
    if len(moved):
        # Of many corners some that lie close stand for the rest: a tree of millions takes half a minute to grow.
        grain = _GRAIN
        while len(index) > _MOST_PLACES:
            grain *= 2.0
            index = index[np.unique(_place(there[index], grain), return_index=True)[1]]
        tree = KDTree(len(index))
        for number, place in enumerate(there[index].tolist()):
            tree.insert(place, number)
        tree.balance()
        found[moved] = index[[hit[1] for hit in map(tree.find, wanted[first[moved]].tolist())]]
    return np.asarray(found[back.reshape(-1)])


def _place(lifted: FloatArray, grain: float = _GRAIN) -> IntArray:
    """Return a number for each point, which is the same for points that are closer than the grain."""
    x, y, z = (np.round(lifted / grain).astype(np.int64) + 2**16).T
    return (x << 36) + (y << 18) + z


def _lifted(mesh: LocalMesh, low: FloatArray, size: float) -> FloatArray:
    """Return a point for each corner by which it can be told from others at its place, shape (c, 3)."""
    start = mesh.topology.face_start
    face = np.repeat(np.arange(len(start) - 1), np.diff(start))
    place = (mesh.vertices[mesh.topology.corner_vertex] - low) / size
    # Corners that are nowhere go to the middle.
    place = np.where(np.abs(place - 0.5) < 0.51, place, 0.5)
    inwards = (np.add.reduceat(place, start[:-1], axis=0) / np.diff(start)[:, None])[face] - place
    inwards /= np.maximum(np.linalg.norm(inwards, axis=1, keepdims=True), 1e-12)
    lifted = place + _LIFT * (np.nan_to_num(mesh.corner_normals) + inwards)
    lifted[:, 0] += _APART * mesh.material[face]
    return np.asarray(lifted)
