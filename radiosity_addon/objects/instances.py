# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances of all kinds: of collections, on vertices and faces, by geometry nodes, by particles; and lamps in them."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..lamps import read_lamp
from ..rendered import renders_itself
from ..wording import listed
from .meshes import LocalMesh, local_mesh
from .roles import Roles, excluded, read_roles
from .surfaces import HAVE_SURFACES, Body, evaluated_mesh

if TYPE_CHECKING:
    from ...core.lighting.lamps import Lamp
    from ..face_surfaces import SurfaceReader
    from ..lamp_pictures import LampPictures
    from .evaluation import Evaluation

# What Blender fills up the number of an instance with.
_UNUSED = 2**31 - 1
# What every instance of a collection shows; metaballs are not among it.
_SEEN = HAVE_SURFACES - {'META'} | {'LIGHT'}


@dataclass(eq=False)
class Instances:
    """What the instances of a scene are.

    Attributes
    ----------
    bodies : dict
        Those with faces, by the full name of the object that makes them.
    lamps : list of Lamp
    """

    bodies: dict[str, list[Body]] = field(default_factory=lambda: defaultdict(list))
    lamps: list[Lamp] = field(default_factory=list)


def read_instances(
    state: Evaluation,
    enabled: Iterable[bpy.types.Object],
    scale: float,
    surfaces: SurfaceReader,
    pictures: LampPictures,
    notes: list[str],
) -> Instances:
    """Read all instances, each mesh once.

    Parameters
    ----------
    state : Evaluation
    enabled : iterable of bpy.types.Object
        The objects whose instances show in renders and are not excluded from bakes.
    scale : float
        Length of a Blender unit [m].
    surfaces : SurfaceReader
        Reads their materials.
    pictures : LampPictures
        Asked for what the nodes of lamps do.
    notes : list of str
        What is left out is added.

    Returns
    -------
    Instances
    """
    reader = _Reader(state, enabled, scale, surfaces, pictures, notes)
    for instance, depsgraph in state.instances():
        reader.add(instance, depsgraph)
    reader.tell_what_is_left_out()
    return reader.found


def instance_number(instance: bpy.types.DepsgraphObjectInstance) -> tuple[int, ...]:
    """Return which one an instance is among those of one object and one instancer, as Blender keeps telling it."""
    return tuple(part for part in instance.persistent_id if part != _UNUSED)


def has_own_mesh(evaluated: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    """Tell whether what an object is shown as, by itself or as an instance, is its own surface, not made by nodes."""
    whole = evaluated.original.evaluated_get(depsgraph)
    if whole.type != evaluated.type:
        return False
    return evaluated.type != 'MESH' or bool(evaluated.data.as_pointer() == whole.data.as_pointer())


class _Reader:
    """Reads one instance after the other; see `read_instances`."""

    def __init__(
        self,
        state: Evaluation,
        enabled: Iterable[bpy.types.Object],
        scale: float,
        surfaces: SurfaceReader,
        pictures: LampPictures,
        notes: list[str],
    ) -> None:
        self.found = Instances()
        self._state, self._scale, self._surfaces, self._notes = state, scale, surfaces, notes
        self._pictures = pictures
        self._shown = {obj.name_full: _Shown(obj) for obj in enabled}
        self._meshes: dict[int, tuple[LocalMesh, int]] = {}
        self._roles: dict[tuple[str, str], Roles | None] = {}
        self._left_out: Counter[str] = Counter()

    def add(self, instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph) -> None:
        """Read one instance, if it shows in renders."""
        source, parent = instance.object, self._state.original(instance.parent)
        original = self._state.original(source)
        shown = self._shown.get(parent.name_full)
        if shown is None:
            return
        number = instance_number(instance)
        # The surface of a text or curve is handed out as an instance of itself; it was read as an object.
        if original == parent and parent.type in HAVE_SURFACES - {'MESH'} and len(number) == 1:
            return
        if original != parent and not shown.shows(original, instance, len(number)):
            return
        roles = self._roles_of(original, parent)
        if roles is None:
            return
        if source.type == 'LIGHT':
            if roles.emits:
                matrix = np.array(instance.matrix_world, dtype=float)
                lamp = read_lamp(original, self._state.depsgraph, matrix, self._scale, self._pictures, self._notes)
                self.found.lamps += [lamp] if lamp is not None else []
        elif source.type == 'MESH':
            mesh, surfaces = self._mesh(source, depsgraph)
            if len(mesh.topology.corner_vertex):
                matrix = np.array(instance.matrix_world, dtype=float)
                body = Body(mesh, surfaces, matrix, roles, None, original.name_full, parent.name_full, number)
                self.found.bodies[parent.name_full].append(body)
        elif source.type not in HAVE_SURFACES | {'EMPTY', 'CAMERA'} or (original.type, source.type) == (
            'MESH',
            'CURVE',
        ):
            self._left_out[parent.name_full] += 1

    def tell_what_is_left_out(self) -> None:
        """Note what has no faces, and what instances the viewport does not have."""
        for name, count in self._left_out.items():
            what = "1 instance is" if count == 1 else f"{count} instances are"
            self._notes.append(f"Object '{name}': {what} curves, points or volumes without faces and left out")
        unseen = [name for shown in self._shown.values() for name in shown.unseen]
        if unseen:
            self._notes.append(f"Instances of {listed(unseen)} are left out, as the viewport does not show them")

    def _roles_of(self, original: bpy.types.Object, parent: bpy.types.Object) -> Roles | None:
        """Return what instances of an object do that another one makes; None where they are excluded."""
        key = (original.name_full, parent.name_full)
        if key not in self._roles:
            self._roles[key] = None if excluded(original) else read_roles(original).within(read_roles(parent))
        return self._roles[key]

    def _mesh(self, source: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple[LocalMesh, int]:
        """Return the mesh of an instance and the number of its surfaces; each is read once."""
        # Evaluated data stays where it is while the depsgraph is not changed.
        key = source.data.as_pointer()
        if key not in self._meshes:
            if has_own_mesh(source, depsgraph):
                with evaluated_mesh(source.original.evaluated_get(depsgraph)) as mesh:
                    self._meshes[key] = local_mesh(mesh), self._surfaces.add(mesh, source)
            else:
                self._meshes[key] = local_mesh(source.data), self._surfaces.add(source.data, source)
        return self._meshes[key]


class _Shown:
    """Which of the instances that an object has in the viewport it has in renders, too."""

    def __init__(self, instancer: bpy.types.Object) -> None:
        self._kind = instancer.instance_type
        self._hidden: set[str] = set()
        # Those that have not come up yet, in order.
        self.unseen: dict[str, None] = {}
        self._known: dict[str, bool] = {}
        if self._kind == 'COLLECTION' and instancer.instance_collection is not None:
            shown, everything = _sources(instancer.instance_collection)
            self._hidden = everything - shown
            objects = {obj.name_full: obj for obj in instancer.instance_collection.all_objects}
            self.unseen = {
                name: None
                for name, obj in objects.items()
                if name in shown and obj.type in _SEEN and renders_itself(obj)
            }

    def shows(self, original: bpy.types.Object, instance: bpy.types.DepsgraphObjectInstance, depth: int) -> bool:
        """Tell whether an instance of an object shows in renders."""
        if self._kind == 'COLLECTION':
            self.unseen.pop(original.name_full, None)
            # What is instanced on its parent shows one level further down only.
            return original.name_full not in self._hidden and (depth > 1 or renders_itself(original))
        if self._kind in {'VERTS', 'FACES'}:
            return not original.hide_render
        if not renders_itself(original):
            return False
        # An object that nodes or particles name shows even if it is disabled in renders, as it mostly is only to be out
        # of the way; one that comes with a collection does not. Those have one number more.
        particles = instance.particle_system
        of_collection = depth > 2 if particles is None else particles.settings.render_type == 'COLLECTION'
        return not (of_collection and self._disabled(original))

    def _disabled(self, original: bpy.types.Object) -> bool:
        """Tell whether an object, or every collection that it is in, is disabled in renders."""
        name = original.name_full
        if name not in self._known:
            # This looks through all collections of the file.
            collections = original.users_collection
            self._known[name] = original.hide_render or all(collection.hide_render for collection in collections)
        return self._known[name]


def _sources(collection: bpy.types.Collection) -> tuple[set[str], set[str]]:
    """Return the full names of the objects that an instance of a collection shows in renders, and of all in it."""
    shown: set[str] = set()
    everything = {obj.name_full for obj in collection.all_objects}
    if collection.hide_render:
        return shown, everything
    for obj in collection.objects:
        nested = obj.instance_collection if obj.instance_type == 'COLLECTION' else None
        below = _sources(nested) if nested is not None else (set(), set())
        everything |= below[1]
        if not obj.hide_render:
            shown |= below[0] | {obj.name_full}
    for child in collection.children:
        below = _sources(child)
        shown, everything = shown | below[0], everything | below[1]
    return shown, everything
