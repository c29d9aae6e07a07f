# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces known at many points become means of faces, values around corners, and rasters of large faces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, FloatArray, IntArray
from .paint import Paint
from .samples import PaintSamples

# Columns and rows of a raster, at most.
_MOST_TEXELS = 256


@dataclass(frozen=True, eq=False)
class Triangles:
    """The triangles that the faces of a mesh are cut into, face by face.

    Attributes
    ----------
    points : ndarray of shape (t, 3, 3)
        Their corners [m].
    corner : ndarray of shape (t, 3)
        Which of the mesh's corners these are.
    face : ndarray of shape (t,)
        Ascending.
    """

    points: FloatArray
    corner: IntArray
    face: IntArray

    def area(self) -> FloatArray:
        """Return the areas, shape (t,) [m^2]; 0 where a corner is nowhere."""
        a, b, c = self.points.transpose(1, 0, 2)
        return np.nan_to_num(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), posinf=0.0)


def face_means(samples: PaintSamples, values: NDArray[np.floating], triangles: Triangles, faces: int) -> FloatArray:
    """Return the means of faces.

    Parameters
    ----------
    samples : PaintSamples
    values : ndarray of shape (s, k)
        At the points.
    triangles : Triangles
    faces : int
        How many there are.

    Returns
    -------
    ndarray of shape (faces, k)
        0 for faces without points.
    """
    return _mean(triangles.face[samples.triangle], samples.weights(triangles.area()), values, faces)[0]


def corner_values(
    samples: PaintSamples,
    values: NDArray[np.floating],
    triangles: Triangles,
    instead: FloatArray,
    same: IntArray,
) -> FloatArray:
    """Return what corners of faces look like: the mean of what is around, half way to the next corners.

    Parameters
    ----------
    samples : PaintSamples
    values : ndarray of shape (s, k)
        At the points.
    triangles : Triangles
    instead : ndarray of shape (c, k)
        For corners without points.
    same : ndarray of shape (c,)
        A number that corners share where the surface goes on from one face to the next.

    Returns
    -------
    ndarray of shape (c, k)
        Alike for corners that share a number; but each corner has its own where faces are even and differ, as those of
        a chessboard do.
    """
    weight = samples.weights(triangles.area())
    near = samples.share > 0.5
    around = near.any(axis=1)
    corner = triangles.corner[samples.triangle[around], near[around].argmax(axis=1)]
    own, known = _mean(corner, weight[around], values[around], len(same))
    own[~known] = instead[~known]
    # Every face counts as much, however it is cut into triangles.
    groups = int(np.max(same, initial=-1)) + 1
    joint, joined = _mean(same, known.astype(float), own, groups)
    # How far the faces around a vertex are from even, and from each other.
    face = triangles.face[samples.triangle]
    faces = int(np.max(triangles.face, initial=-1)) + 1
    mean, _ = _mean(face, weight, values, faces)
    spread, _ = _mean(face, weight, (values - mean[face]) ** 2, faces)
    corner_face = np.zeros(len(same), np.int64)
    corner_face[triangles.corner.ravel()] = np.repeat(triangles.face, 3)
    apart = ((own - joint[same]) ** 2).sum(axis=1)
    uneven = spread[corner_face].sum(axis=1)
    smooth = np.bincount(same, known * apart, groups) <= np.bincount(same, known * uneven, groups)
    blend = known & (joined & smooth)[same]
    return np.where(blend[:, None], joint[same], own)


def build_paint(
    samples: PaintSamples,
    values: NDArray[np.floating],
    triangles: Triangles,
    corner: NDArray[np.floating],
    normal: FloatArray,
) -> Paint:
    """Make paint of what is known at points.

    Parameters
    ----------
    samples : PaintSamples
    values : ndarray of shape (s, 6)
        Reflectance, and exitance [W/m^2], at the points.
    triangles : Triangles
    corner : ndarray of shape (c, 6)
        The same around the corners of the mesh.
    normal : ndarray of shape (f, 3)
        Unit normals of the faces.

    Returns
    -------
    Paint
        With a raster for every face of which a triangle has more than one cell.
    """
    raster = np.full(len(normal), -1)
    face = np.unique(triangles.face[samples.parts > 1])
    raster[face] = np.arange(len(face))
    frame, size = _rasters(triangles, samples.parts, raster, normal[face])
    first = np.cumsum(np.append(0, size.prod(axis=1)))

    here = np.flatnonzero(raster[triangles.face[samples.triangle]] >= 0)
    triangle = samples.triangle[here]
    at = raster[triangles.face[triangle]]
    arm = np.einsum("sk,ski->si", samples.share[here], triangles.points[triangle]) - frame[at, 0]
    edges = frame[:, 1:]
    along = np.einsum("si,sei->se", arm, (edges / (edges**2).sum(axis=2, keepdims=True))[at])
    # Of positions that are no numbers, none will do.
    cell = np.clip(np.nan_to_num(along * size[at], posinf=0.0).astype(np.int64), 0, size[at] - 1)
    texel = first[at] + cell[:, 1] * size[at, 0] + cell[:, 0]
    weight = samples.weights(triangles.area())[here]
    mean, _ = _mean(texel, weight, values[here], int(first[-1]))
    held = np.bincount(texel, weight, int(first[-1]))
    single = [np.asarray(v, np.float32) for v in (corner[:, :3], corner[:, 3:], mean[:, :3], mean[:, 3:], held)]
    return Paint(single[0], single[1], face, frame, size, single[2], single[3], single[4])


def _rasters(
    triangles: Triangles, parts: IntArray, raster: IntArray, normal: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Return a rectangle around the triangles of each raster, (t, 3, 3), and its columns and rows, (t, 2)."""
    which = np.flatnonzero(raster[triangles.face] >= 0)
    at = raster[triangles.face[which]]
    begin = np.flatnonzero(np.diff(at, prepend=-1))
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    u = np.cross(axis, normal)
    u /= np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-300)
    v = np.cross(normal, u)
    if not len(which):
        return np.zeros((0, 3, 3)), np.zeros((0, 2), np.int64)
    # As seen from the first corner, so that faces far from the origin keep their digits.
    base = triangles.points[which[begin], 0]
    arm = triangles.points[which] - base[at, None]
    plane: FloatArray = np.stack([np.einsum("tki,ti->tk", arm, side[at]) for side in (u, v)], axis=2)
    low = np.minimum.reduceat(np.min(plane, axis=1), begin, axis=0)
    extent = np.maximum(np.maximum.reduceat(np.max(plane, axis=1), begin, axis=0) - low, 1e-30)
    frame = np.stack([base + low[:, :1] * u + low[:, 1:] * v, extent[:, :1] * u, extent[:, 1:] * v], axis=1)
    # About as many texels on a face as it has cells.
    cells = np.add.reduceat(parts[which].astype(float) ** 2, begin)
    area = np.add.reduceat(triangles.area()[which], begin)
    density = np.sqrt(cells / np.maximum(area, 1e-300))
    return frame, np.nan_to_num(np.clip(np.round(extent * density[:, None]), 1, _MOST_TEXELS), nan=1.0).astype(np.int64)


def _mean(at: IntArray, weight: FloatArray, values: NDArray[np.floating], count: int) -> tuple[FloatArray, BoolArray]:
    """Return weighted means by number, shape (count, k), and which numbers there are."""
    total = np.bincount(at, weight, count)
    known = total > 0
    sums = [np.bincount(at, weight * values[:, k], count) for k in range(values.shape[1])]
    return np.stack(sums, axis=1) / np.where(known, total, 1.0)[:, None], known
