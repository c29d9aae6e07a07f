# SPDX-License-Identifier: GPL-3.0-or-later
"""Two ways to put the extension where Blender finds it."""

from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
EXTENSION = "radiosity"


def link_checkout(bpy: ModuleType) -> None:
    """Link the checkout into the folder of the user's own extensions."""
    repos = bpy.context.preferences.extensions.repos
    folder = Path(next(repo.directory for repo in repos if repo.module == "user_default"))
    folder.mkdir(parents=True, exist_ok=True)
    link = folder / EXTENSION
    if link.is_symlink():
        link.unlink()
    link.symlink_to(ROOT, target_is_directory=True)
    bpy.ops.extensions.repo_refresh_all()


def install_zip(bpy: ModuleType, path: Path) -> None:
    """Build the extension's zip and install it."""
    import bl_pkg

    assert bl_pkg.cli_extension(["build", "--source-dir", str(ROOT), "--output-filepath", str(path)]) == 0
    result = bpy.ops.extensions.package_install_files(filepath=str(path), repo="user_default", enable_on_install=True)
    assert result == {'FINISHED'}
