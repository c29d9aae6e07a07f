# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on: reads Blender's scene into `core`, writes its colors back, and owns every operator, panel and command."""

import bpy

from . import command, object_panel, object_properties, operators, panels, properties, text_operators

MODULES = (properties, object_properties, operators, text_operators, panels, object_panel, command)


def register() -> None:
    """Register the modules in the order in which they need each other."""
    for module in MODULES:
        module.register()


def unregister() -> None:
    """Unregister them in reverse; a second call finds nothing to do."""
    if hasattr(bpy.types.Scene, "radiosity"):
        for module in reversed(MODULES):
            module.unregister()
