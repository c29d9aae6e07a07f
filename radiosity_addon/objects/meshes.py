# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's meshes as arrays, in the space of their object, and their faces brought to the world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Topology:
    """Which vertices the faces of a mesh have.

    Attributes
    ----------
    corner_vertex : ndarray of shape (c,)
        Vertex of each corner.
    face_start : ndarray of shape (f + 1,)
        First corner of each face; the last entry is c.
    vertex_count : int
        Vertices of the mesh, those without faces included.
    """

    corner_vertex: IntArray
    face_start: IntArray
    vertex_count: int

    def same(self, other: Topology) -> bool:
        """Tell whether another mesh has the same vertices at the same corners of the same faces."""
        return (
            self.vertex_count == other.vertex_count
            and np.array_equal(self.corner_vertex, other.corner_vertex)
            and np.array_equal(self.face_start, other.face_start)
        )

    @cached_property
    def turned(self) -> IntArray:
        """Return the corners with those of each face in opposite order; twice is the first order again."""
        start = self.face_start
        return np.repeat(start[:-1] + start[1:] - 1, np.diff(start)) - np.arange(start[-1])


@dataclass(frozen=True, eq=False)
class LocalMesh:
    """A mesh in the space of its object [Blender units], without references to Blender's data.

    Attributes
    ----------
    topology : Topology
    vertices : ndarray of shape (v, 3)
        Positions, in Blender's own precision.
    corner_normals : ndarray of shape (c, 3)
        Shading normals.
    material : ndarray of shape (f,)
        Index of the material slot of each face.
    """

    topology: Topology
    vertices: NDArray[np.float32]
    corner_normals: NDArray[np.float32]
    material: NDArray[np.int32]

    @cached_property
    def used(self) -> tuple[NDArray[np.float32], IntArray]:
        """Return the vertices that faces have, and which of them each corner has.

        What no face uses is not a part of any surface, wherever it is.
        """
        marked = np.zeros(len(self.vertices), dtype=bool)
        marked[self.topology.corner_vertex] = True
        return self.vertices[marked], (np.cumsum(marked) - 1)[self.topology.corner_vertex]


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """The faces of a mesh in the world.

    Attributes
    ----------
    vertices : ndarray of shape (v, 3)
        Positions [m].
    corner_vertex : ndarray of shape (c,)
    corner_normals : ndarray of shape (c, 3)
        Of any length.
    """

    vertices: FloatArray
    corner_vertex: IntArray
    corner_normals: FloatArray


def topology(mesh: bpy.types.Mesh) -> Topology:
    """Read the topology of a mesh."""
    starts = column(mesh.polygons, "loop_start", 1, np.int32)
    return Topology(
        column(mesh.loops, "vertex_index", 1, np.int32).astype(np.int64),
        np.append(starts, len(mesh.loops)).astype(np.int64),
        len(mesh.vertices),
    )


def local_mesh(mesh: bpy.types.Mesh) -> LocalMesh:
    """Read a mesh; nothing of it is needed afterwards."""
    return LocalMesh(
        topology(mesh),
        column(mesh.vertices, "co", 3),
        column(mesh.corner_normals, "vector", 3),
        column(mesh.polygons, "material_index", 1, np.int32),
    )


def mirrors(matrix: FloatArray) -> bool:
    """Tell whether a matrix of shape (4, 4) turns left hands into right ones."""
    # A matrix that is no numbers, or too large ones, turns nothing: what is there is left out.
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.linalg.det(matrix[:3, :3]) < 0.0)


def placed(mesh: LocalMesh, matrix: FloatArray, scale: float) -> PlacedMesh:
    """Bring a mesh to the world.

    Parameters
    ----------
    mesh : LocalMesh
    matrix : ndarray of shape (4, 4)
        Object space to world space [Blender units].
    scale : float
        Length of a Blender unit [m].

    Returns
    -------
    PlacedMesh
        Where the matrix mirrors, corners are in the order of `Topology.turned`: what was counter-clockwise is clockwise
        then, while the outside stays the outside.
    """
    linear = matrix[:3, :3]
    vertices, corner_vertex = mesh.used
    # Normals go by the cofactors, the inverse transpose without its division: right for any scale, 0 included.
    cofactors = np.stack(
        [np.cross(linear[1], linear[2]), np.cross(linear[2], linear[0]), np.cross(linear[0], linear[1])]
    )
    # What is at no finite place is found where the scene is built.
    with np.errstate(over="ignore", invalid="ignore"):
        world = scale * (vertices @ linear.T + matrix[:3, 3])
        normals = mesh.corner_normals @ cofactors.T
    if mirrors(matrix):
        turned = mesh.topology.turned
        return PlacedMesh(world, corner_vertex[turned], -normals[turned])
    return PlacedMesh(world, corner_vertex, normals)


def column(
    collection: bpy.types.bpy_prop_collection, name: str, width: int, dtype: type = np.float32
) -> NDArray[np.generic]:
    """Return one property of all items as an array of shape (n,) or (n, width), in Blender's own precision."""
    values = np.zeros(len(collection) * width, dtype=dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values
