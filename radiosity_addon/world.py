# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's world as the core's sky: one color, or a picture that Cycles renders of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.lighting.lamps import Lamp, SkyLamp
from ..core.mending import BRIGHTEST
from .panorama import render_sky

if TYPE_CHECKING:
    from numpy.typing import NDArray


def read_world(world: bpy.types.World | None, notes: list[str]) -> tuple[Lamp, ...]:
    """Read the light of a world.

    Parameters
    ----------
    world : bpy.types.World or None
    notes : list of str
        What is read otherwise than Blender would render it is added.

    Returns
    -------
    tuple of Lamp
        A sky, and a sun for each spot in it that is much brighter than the rest; nothing where it is black.
    """
    if world is None or not world.cycles_visibility.diffuse:
        return ()
    if _has_volume(world):
        notes.append(f"World '{world.name_full}': its volume is not read, there is no fog")
    color = _constant(world)
    if color is None:
        return render_sky(world, notes)
    if (color < 0.0).any():
        notes.append(f"World '{world.name_full}': a negative color or strength counts as 0")
    if not np.isfinite(color).all():
        notes.append(f"World '{world.name_full}': a color or strength that is not a finite number counts as 0")
    color = np.nan_to_num(color, posinf=0.0, neginf=0.0).clip(0.0, BRIGHTEST)
    return (SkyLamp(world.name_full, color.reshape(1, 1, 3)),) if color.any() else ()


def _has_nodes(world: bpy.types.World) -> bool:
    # From 5.0 on every world uses nodes, and asking for `use_nodes` warns that it will go.
    return world.node_tree is not None and (bpy.app.version >= (5, 0, 0) or world.use_nodes)


def _output(world: bpy.types.World) -> bpy.types.ShaderNode | None:
    """Return the node that says what Cycles shows of a world."""
    return world.node_tree.get_output_node('CYCLES') or world.node_tree.get_output_node('ALL')


def _has_volume(world: bpy.types.World) -> bool:
    output = _output(world) if _has_nodes(world) else None
    return output is not None and output.inputs["Volume"].is_linked


def _constant(world: bpy.types.World) -> NDArray[np.float64] | None:
    """Return the radiance of a world of one color; None for any other."""
    if not _has_nodes(world):
        return np.array(world.color, dtype=float)
    output = _output(world)
    if output is None or not output.inputs["Surface"].is_linked:
        return np.zeros(3)
    shader = output.inputs["Surface"].links[0].from_node
    if shader.bl_idname != 'ShaderNodeBackground' or shader.mute:
        return None
    color, strength = shader.inputs["Color"], shader.inputs["Strength"]
    if not strength.is_linked and strength.default_value == 0.0:
        return np.zeros(3)
    if color.is_linked or strength.is_linked:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        return np.array(color.default_value[:3], dtype=float) * strength.default_value
