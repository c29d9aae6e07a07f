# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import and Export > Radiosity Scene (.txt)."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..core.errors import RadiosityError
from ..core.scene_text import read_scene_text, write_scene_text
from .outputs import replacing
from .scene_reader import read_scene
from .text_export import rectangles_from_scene
from .text_import import build_objects

UP_ITEMS = (
    ('Z', "Z", "Keep the coordinates as they are"),
    ('Y', "Y", "The file has y upwards, as OpenGL has; turn it for Blender"),
)


class RADIOSITY_OT_import_text(bpy.types.Operator, ImportHelper):
    """Load a radiosity scene of rectangles from a text file"""

    bl_idname = "import_scene.radiosity"
    bl_label = "Import Radiosity Scene"
    bl_options = {'REGISTER', 'UNDO', 'PRESET'}

    filename_ext = ".txt"
    filter_glob: StringProperty(default="*.txt", options={'HIDDEN'})
    subdivide: IntProperty(
        name="Subdivisions",
        description="Multiply the number of patches along each side of every rectangle",
        default=1,
        min=1,
        soft_max=8,
    )
    up: EnumProperty(name="Up Axis", description="Axis of the file that points upwards", items=UP_ITEMS, default='Z')

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = Path(self.filepath)
        try:
            rectangles = read_scene_text(path)
            objects = build_objects(context.scene, rectangles, self.subdivide, name=path.stem, up=self.up)
        except RadiosityError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        self.report({'INFO'}, f"Imported {len(objects)} rectangles from {path.name}")
        return {'FINISHED'}


class RADIOSITY_OT_export_text(bpy.types.Operator, ExportHelper):
    """Save the quads of the scene as a radiosity scene in a text file"""

    bl_idname = "export_scene.radiosity"
    bl_label = "Export Radiosity Scene"
    bl_options = {'PRESET'}

    filename_ext = ".txt"
    filter_glob: StringProperty(default="*.txt", options={'HIDDEN'})
    up: EnumProperty(name="Up Axis", description="Axis of the file that points upwards", items=UP_ITEMS, default='Z')

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = Path(self.filepath)
        try:
            reading = read_scene(context.scene, context.view_layer, context.evaluated_depsgraph_get())
            rectangles, warnings = rectangles_from_scene(reading.scene, self.up)
            with replacing(path) as temporary:
                temporary.write_text(write_scene_text(rectangles), encoding="utf-8")
        except RadiosityError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        for warning in warnings:
            self.report({'WARNING'}, warning)
        self.report({'INFO'}, f"Exported {len(rectangles)} rectangles to {path.name}")
        return {'FINISHED'}


def _draw_import(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.operator(RADIOSITY_OT_import_text.bl_idname, text="Radiosity Scene (.txt)")


def _draw_export(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.operator(RADIOSITY_OT_export_text.bl_idname, text="Radiosity Scene (.txt)")


CLASSES = (RADIOSITY_OT_import_text, RADIOSITY_OT_export_text)


def register() -> None:
    """Add both operators and their menu entries."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_file_import.append(_draw_import)
    bpy.types.TOPBAR_MT_file_export.append(_draw_export)


def unregister() -> None:
    """Take them out again."""
    bpy.types.TOPBAR_MT_file_export.remove(_draw_export)
    bpy.types.TOPBAR_MT_file_import.remove(_draw_import)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
