# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects of a Blender scene a render shows, and what of the rest a bake does not know."""

from collections import Counter
from collections.abc import Iterator

import bpy

# What has a surface when rendered but is no mesh.
SURFACE_TYPES = {'CURVE', 'SURFACE', 'META', 'FONT', 'CURVES', 'POINTCLOUD', 'VOLUME'}


def rendered_objects(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """Return the objects of a view layer that are visible in renders, each once.

    Parameters
    ----------
    view_layer : bpy.types.ViewLayer
        Its excluded collections are left out, and those disabled in renders with all that is below them.

    Returns
    -------
    list of bpy.types.Object
        In the order of the Outliner.
    """

    def visit(layer: bpy.types.LayerCollection) -> Iterator[bpy.types.Object]:
        if layer.collection.hide_render:
            return
        if not layer.exclude:
            yield from layer.collection.objects
        for child in layer.children:
            yield from visit(child)

    found = {obj.name_full: obj for obj in visit(view_layer.layer_collection)}
    return [obj for obj in found.values() if _renders_itself(obj)]


def _renders_itself(obj: bpy.types.Object) -> bool:
    instances = obj.instance_type != 'NONE' and obj.type == 'MESH'
    return not obj.hide_render and (obj.show_instancer_for_render or not instances)


def left_out(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Tell what gives light or shade in a render but is no object to be read.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Its instances are.

    Returns
    -------
    list of str
        One line for each thing, with its name.
    """
    notes = []
    copies = Counter(
        instance.object.original.name_full
        for instance in depsgraph.object_instances
        if instance.is_instance and not instance.parent.hide_render and not _own_surface(instance)
    )
    for name, count in copies.items():
        notes.append(
            f"{count} instances of '{name}' are left out; make them real (Object > Apply > Make Instances Real)"
        )
    return notes


def _own_surface(instance: bpy.types.DepsgraphObjectInstance) -> bool:
    """Tell whether this is the surface of a text or curve, which Blender hands out as an instance of itself."""
    original = instance.object.original
    return original.type in SURFACE_TYPES and instance.parent.original == original
