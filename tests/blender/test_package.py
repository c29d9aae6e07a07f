# SPDX-License-Identifier: GPL-3.0-or-later
"""The artifact: the manifest and the zip, built, validated, installed and enabled by Blender's own tools."""

import re
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXTENSION_TOOL = "import sys, bpy, bl_pkg; sys.exit(bl_pkg.cli_extension({arguments!r}))"
INSTALL = """
import sys
from pathlib import Path
import bpy, addon_utils

zip_path, = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
done = bpy.ops.extensions.package_install_files(filepath=zip_path, repo="user_default", enable_on_install=True)
assert done == {'FINISHED'}, done
assert "bl_ext.user_default.radiosity" in bpy.context.preferences.addons
assert bpy.ops.radiosity.bake.poll()
warnings = getattr(addon_utils, "_extensions_warnings_get", dict)()
assert not warnings, warnings

bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
bpy.ops.mesh.primitive_plane_add(size=1.0, location=(0.0, 0.0, 1.0), rotation=(3.14159265, 0.0, 0.0))
lamp = bpy.data.materials.new("Lamp")
lamp.use_nodes = True
principled = lamp.node_tree.nodes["Principled BSDF"]
principled.inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
principled.inputs["Emission Strength"].default_value = 1.0
bpy.context.object.data.materials.append(lamp)
bpy.ops.mesh.primitive_plane_add(size=1.0)
assert bpy.ops.radiosity.bake() == {'FINISHED'}
colors = bpy.context.object.data.color_attributes["Radiosity"].data
assert all(0.0 < item.color[0] < 1.0 for item in colors)

repos = bpy.context.preferences.extensions.repos
index = next(index for index, repo in enumerate(repos) if repo.module == "user_default")
folder = Path(repos[index].directory) / "radiosity"
assert folder.is_dir()
assert bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="radiosity") == {'FINISHED'}
assert not folder.exists()
assert not hasattr(bpy.types.Scene, "radiosity")
print("installed, enabled, baked, uninstalled")
"""


@pytest.fixture(scope="module")
def manifest():
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


@pytest.fixture
def built(run_blender, tmp_path):
    """Build the extension's zip with Blender's own tool."""
    path = tmp_path / "radiosity.zip"
    arguments = ["build", "--source-dir", str(ROOT), "--output-filepath", str(path)]
    done = run_blender(EXTENSION_TOOL.format(arguments=arguments))
    assert done.returncode == 0, done.stdout + done.stderr
    return path


def test_the_manifest_is_valid(run_blender, manifest):
    done = run_blender(EXTENSION_TOOL.format(arguments=["validate", str(ROOT)]))
    assert done.returncode == 0, done.stdout + done.stderr
    assert manifest["id"] == "radiosity"
    assert "wheels" not in manifest and "platforms" not in manifest, "pure Python, for every platform"


def test_the_manifest_promises_what_is_tested(manifest):
    oldest = re.search(r"BPY=(\d+\.\d+)\.", (ROOT / ".ci" / "run").read_text(encoding="utf-8"))[1]
    assert manifest["blender_version_min"] == f"{oldest}.0"


def test_the_changelog_tells_of_this_version(manifest):
    assert f"## {manifest['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_zip_holds_the_extension_and_nothing_else(built):
    names = set(zipfile.ZipFile(built).namelist())
    folders = (ROOT / "core", ROOT / "radiosity_addon")
    python = {path.relative_to(ROOT).as_posix() for folder in folders for path in folder.rglob("*.py")}
    assert names == python | {"__init__.py", "blender_manifest.toml", "LICENSE", "README.md", "CHANGELOG.md"}


def test_the_zip_is_validated_installed_enabled_bakes_and_goes(built, run_blender, tmp_path):
    done = run_blender(EXTENSION_TOOL.format(arguments=["validate", str(built)]))
    assert done.returncode == 0, done.stdout + done.stderr
    done = run_blender(INSTALL, str(built))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "installed, enabled, baked, uninstalled" in done.stdout
