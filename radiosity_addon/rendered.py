# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects of a Blender scene a render shows."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from .copies.collection import is_copy


def rendered_objects(view_layer: bpy.types.ViewLayer, *, copies: bool = False) -> list[bpy.types.Object]:
    """Return the objects of a view layer that are visible in renders, each once.

    Parameters
    ----------
    view_layer : bpy.types.ViewLayer
        Its excluded collections are left out, and those disabled in renders with all that is below them.
    copies : bool
        Whether to return the baked copies, and nothing else.

    Returns
    -------
    list of bpy.types.Object
        In the order of the Outliner.
    """
    return [obj for obj in enabled_objects(view_layer, copies=copies) if renders_itself(obj)]


def enabled_objects(view_layer: bpy.types.ViewLayer, *, copies: bool = False) -> list[bpy.types.Object]:
    """Return the objects of a view layer that are enabled in renders, those included of which only instances show.

    Parameters
    ----------
    view_layer : bpy.types.ViewLayer
    copies : bool
        Whether to return the baked copies, which otherwise are no part of what is lit, and nothing else.

    Returns
    -------
    list of bpy.types.Object
        Each once, in the order of the Outliner.
    """

    def visit(layer: bpy.types.LayerCollection) -> Iterator[bpy.types.Object]:
        if layer.collection.hide_render:
            return
        if not layer.exclude:
            yield from layer.collection.objects
        for child in layer.children:
            yield from visit(child)

    found = {obj.name_full: obj for obj in visit(view_layer.layer_collection)}
    return [obj for obj in found.values() if not obj.hide_render and is_copy(obj) == copies]


def renders_itself(obj: bpy.types.Object) -> bool:
    """Tell whether an object that is enabled in renders shows there itself, and not only its instances.

    What is instanced on the vertices or faces of its parent does not; nor do instancers that are told not to.
    """
    if obj.parent is not None and obj.parent.type == 'MESH' and obj.parent.instance_type in {'VERTS', 'FACES'}:
        return False
    instancer = obj.type == 'MESH' and (obj.instance_type != 'NONE' or len(obj.particle_systems) > 0)
    return obj.show_instancer_for_render or not instancer
