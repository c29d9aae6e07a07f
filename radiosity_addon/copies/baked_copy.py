# SPDX-License-Identifier: GPL-3.0-or-later
"""The baked copy: one new object for each that light falls on, instances included, with the light in its colors.

Originals are not touched. Where patches are finer than faces, the scene is cut finer before it is lit, so that the
corners of the copies are corners of what is computed, and shadows show between far vertices.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ...core.errors import RadiosityError
from ...core.grading import graded
from ...core.progress import Progress
from ...core.refined_scene import refined_scene
from ...core.refinement import Refinement, refine
from ...core.scene import Scene
from ...core.settings import Settings
from ...core.shading import corner_angles, vertex_means
from ..color_attributes import ByteLoss, store_colors
from ..destination import Destination
from ..modes import leave_modes_with_own_undo
from ..objects.remade import Remade, remake
from ..objects.targets import Target, require_receivers
from ..placement import place
from .collection import COPY_OF, originals_shown, replace_copies
from .finer_mesh import finer_mesh
from .look import carry_look
from .losses import left_out_of_copy, make_room
from .parts import Part, split

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

_SUFFIX = " Baked"


@dataclass(frozen=True, eq=False)
class CopyPlan:
    """Which objects get copies, and how fine these are.

    Attributes
    ----------
    destination : Destination
    targets : tuple of Target
        What gets a copy.
    scene : core.scene.Scene
        What is to be lit: `read`, cut finer where patches are finer than faces.
    read : core.scene.Scene
    fine : Refinement or None
        What of the scene that was read it is made of; None where it is the same.
    scene_name, layer_name : str
        Of the Blender scene and the view layer that get the copies.
    warnings : tuple of str
        What gets no copy.
    """

    destination: Destination
    targets: tuple[Target, ...]
    scene: Scene
    read: Scene
    fine: Refinement | None
    scene_name: str
    layer_name: str
    warnings: tuple[str, ...]


def plan_copies(
    scene: Scene, targets: tuple[Target, ...], destination: Destination, layer: bpy.types.ViewLayer
) -> CopyPlan:
    """Decide what gets copies, as fine as the scene is.

    Parameters
    ----------
    scene : core.scene.Scene
        That was read.
    targets : tuple of Target
        Its objects.
    destination : Destination
    layer : bpy.types.ViewLayer
        That was read.

    Returns
    -------
    CopyPlan

    Raises
    ------
    RadiosityError
        When nothing wants colors.
    """
    require_receivers(targets)
    wanted = tuple(target for target in targets if target.receives)
    return CopyPlan(destination, wanted, scene, scene, None, layer.id_data.name, layer.name, ())


def cut_finer(plan: CopyPlan, settings: Settings) -> Generator[Progress, None, CopyPlan]:
    """Cut the scene of a plan as fine as its patches.

    Parameters
    ----------
    plan : CopyPlan
    settings : core.settings.Settings
        Give the size of patches; where they give none, the light decides, if large faces are to be cut.

    Yields
    ------
    core.progress.Progress

    Returns
    -------
    CopyPlan

    Raises
    ------
    RadiosityError
        When there would be too many faces.
    """
    chosen, own = settings.max_edge is not None or settings.subdivide > 1, np.isfinite(plan.read.max_edge).any()
    if plan.destination.cut_large and not chosen:
        fine = yield from graded(plan.read, settings)
    else:
        fine = refine(plan.read, settings.max_edge, settings.subdivide) if chosen or own else None
    return plan if fine is None else replace(plan, fine=fine, scene=refined_scene(plan.read, fine))


def write_copies(plan: CopyPlan, corner_radiance: FloatArray) -> list[str]:
    """Make the copies and put them in the place of earlier ones.

    Parameters
    ----------
    plan : CopyPlan
    corner_radiance : ndarray of shape (c, 3)
        Linear radiance at each corner of the plan's scene.

    Returns
    -------
    list of str
        What was lost.

    Raises
    ------
    RadiosityError
        When an object is gone or was edited since it was read; nothing is left behind then, and earlier copies stay.
    """
    layer = _layer(plan)
    leave_modes_with_own_undo()
    layer.update()
    made: list[bpy.types.ID] = []
    loss, notes = ByteLoss(plan.destination), []
    try:
        with originals_shown():
            remade = remake(plan.targets, layer.depsgraph)
        made += [one.mesh for one in remade]
        copies = list(_copies(plan, remade, corner_radiance, loss, notes, made))
    except BaseException:
        bpy.data.batch_remove(made)
        raise
    originals = [target.instancer_name for target in plan.targets] if plan.destination.hide_originals else []
    notes += replace_copies(layer.id_data, layer, copies, originals)
    # Only now, when the names of earlier copies are free; without the library that an original is from.
    names = {obj.name_full: obj.name for obj in bpy.data.objects}
    for target, copy in zip(plan.targets, copies, strict=True):
        copy.name = copy.data.name = names.get(target.object_name, target.object_name) + _SUFFIX
    bpy.data.batch_remove([one.mesh for one in remade if one.mesh.users == 0])
    return notes + loss.warnings()


def _layer(plan: CopyPlan) -> bpy.types.ViewLayer:
    """Return the view layer of a plan."""
    scene = bpy.data.scenes.get(plan.scene_name)
    layer = scene.view_layers.get(plan.layer_name) if scene is not None else None
    if layer is None:
        raise RadiosityError(
            f"Scene '{plan.scene_name}' or its view layer '{plan.layer_name}' was renamed or removed during the bake, "
            "nothing was written: bake again"
        )
    return layer


def _copies(
    plan: CopyPlan,
    remade: list[Remade],
    corner_radiance: FloatArray,
    loss: ByteLoss,
    notes: list[str],
    made: list[bpy.types.ID],
) -> Iterator[bpy.types.Object]:
    """Make the copies; whatever is made is added to `made`."""
    weight = corner_angles(plan.scene) if plan.destination.domain == 'POINT' else None
    parts = split(plan.targets, plan.read, plan.fine) if plan.fine is not None else _whole(plan.targets)
    originals = {obj.name_full: obj for obj in bpy.data.objects}
    for one, part in zip(remade, parts, strict=True):
        target, mesh = one.target, one.mesh
        corner, corner_vertex = target.evaluated_corner, target.evaluated.corner_vertex
        if part is not None and part.whole:
            corner = part.scene_corner
        elif part is not None:
            mesh = finer_mesh(one.mesh, part, one.mesh.name)
            made.append(mesh)
            notes += left_out_of_copy(one.mesh, target)
            corner, corner_vertex = part.scene_corner, part.corner_vertex
        copy = bpy.data.objects.new(one.mesh.name, mesh)
        made.append(copy)
        carry_look(copy, originals[target.object_name])
        copy[COPY_OF] = target.object_name
        notes += make_room(copy, target, plan.destination.attribute)
        colors = corner_radiance[corner]
        if weight is not None:
            colors = vertex_means(colors, weight[corner], corner_vertex, len(mesh.vertices))
        store_colors(mesh, plan.destination, colors)
        loss.add(colors)
        place(copy, Matrix(one.matrix.tolist()))
        yield copy


def _whole(targets: tuple[Target, ...]) -> Iterator[Part | None]:
    """Yield that no mesh is cut."""
    for _ in targets:
        yield None
