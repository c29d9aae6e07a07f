# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender --command radiosity`: tells Blender about the command, which `cli` holds."""

from typing import Any

import bpy

_handles: list[Any] = []


def run(argv: list[str]) -> int:
    """Run the command and return its exit code."""
    # Only whoever runs the command pays for its import.
    from .cli import main

    return main(argv, prog="blender --command radiosity", verb="bake")


def register() -> None:
    """Add the command."""
    _handles.append(bpy.utils.register_cli_command("radiosity", run))


def unregister() -> None:
    """Take it out again."""
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())
