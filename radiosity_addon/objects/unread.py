# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render would show otherwise: what the viewport hides or simplifies, what has no faces, what is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import bpy

from ..wording import listed
from .surfaces import HAVE_SURFACES

# Modifiers with a number of levels of their own for renders.
_LEVELS = {'SUBSURF', 'MULTIRES'}


def differences(enabled: Iterable[bpy.types.Object]) -> list[str]:
    """Tell what renders otherwise than it is read.

    Parameters
    ----------
    enabled : iterable of bpy.types.Object
        Those that are enabled in renders and not excluded from bakes.

    Returns
    -------
    list of str
        One line for each kind of difference, with the names of the objects.
    """
    found = list(enabled)
    lines = []
    for what, names in (
        ("{0}: modifiers are other in renders; they are read as the viewport shows them", _modified(found)),
        ("{0}: shadow catchers are read like any other surface", _shadow_catchers(found)),
        ("{0}: hair has no faces and is left out", _with_particles(found, _is_hair)),
        ("{0}: particles are read as the viewport shows them, which is not all of them", _with_particles(found, _few)),
    ):
        if names:
            lines.append(what.format(f"{'Object' if len(names) == 1 else 'Objects'} {listed(names)}"))
    return lines + _missing(found)


def layer_differences(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> list[str]:
    """Tell what a render of a view layer shows otherwise than its objects are read.

    Parameters
    ----------
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer

    Returns
    -------
    list of str
        One line each.
    """
    lines, render = [], scene.render
    if scene.background_set is not None:
        lines.append(
            f"Scene '{scene.name_full}': its background set '{scene.background_set.name_full}' is left out (link its "
            "collections into the scene)"
        )
    if layer.material_override is not None:
        lines.append(
            f"View layer '{layer.name}': material '{layer.material_override.name_full}', which replaces all others in "
            "renders, is not used"
        )
    if render.use_simplify and render.simplify_subdivision != render.simplify_subdivision_render:
        lines.append(
            f"Scene '{scene.name_full}': Simplify subdivides up to {render.simplify_subdivision_render} times in "
            f"renders; surfaces are read as the viewport shows them, up to {render.simplify_subdivision} times"
        )
    return lines


def _modified(objects: list[bpy.types.Object]) -> list[str]:
    """Return the names of objects whose modifiers have other settings for renders."""
    return [obj.name_full for obj in objects if any(_differs(modifier) for modifier in obj.modifiers)]


def _differs(modifier: bpy.types.Modifier) -> bool:
    if modifier.show_render != modifier.show_viewport:
        return True
    return modifier.show_render and modifier.type in _LEVELS and modifier.levels != modifier.render_levels


def _shadow_catchers(objects: list[bpy.types.Object]) -> list[str]:
    # Lamps have that flag as well, and mostly set.
    return [obj.name_full for obj in objects if obj.type in HAVE_SURFACES and obj.is_shadow_catcher]


def _with_particles(objects: list[bpy.types.Object], fits: Callable[[bpy.types.ParticleSettings], bool]) -> list[str]:
    """Return the names of objects with particles that are shown and of some kind."""
    return [
        obj.name_full
        for obj in objects
        for modifier in obj.modifiers
        if modifier.type == 'PARTICLE_SYSTEM' and modifier.show_render and fits(modifier.particle_system.settings)
    ]


def _is_hair(settings: bpy.types.ParticleSettings) -> bool:
    return settings.render_type == 'PATH' and settings.type == 'HAIR'


def _few(settings: bpy.types.ParticleSettings) -> bool:
    return settings.render_type in {'OBJECT', 'COLLECTION'} and settings.display_percentage < 100


def _missing(objects: list[bpy.types.Object]) -> list[str]:
    """Name the libraries that objects want but that are not there."""
    wanted: dict[str, list[str]] = {}
    for obj in objects:
        for block in (obj, obj.data, obj.instance_collection):
            if block is not None and block.is_missing:
                wanted.setdefault(block.library.filepath, []).append(obj.name_full)
    return [
        f"Library '{path}' is missing: what {listed(names)} would show of it is left out"
        for path, names in wanted.items()
    ]
