# SPDX-License-Identifier: GPL-3.0-or-later
"""The Radiosity tab in the 3D viewport's sidebar."""

import json
import textwrap

import bpy

from .operators import RADIOSITY_OT_bake, RADIOSITY_OT_copy_warnings
from .wording import NOT_CONVERGED, counted

MOST_WARNINGS = 20
LETTER = 6.5  # width of a letter [pixels]


class _Sidebar:
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Radiosity"


class RADIOSITY_PT_bake(_Sidebar, bpy.types.Panel):
    """The button, and what is chosen most often"""

    bl_label = "Radiosity"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings, status = context.scene.radiosity, context.window_manager.radiosity
        if status.running:
            layout.progress(text=f"{status.stage} (Esc: Cancel)", factor=status.fraction, type='BAR')
        else:
            row = layout.row()
            row.scale_y = 1.5
            row.operator(RADIOSITY_OT_bake.bl_idname, text="Bake", icon='LIGHT_SUN')
        column = layout.column()
        column.enabled = not status.running
        if settings.method == 'hierarchical':
            column.prop(settings, "quality")
        column.prop(settings, "max_edge")
        column.prop(settings, "iterations")
        column.prop(settings, "tolerance")


class RADIOSITY_PT_output(_Sidebar, bpy.types.Panel):
    """What the colors tell, and where they go"""

    bl_label = "Output"
    bl_parent_id = "RADIOSITY_PT_bake"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.radiosity
        layout.prop(settings, "light")
        layout.prop(settings, "target")
        if settings.target == 'COPY':
            layout.prop(settings, "hide_originals")
            row = layout.row()
            row.active = settings.max_edge == 0.0 and settings.subdivide == 1
            row.prop(settings, "cut_large")
        layout.prop(settings, "attribute")
        layout.prop(settings, "domain")
        layout.prop(settings, "data_type")


class RADIOSITY_PT_advanced(_Sidebar, bpy.types.Panel):
    """How the light is computed"""

    bl_label = "Advanced"
    bl_parent_id = "RADIOSITY_PT_bake"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.radiosity
        layout.prop(settings, "method")
        row = layout.row()
        row.active = settings.method != 'hierarchical'
        row.prop(settings, "form_factors")
        layout.prop(settings, "sides")
        layout.prop(settings, "subdivide")
        layout.prop(settings, "seed")


class RADIOSITY_PT_last_bake(_Sidebar, bpy.types.Panel):
    """Figures and warnings of the last bake of this session"""

    bl_label = "Last Bake"
    bl_parent_id = "RADIOSITY_PT_bake"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(context.window_manager.radiosity.figures)

    def draw(self, context: bpy.types.Context) -> None:
        status = context.window_manager.radiosity
        column = self.layout.column(align=True)
        for label, text in json.loads(status.figures):
            split = column.split(factor=0.4)
            # What is red is not right yet.
            split.alert = text.endswith(NOT_CONVERGED)
            split.label(text=label)
            split.label(text=text)
        count = len(status.warnings.splitlines())
        if not count:
            return
        row = self.layout.row()
        row.label(text=counted(count, "Warning"), icon='ERROR')
        row.operator(RADIOSITY_OT_copy_warnings.bl_idname, text="", icon='COPYDOWN')
        warnings = status.gathered.splitlines()
        for warning in warnings[:MOST_WARNINGS]:
            column = self.layout.column(align=True)
            for index, line in enumerate(textwrap.wrap(warning, _letters(context))):
                column.label(text=line, icon='BLANK1' if index else 'DOT')
        if len(warnings) > MOST_WARNINGS:
            self.layout.label(text=f"And {len(warnings) - MOST_WARNINGS} more: copy them all")


def _letters(context: bpy.types.Context) -> int:
    """Return how many letters a line beside an icon holds, about."""
    width = context.region.width if context.region else 0
    # Without a window Blender's scale is 0.
    scale = context.preferences.system.ui_scale or 1.0
    return max(int(width / (LETTER * scale)) - 8, 24)


register, unregister = bpy.utils.register_classes_factory(
    (RADIOSITY_PT_bake, RADIOSITY_PT_output, RADIOSITY_PT_advanced, RADIOSITY_PT_last_bake)
)
