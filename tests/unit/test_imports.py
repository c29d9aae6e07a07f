# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may import whom: core only NumPy, the extension its own modules relatively, the root nothing before its time."""

import ast
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CORE = sorted((ROOT / "core").rglob("*.py"))
SHIPPED = [ROOT / "__init__.py", *CORE, *sorted((ROOT / "radiosity_addon").rglob("*.py"))]
OURS = {"core", "radiosity_addon", "bl_ext", "tests", "example_blends"}


def names(path):
    """Return the top-level packages that a file imports absolutely."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.add(node.module.split(".")[0])
    return found


def relative(path):
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", SHIPPED, ids=relative)
def test_shipped_modules_import_each_other_relatively(path):
    # Blender decides what the extension is called, so an absolute name of ours would not be found or be another copy.
    assert not names(path) & OURS


@pytest.mark.parametrize("path", CORE, ids=relative)
def test_core_needs_nothing_but_numpy(path):
    allowed = set(sys.stdlib_module_names) | {"numpy"}
    if path.name == "blender_tree.py":
        allowed.add("mathutils")  # inside functions: Blender's tree, where there is one
    assert names(path) <= allowed


def test_every_module_of_core_imports_without_blender():
    modules = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in CORE if path.name != "__init__.py"]
    code = "import sys; sys.modules.update(bpy=None, bmesh=None, mathutils=None)\n" + "\n".join(
        f"import {name}" for name in modules
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_root_imports_the_add_on_only_when_asked_to_register(monkeypatch):
    monkeypatch.setitem(sys.modules, "bpy", None)
    init, search = ROOT / "__init__.py", [str(ROOT)]
    spec = importlib.util.spec_from_file_location("a_name", init, submodule_search_locations=search)
    package = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "a_name", package)
    spec.loader.exec_module(package)
    assert "a_name.radiosity_addon" not in sys.modules
    with pytest.raises(ModuleNotFoundError, match="bpy"):
        package.register()
