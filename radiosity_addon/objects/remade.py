# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of what was lit, made anew: with modifiers applied, of curves and of instances, each with its place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.errors import RadiosityError
from ..face_surfaces import slot_materials
from .evaluation import Evaluation, evaluation
from .instances import has_own_mesh, instance_number
from .meshes import column, topology
from .targets import Target

if TYPE_CHECKING:
    from numpy.typing import NDArray

Key = tuple[str, str, tuple[int, ...]]


@dataclass(frozen=True, eq=False)
class Remade:
    """A mesh like the one that a target was lit as.

    Attributes
    ----------
    target : Target
    mesh : bpy.types.Mesh
        Of its own, without users; its corners are those of `Target.evaluated`, its materials are what shows.
    matrix : ndarray of shape (4, 4)
        Its space to world space [Blender units].
    """

    target: Target
    mesh: bpy.types.Mesh
    matrix: NDArray[np.float64]


def remake(targets: Iterable[Target], depsgraph: bpy.types.Depsgraph) -> list[Remade]:
    """Make the meshes of targets once more.

    Parameters
    ----------
    targets : iterable of Target
    depsgraph : bpy.types.Depsgraph
        The evaluated state, now, of the view layer that they were read from.

    Returns
    -------
    list of Remade
        In the order of the targets.

    Raises
    ------
    RadiosityError
        When one of them is gone or was changed since it was read; no mesh is left behind then.
    """
    wanted = {_key(target): target for target in targets}
    found: dict[Key, Remade] = {}
    try:
        with evaluation(depsgraph) as state:
            _objects(wanted, state, found)
            _instances(wanted, state, found)
        for key, target in wanted.items():
            same = key in found and topology(found[key].mesh).same(target.evaluated)
            if not same:
                raise RadiosityError(
                    f"Object '{target.name}' was edited or removed during the bake, nothing was written: bake again"
                )
    except BaseException:
        bpy.data.batch_remove([remade.mesh for remade in found.values()])
        raise
    return [found[key] for key in wanted]


def _key(target: Target) -> Key:
    return target.instancer_name, target.object_name, target.instance


def _objects(wanted: dict[Key, Target], state: Evaluation, found: dict[Key, Remade]) -> None:
    """Make the meshes of objects."""
    objects = {obj.name_full: obj for obj in bpy.data.objects}
    for key, target in wanted.items():
        if not target.instance and target.object_name in objects:
            obj = objects[target.object_name]
            mesh = _new_mesh(*state.whole(obj))
            found[key] = Remade(target, mesh, state.matrix(obj))


def _instances(wanted: dict[Key, Target], state: Evaluation, found: dict[Key, Remade]) -> None:
    """Make the meshes of instances."""
    if not any(target.instance for target in wanted.values()):
        return
    for instance, depsgraph in state.instances():
        parent, original = state.original(instance.parent), state.original(instance.object)
        key = parent.name_full, original.name_full, instance_number(instance)
        if instance.object.type == 'MESH' and key in wanted:
            mesh = _new_mesh(instance.object, depsgraph)
            found[key] = Remade(wanted[key], mesh, np.array(instance.matrix_world, dtype=float))


def _new_mesh(evaluated: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    """Return a mesh of what an evaluated object or an instance is, with the materials that show on it."""
    if has_own_mesh(evaluated, depsgraph):
        whole = evaluated.original.evaluated_get(depsgraph)
        mesh = bpy.data.meshes.new_from_object(whole, preserve_all_data_layers=True, depsgraph=depsgraph)
    else:
        # An instance of what nodes made: asking the object would give its own mesh, and crashes Blender 4.2.
        mesh = evaluated.data.copy()
    materials = [material and material.original for material in slot_materials(mesh, evaluated)]
    if [material and material.name_full for material in mesh.materials] != [m and m.name_full for m in materials]:
        # Changing the list of slots sets every face to the first.
        slot = column(mesh.polygons, "material_index", 1, np.int32)
        mesh.materials.clear()
        for material in materials:
            mesh.materials.append(material)
        mesh.polygons.foreach_set("material_index", slot)
    return mesh
