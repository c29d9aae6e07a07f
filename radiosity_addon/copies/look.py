# SPDX-License-Identifier: GPL-3.0-or-later
"""What decides how an object looks besides its mesh: what materials may ask of it, and what sees it."""

import bpy

# Of the object: color and number, as the Object Info node tells them, and who sees it.
_SHOWN = (
    "color",
    "pass_index",
    "visible_camera",
    "visible_diffuse",
    "visible_glossy",
    "visible_transmission",
    "visible_volume_scatter",
    "visible_shadow",
    "is_shadow_catcher",
    "is_holdout",
)


def carry_look(copy: bpy.types.Object, original: bpy.types.Object) -> None:
    """Give a copy, and its mesh, the look and the custom properties of what it was made from.

    Parameters
    ----------
    copy : bpy.types.Object
    original : bpy.types.Object
        Of any type.
    """
    for name in _SHOWN:
        setattr(copy, name, getattr(original, name))
    _carry_properties(copy, original)
    if original.data is not None:
        _carry_properties(copy.data, original.data)


def _carry_properties(copy: bpy.types.ID, original: bpy.types.ID) -> None:
    """Copy custom properties, but not the settings of add-ons, which Blender 4 lists among them."""
    for name, value in original.items():
        registered = original.bl_rna.properties.get(name)
        if registered is None or not registered.is_runtime:
            copy[name] = value
