# SPDX-License-Identifier: GPL-3.0-or-later
"""What a single object does in a bake: in the properties editor, and in the sidebar for the active object."""

import bpy

from .objects.surfaces import HAVE_SURFACES


class _Switches:
    bl_label = "Radiosity"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = getattr(context, "object", None)
        return obj is not None and (obj.type in HAVE_SURFACES or obj.type in {'LIGHT', 'EMPTY'})

    def draw(self, context: bpy.types.Context) -> None:
        obj, layout = context.object, self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(obj.radiosity, "exclude")
        column = layout.column(heading="Light")
        column.active = not obj.radiosity.exclude
        if obj.type == 'LIGHT':
            column.prop(obj.radiosity, "emit")
            return
        for name in ("receive", "occlude", "reflect", "emit", "max_edge"):
            column.prop(obj.radiosity, name)


class RADIOSITY_PT_object(_Switches, bpy.types.Panel):
    """What this object does in a bake"""

    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "object"
    bl_options = {'DEFAULT_CLOSED'}


class RADIOSITY_PT_active_object(_Switches, bpy.types.Panel):
    """What the active object does in a bake"""

    bl_label = "Active Object"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Radiosity"
    bl_parent_id = "RADIOSITY_PT_bake"
    bl_options = {'DEFAULT_CLOSED'}


register, unregister = bpy.utils.register_classes_factory((RADIOSITY_PT_object, RADIOSITY_PT_active_object))
