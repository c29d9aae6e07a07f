# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors into Blender: a color attribute on every mesh, all of them or none.

Everything that can go wrong is looked for before the first mesh is touched.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.errors import RadiosityError
from ..core.scene import Scene
from ..core.shading import corner_angles, vertex_means
from .color_attributes import ByteLoss, store_colors
from .destination import Destination
from .modes import leave_modes_with_own_undo
from .objects.corner_maps import Carried
from .objects.targets import Target, require_receivers, stored_in_place

if TYPE_CHECKING:
    FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Plan:
    """Who gets colors.

    Attributes
    ----------
    destination : Destination
        The attribute.
    targets : tuple of Target
        What is written, each mesh once.
    warnings : tuple of str
        What is not written, and why.
    """

    destination: Destination
    targets: tuple[Target, ...]
    warnings: tuple[str, ...]


def plan_writing(targets: tuple[Target, ...], destination: Destination) -> Plan:
    """Decide which meshes get the attribute, before anything is computed.

    Parameters
    ----------
    targets : tuple of Target
        The meshes that were read.
    destination : Destination
        The attribute to write.

    Returns
    -------
    Plan
        Meshes that cannot be written are left out with a warning, and so are all objects but the first of those
        that share a mesh.

    Raises
    ------
    RadiosityError
        When no mesh can be written, or nothing receives light.
    """
    require_receivers(targets)
    meshes, groups = _meshes_by_uid(), _vertex_groups()
    writable: list[Target] = []
    in_place, warnings = stored_in_place(targets)
    users: dict[int, list[str]] = {}
    for target in in_place:
        users.setdefault(target.mesh_uid, []).append(target.object_name)
        if len(users[target.mesh_uid]) > 1:
            continue
        obstacle = _obstacle(meshes[target.mesh_uid], target, destination.attribute, groups)
        if obstacle is None:
            writable.append(target)
        else:
            warnings.append(obstacle)
    if not writable:
        raise RadiosityError(f"No mesh can take the colors: {warnings[0] if warnings else 'there is none'}")
    for target in writable:
        names = users[target.mesh_uid]
        if len(names) > 1:
            shown = ", ".join(f"'{name}'" for name in names[1:4]) + (", …" if len(names) > 4 else "")
            warnings.append(
                f"Mesh '{target.mesh_name}' is shared by {len(names)} objects and gets the colors of "
                f"'{names[0]}', not of {shown}; make them single-user to light each"
            )
    return Plan(destination, tuple(writable), tuple(warnings))


def write_attribute(plan: Plan, scene: Scene, corner_radiance: FloatArray) -> list[str]:
    """Store the colors on all meshes of a plan and make the attribute active for display and render.

    Parameters
    ----------
    plan : Plan
        What goes where.
    scene : core.scene.Scene
        The scene that was lit.
    corner_radiance : ndarray of shape (c, 3)
        Linear radiance at each corner of `scene`; stored with alpha 1.

    Returns
    -------
    list of str
        What was lost.

    Raises
    ------
    RadiosityError
        When a mesh is gone or was edited since it was read; no mesh has been touched then.
    """
    for obj in bpy.data.objects:
        if obj.type == 'MESH' and obj.mode == 'EDIT':
            obj.update_from_editmode()
    meshes, groups = _meshes_by_uid(), _vertex_groups()
    for target in plan.targets:
        _check_unchanged(meshes.get(target.mesh_uid), target)
        obstacle = _obstacle(meshes[target.mesh_uid], target, plan.destination.attribute, groups)
        if obstacle is not None:
            raise RadiosityError(f"{obstacle}; nothing was written")
    leave_modes_with_own_undo()
    weight = corner_angles(scene) if plan.destination.domain == 'POINT' else None
    loss = ByteLoss(plan.destination)
    for target in plan.targets:
        colors = corner_radiance[target.scene_corner]
        if weight is not None:
            colors = vertex_means(colors, weight[target.scene_corner], target.corner_vertex, target.vertex_count)
        store_colors(meshes[target.mesh_uid], plan.destination, colors)
        loss.add(colors)
    return loss.warnings() + _taken_away(plan)


def _taken_away(plan: Plan) -> list[str]:
    """Tell whose modifiers leave nothing of the colors, as Remesh does."""
    remade = {target.object_name for target in plan.targets if target.carried is Carried.NEAREST}
    if not remade:
        return []
    depsgraph = bpy.context.evaluated_depsgraph_get()
    shown = {obj.name_full: obj.evaluated_get(depsgraph).data for obj in bpy.data.objects if obj.name_full in remade}
    return [
        f"Object '{name}': its modifiers take colors away again, so none show; choose Baked Copy"
        for name, mesh in sorted(shown.items())
        if isinstance(mesh, bpy.types.Mesh) and plan.destination.attribute not in mesh.attributes
    ]


def _meshes_by_uid() -> dict[int, bpy.types.Mesh]:
    return {mesh.session_uid: mesh for mesh in bpy.data.meshes}


def _vertex_groups() -> dict[str, set[str]]:
    """Return the names of each object's vertex groups."""
    return {obj.name_full: set(obj.vertex_groups.keys()) for obj in bpy.data.objects if obj.type == 'MESH'}


def _obstacle(mesh: bpy.types.Mesh, target: Target, attribute: str, groups: dict[str, set[str]]) -> str | None:
    """Tell why a mesh cannot take the attribute, if so."""
    if not mesh.is_editable:
        return (
            f"Mesh '{target.mesh_name}' of object '{target.object_name}' is linked from a library and gets no colors; "
            "make it local (Object > Relations > Make Local)"
        )
    # The new attribute would get another name.
    taken = attribute in mesh.attributes and attribute not in mesh.color_attributes
    if taken or attribute in groups.get(target.object_name, ()):
        what = "an attribute that is not a color" if taken else "a vertex group"
        return (
            f"Object '{target.object_name}' has {what} named '{attribute}' and gets no colors; choose another name "
            "for them"
        )
    return None


def _check_unchanged(mesh: bpy.types.Mesh | None, target: Target) -> None:
    same = mesh is not None and len(mesh.vertices) == target.vertex_count
    if same:
        corner_vertex = np.zeros(len(mesh.loops), dtype=np.int32)
        mesh.loops.foreach_get("vertex_index", corner_vertex)
        same = np.array_equal(corner_vertex, target.corner_vertex)
    if not same:
        raise RadiosityError(
            f"The mesh of object '{target.object_name}' was edited or removed during the bake, nothing was written: "
            "bake again"
        )
