# SPDX-License-Identifier: GPL-3.0-or-later
"""What copies cannot have of their originals, told in a line for each object."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..objects.targets import Target
from ..wording import listed
from .finer_mesh import left_out

if TYPE_CHECKING:
    import bpy


def left_out_of_copy(mesh: bpy.types.Mesh, target: Target) -> list[str]:
    """Tell what a copy that is cut finer does not have of its original."""
    lost = sorted(left_out(mesh))
    if not lost:
        return []
    what = "attribute {} is" if len(lost) == 1 else "attributes {} are"
    what = what.format(listed(lost))
    return [f"Object '{target.name}': {what} left out of its copy, as faces are cut and texts cannot be"]


def make_room(copy: bpy.types.Object, target: Target, attribute: str) -> list[str]:
    """Remove from a copy what has the attribute's name but is no color, and tell so."""
    mesh, what = copy.data, ""
    if attribute in mesh.attributes and attribute not in mesh.color_attributes:
        mesh.attributes.remove(mesh.attributes[attribute])
        what = "an attribute that is not a color"
    if attribute in copy.vertex_groups:
        copy.vertex_groups.remove(copy.vertex_groups[attribute])
        what = "a vertex group"
    if not what:
        return []
    return [f"Object '{target.name}' has {what} named '{attribute}'; its copy has the colors in that place"]
