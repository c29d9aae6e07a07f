# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluated state of all that renders, also of what viewports do not show and Blender therefore leaves alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..rendered import enabled_objects

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Modifiers that make instances.
_INSTANCING = {'NODES', 'PARTICLE_SYSTEM'}
_SIMPLIFY = ("use_simplify", "simplify_subdivision", "simplify_child_particles")

Copies = dict[str, tuple[bpy.types.Object, bpy.types.Object]]


class Evaluation:
    """Objects and instances as they look with modifiers, constraints and parents.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Of the view layer.
    copies : dict
        Hidden objects and their copies that are shown in their place, by the full name of the former.
    hidden : bpy.types.Depsgraph, optional
        In which the copies are evaluated.
    """

    def __init__(
        self,
        depsgraph: bpy.types.Depsgraph,
        copies: Copies,
        hidden: bpy.types.Depsgraph | None = None,
    ) -> None:
        self.depsgraph = depsgraph
        self._copies, self._hidden = copies, hidden
        self._originals = {copy.name_full: obj for obj, copy in copies.values()}

    def evaluated(self, obj: bpy.types.Object) -> bpy.types.Object:
        """Return an object's evaluated state."""
        _, copy = self._copies.get(obj.name_full, (obj, None))
        return obj.evaluated_get(self.depsgraph) if copy is None else copy.evaluated_get(self._hidden)

    def whole(self, obj: bpy.types.Object) -> tuple[bpy.types.Object, bpy.types.Depsgraph]:
        """Return an object's evaluated state with the depsgraph that it is of."""
        return self.evaluated(obj), self._hidden if obj.name_full in self._copies else self.depsgraph

    def matrix(self, obj: bpy.types.Object) -> NDArray[np.float64]:
        """Return object space to world space as an array of shape (4, 4)."""
        return np.array(self.evaluated(obj).matrix_world, dtype=float)

    def original(self, evaluated: bpy.types.Object) -> bpy.types.Object:
        """Return the object of the file that an evaluated one comes from."""
        found = evaluated.original
        return self._originals.get(found.name_full, found)

    def instances(self) -> Iterator[tuple[bpy.types.DepsgraphObjectInstance, bpy.types.Depsgraph]]:
        """Yield all instances with the depsgraph that they are of; each is valid until the next one only."""
        for depsgraph in (self.depsgraph, self._hidden):
            for instance in depsgraph.object_instances if depsgraph is not None else ():
                # What is shown by a copy is not shown once more.
                if instance.is_instance and instance.parent.original.name_full not in self._copies:
                    yield instance, depsgraph


@contextmanager
def evaluation(depsgraph: bpy.types.Depsgraph) -> Iterator[Evaluation]:
    """Give the evaluated state of a view layer, for as long as the block runs.

    What viewports do not show is copied into a scene of its own, which is gone afterwards, and evaluated there,
    without a change to the scene of the user.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Of the view layer.

    Yields
    ------
    Evaluation
    """
    layer = depsgraph.view_layer
    hidden = [obj for obj in enabled_objects(layer) if _unknown(obj, depsgraph, layer)]
    if not hidden:
        yield Evaluation(depsgraph, {})
        return
    scene = bpy.data.scenes.new("Radiosity")
    copies: Copies = {}
    try:
        _copy_time(depsgraph.scene, scene)
        for obj in hidden:
            _show_copy(obj, scene, copies, obj.parent)
        layer = scene.view_layers[0]
        layer.update()
        yield Evaluation(depsgraph, copies, layer.depsgraph)
    finally:
        made = list(scene.objects)
        bpy.data.scenes.remove(scene)
        bpy.data.batch_remove(made)


def _unknown(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, layer: bpy.types.ViewLayer) -> bool:
    """Tell whether Blender has not evaluated an object, or does not hand out its instances."""
    if not obj.evaluated_get(depsgraph).is_evaluated:
        return True
    instancer = obj.instance_type != 'NONE' or any(modifier.type in _INSTANCING for modifier in obj.modifiers)
    return instancer and not obj.visible_get(view_layer=layer)


def _copy_time(source: bpy.types.Scene, scene: bpy.types.Scene) -> None:
    """Bring a scene to the same time and the same simplification."""
    scene.render.fps, scene.render.fps_base = source.render.fps, source.render.fps_base
    # Not by `frame_set`, which calls what other add-ons do on a change of frame.
    scene.frame_float = source.frame_float
    for name in _SIMPLIFY:
        setattr(scene.render, name, getattr(source.render, name))


def _show_copy(
    obj: bpy.types.Object,
    scene: bpy.types.Scene,
    copies: Copies,
    parent: bpy.types.Object | None,
) -> None:
    """Put a copy of an object into a scene, with those of its children that it makes instances of."""
    if obj.name_full in copies:
        return
    copy = obj.copy()
    copy.hide_viewport = False
    if copy.parent != parent:
        copy.parent = parent
    scene.collection.objects.link(copy)
    copies[obj.name_full] = obj, copy
    if obj.instance_type in {'VERTS', 'FACES'}:
        for child in obj.children_recursive:
            _, above = copies.get(child.parent.name_full, (None, child.parent))
            _show_copy(child, scene, copies, above)
