# SPDX-License-Identifier: GPL-3.0-or-later
"""What only Blender can evaluate: Cycles bakes diffuse color and emission of a material at points of a mesh.

It does so in a passing scene, on meshes of one small triangle for every three points and with copies of the materials,
so nothing of the user's is touched.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ..quiet import quiet
from .copies import readable_copy
from .points import Layer, Points

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_NAME = "radiosity-surface"
# Triangles that are baked, at most; the others are like the mean of those.
MOST = 300_000
# Colors are not noisy; but textures have edges.
_SAMPLES = 2
_LAYERS = {1: 'FLOAT', 2: 'FLOAT_VECTOR', 3: 'FLOAT_VECTOR', 4: 'FLOAT_COLOR'}


@dataclass(frozen=True, eq=False)
class Job:
    """A material to be baked at points of a mesh.

    Attributes
    ----------
    material : bpy.types.Material
    points : Points
    """

    material: bpy.types.Material
    points: Points


def available() -> bool:
    """Tell whether Cycles is there."""
    return hasattr(bpy.types.Scene, "cycles")


def bake_surfaces(jobs: Sequence[Job]) -> list[tuple[Array, Array]]:
    """Let Cycles read materials.

    Parameters
    ----------
    jobs : sequence of Job

    Returns
    -------
    list of (reflectance, radiance)
        For each job arrays of shape (n, 3), one row for each of its points.

    Raises
    ------
    RuntimeError
        When Cycles fails.
    """
    total = sum(len(job.points.samples.triangle) for job in jobs) // 3
    step = max(1, -(-total // MOST))
    results = []
    with passing_scene() as (scene, made):
        for job in jobs:
            # One at a time: Cycles loads the whole scene anew for each object that it bakes.
            obj = _place(job, step, scene, made)
            cells = len(job.points.samples.triangle) // 3
            pair = []
            for kind, passes in (('DIFFUSE', {'COLOR'}), ('EMIT', set())):
                bake_colors(scene, obj, kind, passes)
                pair.append(_baked(obj, cells, step))
            results.append((pair[0], pair[1]))
            _forget(made)
    return results


@contextmanager
def passing_scene() -> Iterator[tuple[bpy.types.Scene, list[bpy.types.ID]]]:
    """Give an empty scene for Cycles, and a list of what goes when the block ends."""
    frame = bpy.context.scene.frame_current
    scene = bpy.data.scenes.new(_NAME)
    made: list[bpy.types.ID] = []
    try:
        scene.frame_current = frame
        scene.render.engine = 'CYCLES'
        cycles = scene.cycles
        cycles.device = 'CPU'
        cycles.samples, cycles.seed = _SAMPLES, 0
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        yield scene, made
    finally:
        bpy.data.scenes.remove(scene)
        _forget(made)


def _forget(made: list[bpy.types.ID]) -> None:
    bpy.data.batch_remove(made)
    made.clear()


def bake_colors(scene: bpy.types.Scene, obj: bpy.types.Object, kind: str, passes: set[str]) -> None:
    """Let Cycles bake into the active color attribute of an object of a scene."""
    chosen = {
        "scene": scene,
        "view_layer": scene.view_layers[0],
        "object": obj,
        "active_object": obj,
        "selected_objects": [obj],
        "selected_editable_objects": [obj],
    }
    with quiet(), bpy.context.temp_override(**chosen):
        bpy.ops.object.bake(type=kind, pass_filter=passes, target='VERTEX_COLORS', use_clear=False)


def _baked(obj: bpy.types.Object, cells: int, step: int) -> Array:
    """Return what was baked at all points of a job, shape (n, 3)."""
    layer = obj.data.color_attributes[_NAME]
    values = np.zeros(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color", values)
    color = np.nan_to_num(values.reshape(-1, 4)[:, :3].astype(float), posinf=0.0).clip(0.0)
    if step == 1:
        return color
    whole = np.broadcast_to(color.mean(axis=0), (cells, 3, 3)).copy()
    whole[::step] = color.reshape(-1, 3, 3)
    return whole.reshape(-1, 3)


def _place(job: Job, step: int, scene: bpy.types.Scene, made: list[bpy.types.ID]) -> bpy.types.Object:
    """Put an object for one job into the scene."""
    ground, points = job.points.ground, job.points
    here = (np.arange(0, len(points.samples.triangle), 3 * step)[:, None] + np.arange(3)).ravel()
    mesh = bpy.data.meshes.new(_NAME)
    made.append(mesh)
    make_triangles(mesh, points.position[here])
    for name, layer in ground.uv_maps.items():
        target = mesh.uv_layers.new(name=name, do_init=False)
        if target is not None:
            target.uv.foreach_set("vector", ground.at(layer, points.samples)[here].astype(np.float32).ravel())
            target.active_render = name == ground.active_uv
    for name, layer in ground.attributes.items():
        _write(mesh, name, layer, ground.at(layer, points.samples)[here])
    shown = mesh.color_attributes.find(ground.active_color)
    target = mesh.color_attributes.new(_NAME, 'FLOAT_COLOR', 'CORNER')
    mesh.color_attributes.active_color_index = len(mesh.color_attributes) - 1
    mesh.color_attributes.active_color = target
    if shown >= 0:
        mesh.color_attributes.render_color_index = shown
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = ground.space
    mesh.materials.append(readable_copy(job.material, made))
    obj = bpy.data.objects.new(_NAME, mesh)
    made.append(obj)
    obj.matrix_world = Matrix(ground.matrix.tolist())
    obj.color = (*ground.color, 1.0)
    scene.collection.objects.link(obj)
    return obj


def make_triangles(mesh: bpy.types.Mesh, points: Array) -> None:
    """Make a triangle of every three points."""
    count = len(points)
    mesh.vertices.add(count)
    mesh.loops.add(count)
    mesh.polygons.add(count // 3)
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.foreach_set("vertex_index", np.arange(count, dtype=np.int32))
    mesh.polygons.foreach_set("loop_start", np.arange(0, count, 3, dtype=np.int32))
    mesh.update(calc_edges=True)


def _write(mesh: bpy.types.Mesh, name: str, layer: Layer, values: Array) -> None:
    """Give a mesh an attribute at its corners."""
    width = values.shape[1]
    kind = _LAYERS[width]
    if width == 2:
        values = np.column_stack([values, np.zeros(len(values))])
    prop = {'FLOAT': "value", 'FLOAT_VECTOR': "vector", 'FLOAT_COLOR': "color"}[kind]
    if name in mesh.attributes:
        return
    target = mesh.attributes.new(name, kind, 'CORNER')
    target.data.foreach_set(prop, values.astype(np.float32).ravel())
