# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat faces that share edges, joined and cut anew into the few convex polygons that fill their union."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..scene import Scene
from .outlines import Loops, convex, edge_runs, fans, loop_areas, outlines, straightened
from .trapezoids import trapezoids

# Lengths are shares of the diagonal of the scene's core. Blender's single precision is off by 1e-7 of it.
COPLANAR = 3e-7  # faces this near to one plane are joined
STRAIGHT = 2e-7  # a border's corner this near to the line between its neighbours does not bend it
WELD = 1e-7  # corners this near to each other are one
# Cosine between the normals of faces that may be of one plane; small faces in a large scene have noisy normals.
PARALLEL = 1.0 - 5e-8
# Relative error of the area that a union may have.
SAME_AREA = 1e-6
# Unions with more corners than this stay apart: filling them takes the square of it.
MOST_CORNERS = 2000


@dataclass(frozen=True, eq=False)
class Joined:
    """What stands for the faces that were joined.

    Attributes
    ----------
    done : ndarray of shape (f,)
        The faces that were joined.
    fan : ndarray of shape (q, 4)
        Convex quads over the scene's vertices; a triangle repeats its last corner.
    fan_face : ndarray of shape (q,)
        One of the faces that each quad stands for.
    cut : ndarray of shape (r, 4, 3)
        Convex quads with corners elsewhere [m].
    cut_face : ndarray of shape (r,)
        As `fan_face`.
    """

    done: BoolArray
    fan: IntArray
    fan_face: IntArray
    cut: FloatArray
    cut_face: IntArray


@dataclass(frozen=True, eq=False)
class _Groups:
    """Faces of one plane: the group of each face or -1, and for each group two axes with the normal, and a point."""

    of: IntArray  # (f,)
    axes: FloatArray  # (g, 3, 3)
    origin: FloatArray  # (g, 3)

    def flattened(self, vertices: FloatArray, loops: Loops) -> FloatArray:
        """Return the corners of loops in the planes of their groups, shape (e, 2) [m]."""
        group = loops.group[loops.corner_loop()]
        arm = vertices[loops.vertex] - self.origin[group]
        return np.asarray(np.einsum("exy,ey->ex", self.axes[group, :2], arm))


def join(scene: Scene, flat: BoolArray, diagonal: float) -> Joined:
    """Join coplanar faces that share edges, wherever fewer polygons can stand for them.

    Parameters
    ----------
    scene : Scene
    flat : ndarray of shape (f,)
        The faces that lie in a plane.
    diagonal : float
        Of the scene [m].

    Returns
    -------
    Joined
        The union of its polygons is the union of the faces that were joined, to rounding.
    """
    tail = welded(scene.vertices, WELD * diagonal)[scene.corner_vertex]
    head = tail[scene.following_corner]
    groups = _groups(scene, flat, tail, head, diagonal)
    n_groups, member = len(groups.origin), groups.of >= 0

    # What is left of the borders is simpler than what the faces brought, but bounds the same area or is not taken.
    corner = np.flatnonzero(member[scene.corner_face] & (tail != head))
    loops, sound = outlines(tail[corner], head[corner], groups.of[scene.corner_face[corner]], n_groups)
    loops = straightened(loops, groups.flattened(scene.vertices, loops), STRAIGHT * diagonal)
    points = groups.flattened(scene.vertices, loops)
    area = np.bincount(groups.of[member], weights=scene.face_area[member], minlength=n_groups)
    covered = np.bincount(loops.group, weights=loop_areas(loops, points), minlength=n_groups)
    sound &= np.abs(covered - area) <= SAME_AREA * area

    # A single loop without right turns is a polygon as it is.
    single = np.bincount(loops.group, minlength=n_groups) == 1
    whole = convex(loops, points) & (single & sound)[loops.group]
    fan, fan_loop = fans(loops, whole)
    done = np.zeros(n_groups, dtype=bool)
    done[loops.group[whole]] = True
    face = _first_faces(groups)

    # Everything else takes about half as many trapezoids as it has corners.
    cuts, cut_groups = [np.zeros((0, 4, 3))], [np.zeros(0, dtype=np.int64)]
    n_faces = np.bincount(groups.of[member], minlength=n_groups)
    n_corners = np.bincount(loops.group[loops.corner_loop()], minlength=n_groups)
    after = loops.following()
    first_loop: IntArray = np.searchsorted(loops.group, np.arange(n_groups + 1))
    for group in map(int, np.flatnonzero(sound & ~done & (n_corners <= np.minimum(2 * n_faces, MOST_CORNERS)))):
        part = slice(loops.start[first_loop[group]], loops.start[first_loop[group + 1]])
        cut = trapezoids(points[part], points[after[part]], STRAIGHT * diagonal)
        if len(cut) < n_faces[group] and abs(_area(cut) - area[group]) <= SAME_AREA * area[group]:
            cuts.append(groups.origin[group] + cut @ groups.axes[group, :2])
            cut_groups.append(np.full(len(cut), group))
            done[group] = True
    cut_group = np.concatenate(cut_groups)
    return Joined(
        member & np.append(done, False)[groups.of],
        fan,
        face[loops.group[fan_loop]],
        np.concatenate(cuts),
        face[cut_group],
    )


def welded(vertices: FloatArray, tolerance: float) -> IntArray:
    """Return for each vertex the first one that is at the same place.

    Parameters
    ----------
    vertices : ndarray of shape (v, 3)
        Positions [m].
    tolerance : float
        Vertices closer than this may count as one, farther ones never do by more than twice of it [m].

    Returns
    -------
    ndarray of shape (v,)
    """
    cell = np.round((vertices - vertices.min(axis=0, initial=np.inf)) / tolerance)
    place = np.zeros(len(vertices), dtype=np.int64)
    for axis in range(3):
        _, rank = np.unique(cell[:, axis], return_inverse=True)
        _, place = np.unique(place * (len(vertices) + 1) + rank, return_inverse=True)
    # The last one written stays: the first vertex there.
    first = np.zeros(len(vertices), dtype=np.int64)
    first[place[::-1]] = np.arange(len(vertices))[::-1]
    return np.asarray(first[place])


def _groups(scene: Scene, flat: BoolArray, tail: IntArray, head: IntArray, diagonal: float) -> _Groups:
    """Return groups of more than one coplanar face with the same front, and single faces of more than four corners."""
    # Faces that follow each other in a run share an edge.
    corner = np.flatnonzero(flat[scene.corner_face] & (tail != head))
    order, first = edge_runs(tail[corner], head[corner])
    owner = scene.corner_face[corner[order]]
    a, b = owner[:-1][~first[1:]], owner[1:][~first[1:]]
    middle, normal = _middles(scene), scene.face_normal
    apart = middle[b] - middle[a]
    height = np.maximum(np.abs((normal[a] * apart).sum(axis=1)), np.abs((normal[b] * apart).sum(axis=1)))
    one = (height <= COPLANAR * diagonal) & ((normal[a] * normal[b]).sum(axis=1) > PARALLEL)
    label = components(len(flat), a[one], b[one])
    many = np.bincount(label, minlength=len(flat))[label] > 1
    groups = _numbered(scene, label, flat & (many | (np.diff(scene.face_start) > 4)))

    # A gentle curve may be coplanar from face to face and still not be flat as a whole.
    corner = np.flatnonzero(groups.of[scene.corner_face] >= 0)
    of = groups.of[scene.corner_face[corner]]
    arm = scene.vertices[scene.corner_vertex[corner]] - groups.origin[of]
    bent = np.abs((arm * groups.axes[of, 2]).sum(axis=1)) > COPLANAR * diagonal
    curved = np.bincount(of[bent], minlength=len(groups.origin)) > 0
    if not np.any(curved):
        return groups
    return _numbered(scene, groups.of, (groups.of >= 0) & ~curved[groups.of])


def components(n: int, a: IntArray, b: IntArray) -> IntArray:
    """Return the connected components of a graph.

    Roots are hooked to smaller roots, then every path is shortened, until nothing changes (Shiloach and Vishkin 1982).

    Parameters
    ----------
    n : int
        Number of nodes.
    a, b : ndarray of shape (k,)
        The ends of the edges.

    Returns
    -------
    ndarray of shape (n,)
        The smallest node of each one's component.
    """
    root = np.arange(n)
    while len(a):
        root[np.maximum(a, b)] = np.minimum(a, b)
        while not np.array_equal(root, root[root]):
            root = root[root]
        a, b = root[a], root[b]
        a, b = a[a != b], b[a != b]
    return root


def _numbered(scene: Scene, label: IntArray, keep: BoolArray) -> _Groups:
    """Return the groups of faces with the same label, numbered in the order of the labels, and their planes."""
    of = np.full(len(label), -1)
    values, of[keep] = np.unique(label[keep], return_inverse=True)
    area = np.bincount(of[keep], weights=scene.face_area[keep], minlength=len(values))
    # Sums weighted by area count small, noisy faces little.
    weighted = _middles(scene)[keep] * scene.face_area[keep, None]
    normal, origin = (
        np.stack([np.bincount(of[keep], weights=x[:, k], minlength=len(values)) for k in range(3)], axis=1)
        for x in (scene.area_vector[keep], weighted)
    )
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    # The axis that is farthest from the normal cannot be parallel to it.
    first = np.cross(np.eye(3)[np.argmin(np.abs(normal), axis=1)], normal)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return _Groups(of, np.stack([first, np.cross(normal, first), normal], axis=1), origin / area[:, None])


def _middles(scene: Scene) -> FloatArray:
    """Return the mean of the corners of each face, shape (f, 3) [m]."""
    total = np.add.reduceat(scene.vertices[scene.corner_vertex], scene.face_start[:-1], axis=0)
    return np.asarray(total / np.diff(scene.face_start)[:, None])


def _first_faces(groups: _Groups) -> IntArray:
    """Return the first face of each group, shape (g,)."""
    first = np.zeros(len(groups.origin), dtype=np.int64)
    faces = np.flatnonzero(groups.of >= 0)[::-1]
    first[groups.of[faces]] = faces
    return first


def _area(quads: FloatArray) -> float:
    """Return the summed area of plane quads."""
    a, b = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
    return float(0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
