# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole bake of a Blender scene: read it, compute its light, write the colors; the button and the command run this.

Everything is computed before anything is written, so that closing the generator (cancel) or an error changes nothing.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core import bake as core_bake
from ..core.attendance import attended
from ..core.errors import RadiosityError
from ..core.progress import Progress
from ..core.report import scene_counts
from ..core.scene import Scene
from ..core.settings import Settings
from .attribute_writer import Plan, plan_writing, write_attribute
from .copies.baked_copy import CopyPlan, cut_finer, plan_copies, write_copies
from .copies.collection import earlier_copies, originals_shown
from .destination import COPY, Destination
from .scene_reader import Reading, read_scene

if TYPE_CHECKING:
    import bpy

# Radiance that shows as black, or nearly so.
FAINT = 1e-3


@dataclass(frozen=True, eq=False)
class SceneBake:
    """What a bake leaves behind besides the attribute on the meshes.

    Attributes
    ----------
    report : dict
        The figures of the bake: those of `core.report.Report`, and what only the add-on knows.
    bake : core.bake.Bake
        The solution: patches, their radiosity, the radiance at every corner of `scene`.
    """

    report: dict[str, Any]
    bake: core_bake.Bake


def bake_scene(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    depsgraph: bpy.types.Depsgraph,
    settings: Settings,
    destination: Destination,
) -> Generator[Progress, None, SceneBake]:
    """Bake the light of a scene into a color attribute on its meshes.

    Parameters
    ----------
    scene : bpy.types.Scene
        The scene to light.
    view_layer : bpy.types.ViewLayer
        Its objects that are visible in renders give, block and receive light.
    depsgraph : bpy.types.Depsgraph
        The evaluated state of `view_layer`.
    settings : core.settings.Settings
        How the light is computed.
    destination : Destination
        Where the colors go.

    Yields
    ------
    core.progress.Progress
        What is being done; closing the generator cancels, and leaves the scene as it was.

    Returns
    -------
    SceneBake
        The report and the solution.

    Raises
    ------
    RadiosityError
        When the scene or a setting cannot be baked; nothing has been written then.
    """
    started = time.perf_counter()
    with originals_shown():
        reading = read_scene(scene, view_layer, depsgraph)
    _require_light(reading.scene)
    plan: Plan | CopyPlan
    if destination.target == COPY:
        plan = plan_copies(reading.scene, reading.targets, destination, view_layer)
    else:
        plan = plan_writing(reading.targets, destination)
        plan = replace(plan, warnings=(*plan.warnings, *earlier_copies(scene)))
    seconds_read = time.perf_counter() - started
    # Undo or loading a file frees Blender's data while a modal bake waits: keep none of it between two steps.
    del scene, view_layer, depsgraph
    yield Progress("Reading the scene", 1.0)

    cutting = time.perf_counter()
    if isinstance(plan, CopyPlan):
        plan = yield from attended(cut_finer(plan, settings), "Patches")
    seconds_cut = time.perf_counter() - cutting
    if isinstance(plan, CopyPlan):
        # Its faces are as fine as the patches.
        steps = core_bake.bake(plan.scene, replace(settings, max_edge=None, subdivide=1))
    else:
        steps = core_bake.bake(reading.scene, settings)
    # What is computed knows nothing of Blender's data, and may be computed while windows are drawn.
    bake = yield from attended(steps, "Patches")

    writing = time.perf_counter()
    if isinstance(plan, CopyPlan):
        lost = write_copies(plan, bake.corner_radiance)
    else:
        lost = write_attribute(plan, reading.scene, bake.corner_radiance)
    done = time.perf_counter()
    seconds = {"read": seconds_read, "cut": seconds_cut, "write": done - writing, "total": done - started}
    report = _report(bake, reading, plan, lost, seconds)
    report["settings"] = asdict(settings) | asdict(destination)
    return SceneBake(report, bake)


def _require_light(scene: Scene) -> None:
    """Refuse a scene that would only be black, in the words of Blender's interface."""
    if not scene.lamps and not scene.emission[scene.live & scene.emits].any():
        raise RadiosityError(
            "Nothing that renders emits light: give a material an Emission Strength above 0 (Principled BSDF, "
            "Emission), add a light, or let the world shine"
        )


def _faint(colors: NDArray[np.float64]) -> list[str]:
    """Tell that colors are too dark to be seen."""
    brightest = float(colors.max(initial=0.0))
    if not 0.0 < brightest < FAINT:
        return []
    return [
        f"The light is faint: no color is above {brightest:.2g}, and all of it looks black; raise the strength of "
        "lamps, of emission or of the world (files from before Blender 2.80 may bring lamps of 1 W)"
    ]


def _report(
    bake: core_bake.Bake, reading: Reading, plan: Plan | CopyPlan, lost: list[str], seconds: dict[str, float]
) -> dict[str, Any]:
    """Add to the core's figures what only the add-on knows."""
    report = bake.report.as_dict()
    written = set(map(id, plan.targets))
    report["seconds"] = report["seconds"] | seconds
    report["warnings"] = [*report["warnings"], *_faint(bake.corner_radiance), *plan.warnings, *lost]
    report["scene"] = scene_counts(reading.scene)
    report["objects"] = [
        {
            "name": target.name,
            "corners": len(target.evaluated.corner_vertex),
            "written": id(target) in written,
        }
        for target in reading.targets
    ]
    return report
