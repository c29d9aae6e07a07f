# SPDX-License-Identifier: GPL-3.0-or-later
"""The shares that single targets have of a scene that was cut finer, as cuts of their own meshes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...core.refinement import Refinement
from ...core.scene import Scene
from ..objects.targets import Target

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Part:
    """A mesh cut finer, in terms of that mesh.

    Attributes
    ----------
    scene_corner : ndarray of shape (c,)
        Corner of the finer scene for each of its corners.
    corner_vertex : ndarray of shape (c,)
    face_start : ndarray of shape (f + 1,)
    face : ndarray of shape (f,)
        Face of the mesh that each is a part of.
    corner_source, corner_weight : ndarray of shape (c, 4)
        Corners of the mesh, and how much each counts.
    vertex_source, vertex_weight : ndarray of shape (v, 4)
        Vertices of the mesh, and how much each counts.
    edge, edge_source : ndarray of shape (e, 2)
        Vertices of parts of edges, and vertices of the mesh that these edges join.
    loose : ndarray of shape (l, 2)
        Vertices of edges that no face has.
    whole : bool
        Whether the mesh is not cut at all, so that its corners are those of the scene, one by one.
    """

    scene_corner: IntArray
    corner_vertex: IntArray
    face_start: IntArray
    face: IntArray
    corner_source: IntArray
    corner_weight: FloatArray
    vertex_source: IntArray
    vertex_weight: FloatArray
    edge: IntArray
    edge_source: IntArray
    loose: IntArray
    whole: bool


def split(targets: tuple[Target, ...], scene: Scene, fine: Refinement) -> Iterator[Part]:
    """Take a refinement of a scene apart.

    Parameters
    ----------
    targets : tuple of Target
    scene : core.scene.Scene
        That they were read into, before it was cut finer.
    fine : core.refinement.Refinement
        Of that scene.

    Yields
    ------
    Part
        One for each target, in order.
    """
    # Vertex of its own mesh for each of the scene's: no two meshes share one there.
    own = np.zeros(len(scene.vertices), dtype=np.int64)
    for target in targets:
        own[scene.corner_vertex[target.evaluated_corner]] = target.evaluated.corner_vertex
    # Edges are in the order of their vertices, and these in the order of the meshes.
    edge_begin = fine.edge_source.min(axis=1) if len(fine.edge_source) else np.zeros(0, np.int64)
    for target in targets:
        yield _part(target, scene, fine, own, edge_begin)


def _part(target: Target, scene: Scene, fine: Refinement, own: IntArray, edge_begin: IntArray) -> Part:
    """Return the share of one target."""
    evaluated, first = target.evaluated, target.first_corner
    count = len(evaluated.corner_vertex)
    first_face = int(scene.corner_face[first])
    begin, end = np.searchsorted(fine.face, (first_face, first_face + len(evaluated.face_start) - 1))
    start = fine.face_start[begin : end + 1]
    corner = np.arange(start[0], start[-1])
    if target.mirrored:
        # Counter-clockwise there is clockwise here.
        corner = np.repeat(start[:-1] + start[1:] - 1, np.diff(start)) - corner
    corner, start, face = _without_repeats(fine.corner_vertex[corner], corner, start, np.arange(begin, end))
    source = fine.corner_source[corner] - first
    source = evaluated.turned[source] if target.mirrored else source
    vertex, corner_vertex = np.unique(fine.corner_vertex[corner], return_inverse=True)

    used = scene.corner_vertex[first : first + count]
    low, high = np.searchsorted(edge_begin, (used.min(), used.max() + 1))
    edge, edge_source = fine.edge[low:high], fine.edge_source[low:high]
    alone = len(source) == count and np.array_equal(source[:, 0], np.arange(count))
    whole = alone and bool((fine.corner_weight[corner, 0] == 1.0).all())
    known = np.isin(edge, vertex).all(axis=1)
    edge, edge_source = edge[known], edge_source[known]
    return Part(
        corner,
        corner_vertex.reshape(-1),
        start,
        fine.face[face] - first_face,
        source,
        fine.corner_weight[corner],
        own[fine.vertex_source[vertex]],
        fine.vertex_weight[vertex],
        np.searchsorted(vertex, edge),
        own[edge_source],
        np.zeros((0, 2), np.int64),
        whole,
    )


def _without_repeats(
    vertex: IntArray, corner: IntArray, start: IntArray, face: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Leave out what Blender crashes on: corners at the vertex of another one of their face, and what they leave of it.

    Parameters
    ----------
    vertex, corner : ndarray of shape (c,)
        Vertices of the corners of all faces, and the corners themselves.
    start : ndarray of shape (f + 1,)
    face : ndarray of shape (f,)

    Returns
    -------
    corner, start, face : ndarray
        Of those that stay; `start` begins with 0.
    """
    size = np.diff(start)
    owner = np.repeat(np.arange(len(size)), size)
    keep = np.zeros(len(corner), dtype=bool)
    keep[np.unique(owner * (vertex.max(initial=0) + 1) + vertex, return_index=True)[1]] = True
    left = np.bincount(owner[keep], minlength=len(size))
    keep &= (left >= 3)[owner]
    return corner[keep], np.concatenate(([0], np.cumsum(left[left >= 3]))), face[left >= 3]


def mixed(values: NDArray[np.generic], source: IntArray, weight: FloatArray) -> FloatArray:
    """Return weighted sums of rows; what counts whole stays as it is, bit for bit.

    Parameters
    ----------
    values : ndarray of shape (m, ...)
        Of the corners or vertices of a mesh.
    source, weight : ndarray of shape (n, 4)
        Which of them, and how much each counts, as `Part` has it.

    Returns
    -------
    ndarray of shape (n, k)
    """
    rows = values.reshape(len(values), -1).astype(np.float64)
    first = rows[source[:, 0]]
    # Attributes may hold what is no number, which stays so.
    with np.errstate(over="ignore", invalid="ignore"):
        return first + np.einsum("nk,nkx->nx", weight, rows[source] - first[:, None])
