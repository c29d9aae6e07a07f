# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole bake of a Blender scene: read it, compute its light, write the colors; the button and the command run this.

Everything is computed before anything is written, so that closing the generator (cancel) or an error changes nothing.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..core import bake as core_bake
from ..core.progress import Progress
from ..core.settings import Settings
from .attribute_writer import check_attribute, check_targets, write_attribute
from .scene_reader import read_scene

if TYPE_CHECKING:
    import bpy


@dataclass(frozen=True, eq=False)
class SceneBake:
    """What a bake leaves behind besides the attribute on the meshes.

    Attributes
    ----------
    report : dict
        The figures of the bake, with the keys that the README lists; plain numbers, strings, lists and dicts.
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
    *,
    attribute: str = "Radiosity",
    domain: str = 'CORNER',
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
    attribute : str
        Name of the color attribute; an existing one of that name is overwritten.
    domain : {'CORNER', 'POINT'}
        Whether each face corner or each vertex carries a color.

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
    check_attribute(attribute, domain)
    reading = read_scene(scene, view_layer, depsgraph)
    check_targets(reading.targets)
    seconds_read = time.perf_counter() - started
    # Undo or loading a file frees Blender's data while a modal bake waits: keep none of it between two steps.
    del scene, view_layer, depsgraph
    yield Progress("Reading the scene", 1.0)

    bake = yield from core_bake.bake(reading.scene, settings)

    writing = time.perf_counter()
    write_attribute(reading.targets, bake.corner_radiance, attribute, domain)
    seconds = {"read": seconds_read, "write": time.perf_counter() - writing, "total": time.perf_counter() - started}
    raise NotImplementedError(seconds)
