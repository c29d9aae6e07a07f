# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes whose materials vary become paint: as many points on each as it deserves, and the materials read at them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.paint.averages import build_paint, corner_values, face_means
from ...core.paint.paint import Paint
from ...core.paint.samples import PaintSamples, paint_samples
from ..wording import last_line
from .cycles_bake import MOST, Job, available, bake_surfaces
from .images import Images
from .points import Ground, Points
from .reading import COLUMNS, Surface, Unreadable, read_material, read_points

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    IntArray = NDArray[np.int64]

# Cells on all surfaces that vary, beside the one that every triangle has, and along an edge of one triangle, at most.
_CELLS = 1 << 16
_ALONG = 64
# Points that are read at a time; a multiple of 3.
_AT_ONCE = 3 << 16


@dataclass(frozen=True, eq=False)
class Painting:
    """A mesh of which some materials vary.

    Attributes
    ----------
    ground : Ground
    varying : dict of int to bpy.types.Material
        These materials by slot.
    plain : ndarray of shape (f, 12)
        The columns of `Surface` for the faces of all other slots.
    """

    ground: Ground
    varying: dict[int, bpy.types.Material]
    plain: Array


def paint_meshes(paintings: Sequence[Painting], notes: list[str]) -> list[tuple[Array, Paint]]:
    """Read the materials of meshes that vary.

    Parameters
    ----------
    paintings : sequence of Painting
    notes : list of str
        What was read otherwise than Blender would render it is added.

    Returns
    -------
    list of (ndarray of shape (f, 12), Paint)
        For each mesh the columns of `Surface` for its faces, and how reflectance and emission vary inside.
    """
    samples = [paint_samples(parts) for parts in _parts(paintings)]
    values = [np.zeros((len(each.triangle), COLUMNS), np.float32) for each in samples]
    told: dict[str, None] = {}
    left = []
    # Material by material, so that few images are held at a time.
    wanted: dict[str, tuple[bpy.types.Material, list[tuple[int, int]]]] = {}
    for number, painting in enumerate(paintings):
        for slot, material in painting.varying.items():
            wanted.setdefault(material.name_full, (material, []))[1].append((number, slot))
    images = Images()
    for material, places in wanted.values():
        for number, slot in places:
            ground = paintings[number].ground
            of_slot = ground.material_index[ground.triangles.face[samples[number].triangle]] == slot
            here = np.flatnonzero(of_slot)
            try:
                values[number][here] = _read(material, ground, _picked(samples[number], here), images, told)
            except Unreadable:
                left.append((material, number, here))
    _bake(left, paintings, samples, values, images, told)
    notes.extend(told)
    return [_painted(*each) for each in zip(paintings, samples, values, strict=True)]


def _read(
    material: bpy.types.Material,
    ground: Ground,
    samples: PaintSamples,
    images: Images,
    told: dict[str, None],
    strict: bool = True,
) -> NDArray[np.float32]:
    """Return the columns of `Surface` at points, shape (s, 15)."""
    parts = [np.zeros((0, COLUMNS), np.float32)]
    for first in range(0, len(samples.triangle), _AT_ONCE):
        part = samples.take(slice(first, first + _AT_ONCE))
        surface = read_points(material, Points(ground, part), images, strict=strict)
        parts.append(surface.columns.astype(np.float32))
        told.update(dict.fromkeys(surface.warnings))
    return np.concatenate(parts)


def _bake(
    left: list[tuple[bpy.types.Material, int, IntArray]],
    paintings: Sequence[Painting],
    samples: list[PaintSamples],
    values: list[NDArray[np.float32]],
    images: Images,
    told: dict[str, None],
) -> None:
    """Let Cycles read what is left."""
    if not left:
        return
    reason = "Cycles, which reads such nodes, is not enabled"
    if available():
        jobs = [Job(m, Points(paintings[n].ground, _picked(samples[n], here))) for m, n, here in left]
        try:
            baked = bake_surfaces(jobs)
        except RuntimeError as error:
            reason = f"Cycles says {last_line(error)}"
        else:
            for (material, number, here), (reflectance, radiance) in zip(left, baked, strict=True):
                values[number][here] = _divided(reflectance, radiance, read_material(material))
            cells = sum(len(here) for _, _, here in left) // 3
            if cells > MOST:
                told[f"Node networks on {cells} triangles are read on {MOST} of them; the others are like the mean"] = (
                    None
                )
            return
    for material, number, here in left:
        told[f"Material '{material.name_full}' is read as a constant: {reason}"] = None
        picked = _picked(samples[number], here)
        values[number][here] = _read(material, paintings[number].ground, picked, images, told, strict=False)


def _divided(scattered: Array, radiance: Array, roughly: Surface) -> Array:
    """Return the columns of `Surface` of what Cycles baked, shape (n, 15); it does not tell what goes through."""
    whole = roughly.reflectance + roughly.transmittance
    beyond = np.divide(roughly.transmittance, whole, out=np.zeros(3), where=whole > 0.0)
    passed, specular = (np.broadcast_to(part, (len(scattered), 3)) for part in (roughly.passed, roughly.specular))
    return np.concatenate([(1.0 - beyond) * scattered, np.pi * radiance, passed, beyond * scattered, specular], axis=1)


def _parts(paintings: Sequence[Painting]) -> list[IntArray]:
    """Return the cells along the edges of every triangle: 0 where nothing varies, more where it is large."""
    areas = []
    for painting in paintings:
        ground = painting.ground
        varies = np.isin(ground.material_index[ground.triangles.face], list(painting.varying))
        # In the world, where all meshes are next to each other.
        with np.errstate(over="ignore", invalid="ignore"):
            world = ground.triangles.points @ ground.matrix[:3, :3].T
            twice = np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0])
            # Triangles whose corners are nowhere, or too far away to multiply, count as points.
            areas.append(np.where(varies, np.nan_to_num(np.linalg.norm(twice, axis=1), posinf=0.0), -1.0))
    total = sum(float(area[area > 0].sum()) for area in areas)
    scale = _CELLS / total if 0.0 < total < np.inf else 0.0
    return [
        np.where(area < 0, 0, np.ceil(np.sqrt(np.maximum(area, 0.0) * scale)).clip(1, _ALONG)).astype(np.int64)
        for area in areas
    ]


def _picked(samples: PaintSamples, here: IntArray) -> PaintSamples:
    return PaintSamples(samples.triangle[here], samples.share[here], samples.parts)


def _painted(painting: Painting, samples: PaintSamples, values: NDArray[np.float32]) -> tuple[Array, Paint]:
    """Return the faces and the paint of one mesh."""
    ground = painting.ground
    faces = len(ground.material_index)
    varies = np.isin(ground.material_index, list(painting.varying))
    mean = np.where(varies[:, None], face_means(samples, values, ground.triangles, faces), painting.plain)
    same = _continued(ground)
    shown = values[:, :6]
    corner = corner_values(samples, shown, ground.triangles, mean[ground.corner_face, :6], same)
    return mean, build_paint(samples, shown, ground.triangles, corner, ground.normal)


def _continued(ground: Ground) -> IntArray:
    """Return a number that corners share where the texture goes on: of one vertex, material and place in the UV map."""
    key = ground.corner_vertex * 64 + ground.material_index[ground.corner_face] % 64
    layer = ground.uv_maps.get(ground.active_uv)
    if layer is not None:
        # Numbers that are equal where coordinates are, and hardly anywhere else.
        u, v = np.round(np.nan_to_num(layer.values.astype(float)).clip(-1e12, 1e12) * 16384.0).astype(np.int64).T
        key = (key * 0x9E3779B1 + u) * 0x85EBCA6B + v
    return np.unique(key, return_inverse=True)[1].reshape(-1)
