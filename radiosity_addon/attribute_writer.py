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
from .scene_reader import Target

if TYPE_CHECKING:
    FloatArray = NDArray[np.float64]

DATA_TYPE = 'FLOAT_COLOR'
DOMAINS = ('CORNER', 'POINT')
OWN_UNDO = {'EDIT', 'SCULPT', 'TEXTURE_PAINT'}
LONGEST_NAME = 63  # bytes: what Blender 4.2 keeps of a name


@dataclass(frozen=True, eq=False)
class Plan:
    """Who gets colors.

    Attributes
    ----------
    attribute, domain : str
        The name of the attribute and what carries a color, 'CORNER' or 'POINT'.
    targets : tuple of Target
        What is written, each mesh once.
    warnings : tuple of str
        What is not written, and why.
    """

    attribute: str
    domain: str
    targets: tuple[Target, ...]
    warnings: tuple[str, ...]


def plan_writing(targets: tuple[Target, ...], attribute: str, domain: str) -> Plan:
    """Decide which meshes get the attribute, before anything is computed.

    Parameters
    ----------
    targets : tuple of Target
        The meshes that were read.
    attribute : str
        Name of the color attribute.
    domain : {'CORNER', 'POINT'}
        What carries a color.

    Returns
    -------
    Plan
        Meshes that cannot be written are left out with a warning, and so are all objects but the first of those
        that share a mesh.

    Raises
    ------
    RadiosityError
        When the name or the domain cannot be used, or no mesh can be written.
    """
    if domain not in DOMAINS:
        raise RadiosityError(f"The domain cannot be {domain!r}: give one of {', '.join(DOMAINS)}")
    size = len(attribute.encode())
    if not attribute or size > LONGEST_NAME:
        raise RadiosityError(
            f"The attribute's name has {size} bytes: give one of 1 to {LONGEST_NAME} bytes, such as 'Radiosity'"
        )
    meshes, groups = _meshes_by_uid(), _vertex_groups()
    writable: list[Target] = []
    warnings: list[str] = []
    users: dict[int, list[str]] = {}
    for target in targets:
        users.setdefault(target.mesh_uid, []).append(target.object_name)
        if len(users[target.mesh_uid]) > 1:
            continue
        if not meshes[target.mesh_uid].is_editable:
            warnings.append(
                f"Mesh '{target.mesh_name}' of object '{target.object_name}' is linked from a library and gets no "
                "colors; make it local (Object > Relations > Make Local)"
            )
            continue
        _check_name(meshes[target.mesh_uid], target, attribute, groups)
        writable.append(target)
    if not writable:
        raise RadiosityError("All meshes are linked from a library, so no colors can be stored: make one local first")
    for target in writable:
        names = users[target.mesh_uid]
        if len(names) > 1:
            shown = ", ".join(f"'{name}'" for name in names[1:4]) + (", …" if len(names) > 4 else "")
            warnings.append(
                f"Mesh '{target.mesh_name}' is shared by {len(names)} objects and gets the colors of "
                f"'{names[0]}', not of {shown}; make them single-user to light each"
            )
    return Plan(attribute, domain, tuple(writable), tuple(warnings))


def write_attribute(plan: Plan, scene: Scene, corner_radiance: FloatArray) -> None:
    """Store the colors on all meshes of a plan and make the attribute active for display and render.

    Parameters
    ----------
    plan : Plan
        What goes where.
    scene : core.scene.Scene
        The scene that was lit.
    corner_radiance : ndarray of shape (c, 3)
        Linear radiance at each corner of `scene`; stored with alpha 1.

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
        _check_name(meshes[target.mesh_uid], target, plan.attribute, groups)
    _leave_modes_with_own_undo()
    weight = corner_angles(scene) if plan.domain == 'POINT' else None
    for target in plan.targets:
        colors = corner_radiance[target.scene_corner]
        if weight is not None:
            colors = vertex_means(colors, weight[target.scene_corner], target.corner_vertex, target.vertex_count)
        _store(meshes[target.mesh_uid], plan.attribute, plan.domain, colors)


def corner_angles(scene: Scene) -> FloatArray:
    """Return the angle of the face at each corner of a scene, shape (c,) [rad]; 0 at an edge without length.

    As weights they make a vertex's mean independent of how its faces are cut into triangles.
    """
    corner = np.arange(len(scene.corner_vertex))
    following, previous = corner + 1, corner - 1
    following[scene.face_start[1:] - 1] = scene.face_start[:-1]
    previous[scene.face_start[:-1]] = scene.face_start[1:] - 1
    position = scene.vertices[scene.corner_vertex]
    ahead, behind = position[following] - position, position[previous] - position
    sine = np.linalg.norm(np.cross(ahead, behind), axis=1)
    return np.arctan2(sine, np.einsum("ij,ij->i", ahead, behind))


def vertex_means(colors: FloatArray, weight: FloatArray, corner_vertex: NDArray[np.int64], count: int) -> FloatArray:
    """Average the colors of the corners at each vertex.

    Parameters
    ----------
    colors : ndarray of shape (c, 3)
        One for each corner.
    weight : ndarray of shape (c,)
        Weight of each corner, not negative.
    corner_vertex : ndarray of shape (c,)
        Vertex of each corner.
    count : int
        Number of vertices.

    Returns
    -------
    ndarray of shape (count, 3)
        Black at vertices without faces.
    """
    total = np.bincount(corner_vertex, weight, count)
    # Where all angles are 0 the corners count alike.
    weight = np.where(total[corner_vertex] > 0.0, weight, 1.0)
    total = np.bincount(corner_vertex, weight, count)
    sums = np.stack([np.bincount(corner_vertex, weight * channel, count) for channel in colors.T], axis=1)
    return sums / np.maximum(total, np.finfo(float).tiny)[:, None]


def _meshes_by_uid() -> dict[int, bpy.types.Mesh]:
    return {mesh.session_uid: mesh for mesh in bpy.data.meshes}


def _vertex_groups() -> dict[str, set[str]]:
    """Return the names of each object's vertex groups."""
    return {obj.name_full: set(obj.vertex_groups.keys()) for obj in bpy.data.objects if obj.type == 'MESH'}


def _check_name(mesh: bpy.types.Mesh, target: Target, attribute: str, groups: dict[str, set[str]]) -> None:
    """Refuse a name that is taken by something that is no color: the new attribute would get another one."""
    taken = attribute in mesh.attributes and attribute not in mesh.color_attributes
    if taken or attribute in groups.get(target.object_name, ()):
        what = "attribute that is not a color" if taken else "vertex group"
        raise RadiosityError(
            f"Object '{target.object_name}' has a {what} named '{attribute}': choose another name for the colors"
        )


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


def _leave_modes_with_own_undo() -> None:
    """Switch to Object Mode from where Undo only knows the active mesh and would not take the colors off the others.

    In Edit Mode, what is written to the mesh would also be lost when editing ends.
    """
    for obj in bpy.data.objects:
        if obj.type == 'MESH' and obj.mode in OWN_UNDO:  # leaving Edit Mode with one object leaves it with all
            with bpy.context.temp_override(object=obj, active_object=obj):
                bpy.ops.object.mode_set(mode='OBJECT')
                # Called from an operator it leaves no step to go back to; without a window there are no steps.
                if bpy.ops.ed.undo_push.poll():
                    bpy.ops.ed.undo_push(message="Object Mode")


def _store(mesh: bpy.types.Mesh, name: str, domain: str, colors: FloatArray) -> None:
    """Get or create the color attribute and fill it."""
    existing = mesh.color_attributes.get(name)
    if existing is not None and (existing.domain, existing.data_type) != (domain, DATA_TYPE):
        mesh.color_attributes.remove(existing)
        existing = None
    layer = existing or mesh.color_attributes.new(name, DATA_TYPE, domain)
    rgba = np.ones((len(colors), 4), dtype=np.float32)
    rgba[:, :3] = colors
    layer.data.foreach_set("color", rgba.ravel())
    mesh.attributes.active_color_name = name
    mesh.attributes.default_color_name = name
    mesh.update()
