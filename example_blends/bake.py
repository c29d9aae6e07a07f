# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake a scene from a checkout, with the bpy wheel or with any Blender.

    python example_blends/bake.py INPUT [options]
    blender -b INPUT.blend --python example_blends/bake.py -- [options]

INPUT is a .blend or a scene in the thesis's text format; --help lists the options.
"""

import importlib.util
import os
import sys
import traceback
from pathlib import Path
from types import ModuleType

try:
    import bpy
except ModuleNotFoundError:
    sys.exit("radiosity: error: this Python has no bpy: `make bake` sets one up that has, or run it with Blender")

# Not the name of the installed extension, which may be enabled in this Blender as well.
ALIAS = "radiosity_checkout"


def load(name: str) -> ModuleType:
    """Import a module of the extension from this checkout, whatever its folder is called, without touching sys.path."""
    if ALIAS in sys.modules:
        return importlib.import_module(f"{ALIAS}.{name}")
    root = Path(__file__).resolve().parents[1]
    spec = importlib.util.spec_from_file_location(ALIAS, root / "__init__.py", submodule_search_locations=[str(root)])
    package = importlib.util.module_from_spec(spec)
    sys.modules[ALIAS] = package
    spec.loader.exec_module(package)
    return importlib.import_module(f"{ALIAS}.{name}")


def main() -> None:
    """Run the command and end the process with its exit code."""
    inside_blender = bool(bpy.app.binary_path)
    argv = sys.argv[1:]
    if inside_blender:
        argv = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    try:
        code = load("radiosity_addon.cli").main(argv, prog="bake.py")
    except Exception:
        # Blender would print it too, but end with 0.
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    if inside_blender:
        sys.exit(code)
    # Some bpy wheels crash while Python takes them down after a glTF export (4.2 does), which would be the exit code.
    os._exit(code)


if __name__ == "__main__":
    main()
