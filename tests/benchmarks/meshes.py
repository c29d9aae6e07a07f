# SPDX-License-Identifier: GPL-3.0-or-later
"""Simple meshes that the benchmark scenes are put together from, in NumPy alone."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Faces of one material.

    Attributes
    ----------
    vertices : ndarray of shape (v, 3)
        Positions [m].
    faces : ndarray of shape (f, 4)
        Vertices of each face, counter-clockwise seen from the lit side; a triangle has -1 as its last.
    """

    vertices: FloatArray
    faces: IntArray


def grid(corners: ArrayLike, columns: int, rows: int) -> Mesh:
    """Split a quad into columns x rows quads on its bilinear surface.

    Parameters
    ----------
    corners : array_like of shape (4, 3)
        Counter-clockwise seen from the lit side [m].
    columns, rows : int
        Faces along the first and the second edge.
    """
    a, b, c, d = np.asarray(corners, dtype=np.float64)
    u = np.linspace(0.0, 1.0, columns + 1)[None, :, None]
    v = np.linspace(0.0, 1.0, rows + 1)[:, None, None]
    vertices = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1, 1)
    return Mesh(vertices.reshape(-1, 3), first + np.array([0, 1, columns + 2, columns + 1]))


def cells(corners: ArrayLike, size: float) -> Mesh:
    """Split a quad into quads of about `size` metres."""
    a, b, _, d = np.asarray(corners, dtype=np.float64)
    columns, rows = (max(1, round(float(np.linalg.norm(end - a)) / size)) for end in (b, d))
    return grid(corners, columns, rows)


def box(low: ArrayLike, high: ArrayLike, size: float, *, inside: bool = False, without: str = "") -> Mesh:
    """Build an axis-parallel box of quads, lit on the outside (or on the inside: a room).

    Parameters
    ----------
    low, high : array_like of shape (3,)
        Opposite corners [m].
    size : float
        Length of a face's edges [m].
    inside : bool
        Turn the normals inwards.
    without : str
        Sides to leave out, as in "-z" or "-z -y".
    """
    (x, y, z), (X, Y, Z) = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    sides = {
        "-x": [(x, Y, z), (x, y, z), (x, y, Z), (x, Y, Z)],
        "+x": [(X, y, z), (X, Y, z), (X, Y, Z), (X, y, Z)],
        "-y": [(x, y, z), (X, y, z), (X, y, Z), (x, y, Z)],
        "+y": [(X, Y, z), (x, Y, z), (x, Y, Z), (X, Y, Z)],
        "-z": [(x, Y, z), (X, Y, z), (X, y, z), (x, y, z)],
        "+z": [(x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)],
    }
    kept = [corners for name, corners in sides.items() if name not in without.split()]
    shell = weld(join(*(cells(corners, size) for corners in kept)))
    return flipped(shell) if inside else shell


def torus(major: float, minor: float, around: int, across: int, *, triangles: bool = True) -> Mesh:
    """Build a torus about the z axis."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    phi, theta = 2 * np.pi * u / around, 2 * np.pi * v / across
    radius = major + minor * np.cos(theta)
    vertices = np.stack([radius * np.cos(phi), radius * np.sin(phi), minor * np.sin(theta)], axis=-1)
    corner = [(0, 0), (1, 0), (1, 1), (0, 1)]
    faces = np.stack([(u + i) % around * across + (v + j) % across for i, j in corner], axis=-1)
    mesh = Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 4))
    return triangulated(mesh) if triangles else mesh


def icosphere(radius: float, levels: int) -> Mesh:
    """Build a ball of 20 * 4^levels triangles."""
    g = (1 + 5**0.5) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g)]
    points += [(g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    faces += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
    faces += [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    corners = np.array(points, dtype=np.float64)[np.array(faces)]
    for _ in range(levels):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        split = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(triangle, axis=1) for triangle in split])
        corners /= np.linalg.norm(corners, axis=-1, keepdims=True)
    first = np.arange(len(corners))[:, None] * 3
    faces_of_four = np.concatenate([first, first + 1, first + 2, np.full_like(first, -1)], axis=1)
    return weld(Mesh(radius * corners.reshape(-1, 3), faces_of_four))


def lumpy_ball(radius: float, levels: int, depth: float = 0.25) -> Mesh:
    """Build a smooth ball with hollows and bumps, which shades itself."""
    ball = icosphere(1.0, levels)
    x, y, z = ball.vertices.T
    swell = 1 + depth * np.sin(4 * x + 1) * np.cos(3 * y) * np.cos(4 * z - 0.5)
    return replace(ball, vertices=radius * swell[:, None] * ball.vertices)


def cylinder(radius: float, height: float, around: int, rows: int) -> Mesh:
    """Build the side of an upright cylinder on z = 0, without caps."""
    u, v = np.meshgrid(np.arange(around), np.arange(rows + 1), indexing="ij")
    phi = 2 * np.pi * u / around
    vertices = np.stack([radius * np.cos(phi), radius * np.sin(phi), height * v / rows], axis=-1)
    i, j = u[:, :-1], v[:, :-1]
    index = [(i + a) % around * (rows + 1) + j + b for a, b in [(0, 0), (1, 0), (1, 1), (0, 1)]]
    return Mesh(vertices.reshape(-1, 3), np.stack(index, axis=-1).reshape(-1, 4))


def moved(mesh: Mesh, by: ArrayLike, *, turn: float = 0.0) -> Mesh:
    """Turn a mesh about the z axis [degrees], then move it [m]."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return replace(mesh, vertices=mesh.vertices @ rotation.T + np.asarray(by, dtype=np.float64))


def tilted(mesh: Mesh, degrees: float) -> Mesh:
    """Turn a mesh about the x axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return replace(mesh, vertices=mesh.vertices @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]))


def flipped(mesh: Mesh) -> Mesh:
    """Turn every face over."""
    triangle = mesh.faces[:, 3] < 0
    faces = mesh.faces[:, ::-1].copy()
    faces[triangle] = mesh.faces[triangle][:, [2, 1, 0, 3]]
    return replace(mesh, faces=faces)


def triangulated(mesh: Mesh) -> Mesh:
    """Split every quad into two triangles."""
    a, b, c, d = mesh.faces.T
    none = np.full_like(a, -1)
    halves = [np.stack([a, b, c, none], axis=1), np.stack([a, c, d, none], axis=1)]
    faces = np.stack(halves, axis=1).reshape(-1, 4)
    return replace(mesh, faces=faces[faces[:, 2] >= 0])


def split(mesh: Mesh, low: ArrayLike, high: ArrayLike) -> tuple[Mesh, Mesh]:
    """Part the faces whose centres lie between two points [m] from the others; both keep the same array of vertices."""
    corners = np.where(mesh.faces[..., None] < 0, np.nan, mesh.vertices[mesh.faces])
    centre = np.nanmean(corners, axis=1)
    inside = ((centre > np.asarray(low)) & (centre < np.asarray(high))).all(axis=1)
    return replace(mesh, faces=mesh.faces[inside]), replace(mesh, faces=mesh.faces[~inside])


def join(*meshes: Mesh) -> Mesh:
    """Put meshes into one, without merging vertices."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    faces = [np.where(mesh.faces < 0, -1, mesh.faces + start) for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def weld(mesh: Mesh, distance: float = 1e-6) -> Mesh:
    """Merge vertices nearer than `distance` [m]."""
    _, first, same = np.unique(np.round(mesh.vertices / distance), axis=0, return_index=True, return_inverse=True)
    same = same.reshape(-1)
    return Mesh(mesh.vertices[first], np.where(mesh.faces < 0, -1, same[mesh.faces]))
