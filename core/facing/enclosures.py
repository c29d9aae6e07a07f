# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed shells: only light that starts in them is inside, whatever rays slip through at edges and poles."""

from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..lighting.lamps import SkyLamp, SunLamp
from ..runs import counted
from ..scene import Scene
from .orientation import Orientation

# Points that are asked for first, and pairs of point and triangle that are looked at together.
_FEW, _PAIRS = 8, 500_000


@dataclass(frozen=True)
class Enclosure:
    """On which sides of a closed shell light starts: where its fronts look, and where its backs do.

    Attributes
    ----------
    front, back : bool
    """

    front: bool
    back: bool


def enclosure(scene: Scene, faces: IntArray, shape: Orientation, starts: FloatArray) -> Enclosure | None:
    """Tell on which sides of a closed shell light starts.

    Parameters
    ----------
    scene : Scene
    faces : ndarray of shape (k,)
        All faces of the shell.
    shape : Orientation
        Of the scene.
    starts : ndarray of shape (n, 3)
        Points just before what emits [m].

    Returns
    -------
    Enclosure or None
        None where the shell is open, emits by itself, or does not block all light.
    """
    if not shape.sealed[faces].all() or not _blocks(scene, faces):
        return None
    triangles = _triangles(scene, faces, shape)
    outside, inside = _starts(scene, triangles, starts)
    corner = triangles - triangles.mean(axis=(0, 1))
    outward = np.einsum("ij,ij->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) > 0
    return Enclosure(outside, inside) if outward else Enclosure(inside, outside)


def keeps_dark(scene: Scene, faces: IntArray, shape: Orientation, starts: FloatArray) -> bool:
    """Tell whether a shell, though nearly closed, has no light in it but what its slits let in; else as `enclosure`."""
    return _blocks(scene, faces) and not _starts(scene, _triangles(scene, faces, shape), starts)[1]


def _blocks(scene: Scene, faces: IntArray) -> bool:
    """Return whether faces block all light and have none of their own."""
    whole = bool((scene.occludes[faces] & scene.shades[faces]).all()) and all(lamp.shadows for lamp in scene.lamps)
    return whole and not scene.emission[faces].any()


def _starts(scene: Scene, triangles: FloatArray, starts: FloatArray) -> tuple[bool, bool]:
    """Return whether light starts outside a shell, and whether any does inside."""
    far = [lamp for lamp in scene.lamps if isinstance(lamp, SunLamp | SkyLamp)]
    near = [lamp.centre for lamp in scene.lamps if not isinstance(lamp, SunLamp | SkyLamp)]
    points = np.concatenate([np.reshape(near, (-1, 3)), starts])
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    around = ((points >= low) & (points <= high)).all(axis=1)
    outside, inside = bool(far) or not around.all(), False
    points = points[around]
    step, first = _FEW, 0
    # Until both are found; a few points are most often enough.
    while first < len(points) and not (inside and outside):
        within = _within(points[first : first + step], triangles)
        inside, outside = inside or bool(within.any()), outside or not within.all()
        first, step = first + step, max(1, _PAIRS // len(triangles))
    return outside, inside


def _triangles(scene: Scene, faces: IntArray, shape: Orientation) -> FloatArray:
    """Return fans over faces, all turned the same way, shape (t, 3, 3) [m]; where one folds, its signs cancel."""
    start, size = scene.face_start[faces], np.diff(scene.face_start)[faces]
    owner, step = counted(np.maximum(size - 2, 0))
    step = step + 1
    corner = start[owner, None] + np.stack([np.zeros_like(step), step, step + 1], axis=1)
    back = shape.turned[faces][owner]
    corner[back] = corner[back][:, ::-1]
    return np.asarray(scene.vertices[scene.corner_vertex[corner]])


def _within(points: FloatArray, triangles: FloatArray) -> BoolArray:
    """Return which points a closed shell goes round, by the solid angles of its triangles (Van Oosterom, Strackee)."""
    a, b, c = (triangles[None, :, k] - points[:, None] for k in range(3))
    p, q, r = (np.linalg.norm(way, axis=2) for way in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=2)
    cosine = p * q * r + (a * b).sum(axis=2) * r + (b * c).sum(axis=2) * p + (c * a).sum(axis=2) * q
    turns = np.arctan2(volume, cosine).sum(axis=1) / (2.0 * np.pi)
    return np.asarray(np.abs(turns) > 0.5)
