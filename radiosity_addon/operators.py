# SPDX-License-Identifier: GPL-3.0-or-later
"""The Bake button: the whole bake at once for scripts, in small steps with progress and Esc for people."""

import json
import time
from collections.abc import Generator
from typing import Any

import bpy

from ..core.errors import RadiosityError
from ..core.progress import Progress, exhaust
from .baking import SceneBake, bake_scene
from .properties import chosen_destination, core_settings
from .wording import NOT_CONVERGED, counted, gathered

TICK = 0.02  # seconds between two turns of a running bake
BUDGET = 0.1  # seconds that a turn may take before the window gets its turn
MOST_REPORTS = 10  # warnings that are shown as messages


class RADIOSITY_OT_bake(bpy.types.Operator):
    """Compute the light between all surfaces of the scene and store it as colors on their meshes"""

    bl_idname = "radiosity.bake"
    bl_label = "Bake Radiosity"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if getattr(context, "scene", None) is None:
            cls.poll_message_set("There is no scene to bake")
            return False
        if context.window_manager.radiosity.running:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            done = exhaust(start_bake(context))
        except RadiosityError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        self._show(context, done)
        return {'FINISHED'}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if bpy.app.background or context.window is None:
            return self.execute(context)
        try:
            self._steps = start_bake(context)
            # The first step reads the scene, while what it was handed is sure to be alive.
            progress = next(self._steps)
        except RadiosityError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        wm = context.window_manager
        wm.radiosity.running = True
        wm.progress_begin(0.0, 1.0)
        self._timer = wm.event_timer_add(TICK, window=context.window)
        wm.modal_handler_add(self)
        # Workspaces whose status bar has told of the bake: the user may go from one to another meanwhile.
        self._told: set[str] = set()
        self._tell(context, progress)
        return {'RUNNING_MODAL'}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == 'ESC' and event.value == 'PRESS':
            self.cancel(context)
            self.report({'INFO'}, "Bake cancelled; nothing was changed")
            return {'CANCELLED'}
        return self._turn(context) if event.type == 'TIMER' else {'PASS_THROUGH'}

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop a running bake and clear its traces; Blender calls this too, when another file is loaded."""
        self._steps.close()
        wm = context.window_manager
        wm.event_timer_remove(self._timer)
        wm.radiosity.running = False
        wm.progress_end()
        for name in self._told:
            if name in bpy.data.workspaces:
                bpy.data.workspaces[name].status_text_set(None)
        _redraw(wm)

    def _turn(self, context: bpy.types.Context) -> set[str]:
        """Go on with the bake for a moment."""
        until = time.perf_counter() + BUDGET
        try:
            progress = next(self._steps)
            while time.perf_counter() < until:
                progress = next(self._steps)
        except StopIteration as end:
            self.cancel(context)
            self._show(context, end.value)
            return {'FINISHED'}
        except RadiosityError as error:
            self.cancel(context)
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        except BaseException:
            # A fault of ours: Blender shows its traceback, but the window must not stay as if the bake ran on.
            self.cancel(context)
            raise
        self._tell(context, progress)
        return {'PASS_THROUGH'}

    def _tell(self, context: bpy.types.Context, progress: Progress) -> None:
        wm = context.window_manager
        wm.radiosity.stage = progress.stage
        wm.radiosity.fraction = progress.fraction
        wm.progress_update(progress.fraction)
        sweep = f", iteration {progress.iteration}" if progress.iteration else ""
        self._told.add(context.workspace.name)
        context.workspace.status_text_set(f"Radiosity: {progress.stage} {progress.fraction:.0%}{sweep}    Esc: Cancel")
        _redraw(wm)

    def _show(self, context: bpy.types.Context, done: SceneBake) -> None:
        """Report the figures, keep them for the panel, and show the colors where the button was pressed."""
        status = context.window_manager.radiosity
        status.figures = json.dumps(figures(done.report))
        status.warnings = "\n".join(done.report["warnings"])
        warnings = gathered(done.report["warnings"])
        status.gathered = "\n".join(warnings)
        for warning in warnings[:MOST_REPORTS]:
            self.report({'WARNING'}, warning)
        if len(warnings) > MOST_REPORTS:
            self.report({'WARNING'}, f"{len(warnings) - MOST_REPORTS} more kinds of warnings: see the Radiosity panel")
        # The last one is what the status bar shows.
        self.report({'INFO' if done.report["converged"] else 'WARNING'}, sentence(done.report))
        space = getattr(context, "space_data", None)
        if space is not None and space.type == 'VIEW_3D':
            space.shading.color_type = 'VERTEX'
            space.shading.light = 'FLAT'  # the colors are the light; a second one on top would falsify them


class RADIOSITY_OT_copy_warnings(bpy.types.Operator):
    """Copy all warnings of the last bake to the clipboard, one in each line"""

    bl_idname = "radiosity.copy_warnings"
    bl_label = "Copy Warnings"
    bl_options = {'INTERNAL'}

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.clipboard = context.window_manager.radiosity.warnings
        return {'FINISHED'}


def start_bake(context: bpy.types.Context) -> Generator[Progress, None, SceneBake]:
    """Begin the bake of the context's scene with the scene's own settings; nothing runs before the first step."""
    scene = context.scene
    return bake_scene(
        scene,
        context.view_layer,
        context.evaluated_depsgraph_get(),
        core_settings(scene),
        chosen_destination(scene),
    )


def sentence(report: dict[str, Any]) -> str:
    """Sum up a bake in one line."""
    written = sum(item["written"] for item in report["objects"])
    line = f"Baked {counted(written, 'object')}, {report['patches']} patches in {report['seconds']['total']:.1f} s"
    if not report["converged"]:
        line += f", {NOT_CONVERGED}"
    if report["warnings"]:
        line += f"; {counted(len(report['warnings']), 'warning')} in the Radiosity panel"
    return line


def figures(report: dict[str, Any]) -> list[tuple[str, str]]:
    """Return what the panel shows of a bake, as pairs of label and text."""
    rows, energy = report["row_sum"], report["energy"]
    state = "converged" if report["converged"] else NOT_CONVERGED
    islands = [f"{count} {side}" for side, count in report["islands"].items() if count]
    return [
        ("Patches", f"{report['patches']}"),
        ("Time", f"{report['seconds']['total']:.2f} s"),
        ("Iterations", f"{report['iterations']}, {state}"),
        ("Lit Islands", ", ".join(islands)),
        ("Row Sums", f"{rows['min']:.3f} to {rows['max']:.3f}"),
        ("Row Sum Mean", f"{rows['mean']:.4f}"),
        ("Energy Error", f"{energy['error']:.2%}"),
    ]


def _redraw(wm: bpy.types.WindowManager) -> None:
    """Draw the sidebars again, where the progress bar is; the views beside them would cost far more."""
    for window in wm.windows:
        for area in window.screen.areas:
            if area.type != 'VIEW_3D':
                continue
            for region in area.regions:
                if region.type == 'UI':
                    region.tag_redraw()


register, unregister = bpy.utils.register_classes_factory((RADIOSITY_OT_bake, RADIOSITY_OT_copy_warnings))
