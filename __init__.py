# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's entry point: the add-on is imported on registration, so that `core` works and is tested without bpy."""


def register() -> None:
    """Import the add-on and register it with Blender."""
    from . import radiosity_addon

    radiosity_addon.register()


def unregister() -> None:
    """Take everything that `register` added out of Blender."""
    from . import radiosity_addon

    radiosity_addon.unregister()
