# SPDX-License-Identifier: GPL-3.0-or-later
"""The modes that objects are in while a bake writes."""

import bpy

# Undo knows the active mesh only in these.
OWN_UNDO = {'EDIT', 'SCULPT', 'TEXTURE_PAINT'}


def leave_modes_with_own_undo() -> None:
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
