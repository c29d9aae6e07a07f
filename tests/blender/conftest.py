# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures for tests of the add-on: Blender, the enabled extension, an empty scene.

The add-on is tested as Blender runs it, as `bl_ext.user_default.radiosity`. Tests never import `radiosity_addon` or
`core` themselves but reach them through the fixtures `addon` and `core`: ``core("scene").Scene``. `import core` would
give other module objects.

``MODE=zip`` builds, installs and enables the extension's zip; the default links the checkout into Blender's extension
folder, which is fast and keeps coverage and tracebacks true.
"""

import importlib
import os
import subprocess
import sys
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest

from tests.blender.building import add_room, copy_collection, glowing
from tests.blender.installing import EXTENSION, install_zip, link_checkout
from tests.blender.white_floor import add_floor, cycles_irradiance, direct_irradiance

MODULE = f"bl_ext.user_default.{EXTENSION}"


@pytest.fixture(scope="session")
def blender() -> Iterator[ModuleType]:
    """Give bpy, whose settings and extensions tests/conftest.py keeps in a folder that is gone afterwards."""
    yield pytest.importorskip("bpy", reason="needs the bpy wheel (make test) or a real Blender")
    # Blender 4.2's glTF exporter leaves types of bpy in typing's caches; the wheel crashes when they outlive it.
    for clear in typing._cleanups:
        clear()


@pytest.fixture(scope="session")
def extension(blender: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """Install and enable the extension: a link to the checkout, or with ``MODE=zip`` the built zip."""
    import addon_utils

    if os.environ.get("MODE", "link") == "zip":
        install_zip(blender, tmp_path_factory.mktemp("zip") / f"{EXTENSION}.zip")
    else:
        link_checkout(blender)
    assert addon_utils.enable(MODULE, default_set=True) is not None, f"{MODULE} did not register"
    yield importlib.import_module(MODULE)
    # Disabled only, never uninstalled: uninstalling a link would delete the checkout.
    addon_utils.disable(MODULE, default_set=True)


@pytest.fixture
def scene(extension: ModuleType, blender: ModuleType):
    """Give the scene of a new, empty file; the extension stays enabled."""
    # Not read_factory_settings: that resets the preferences and so disables the extension.
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return blender.context.scene


@pytest.fixture(scope="session")
def addon(extension: ModuleType) -> Callable[[str], ModuleType]:
    """Give a function that gives the add-on's modules by name."""
    return lambda name: importlib.import_module(f"{extension.__name__}.radiosity_addon.{name}")


@pytest.fixture(scope="session")
def core(extension: ModuleType) -> Callable[[str], ModuleType]:
    """Give a function that gives the core's modules by name."""
    return lambda name: importlib.import_module(f"{extension.__name__}.core.{name}")


@pytest.fixture
def error(core: Callable[[str], ModuleType]) -> type[Exception]:
    """Give the type of the errors that are turned into messages."""
    return core("errors").RadiosityError


@pytest.fixture
def gltf(addon: Callable[[str], ModuleType]) -> ModuleType:
    """The add-on's module that exports glTF."""
    return addon("gltf")


@pytest.fixture
def glb(addon: Callable[[str], ModuleType]) -> ModuleType:
    """The add-on's module that reads binary glTF files."""
    return addon("glb")


@pytest.fixture
def read(addon: Callable[[str], ModuleType], scene, blender: ModuleType):
    """Give a function that reads the context's scene."""

    def read():
        context = blender.context
        return addon("scene_reader").read_scene(context.scene, context.view_layer, context.evaluated_depsgraph_get())

    return read


@pytest.fixture(scope="session")
def read_surfaces(addon: Callable[[str], ModuleType], blender: ModuleType):
    """Give a function that reads the surfaces of objects, and returns them with what it has to tell."""

    def read(*objects):
        depsgraph = blender.context.evaluated_depsgraph_get()
        reader, notes = addon("face_surfaces").SurfaceReader(), []
        for obj in objects:
            evaluated = obj.evaluated_get(depsgraph)
            reader.add(evaluated.to_mesh(), evaluated)
            evaluated.to_mesh_clear()
        return reader.finish(notes), notes

    return read


@pytest.fixture
def bake(scene, blender: ModuleType):
    """Give a function that presses the button and returns the warnings."""

    def bake(**settings):
        for name, value in ({"quality": 'preview'} | settings).items():
            setattr(blender.context.scene.radiosity, name, value)
        assert blender.ops.radiosity.bake() == {'FINISHED'}
        return blender.context.window_manager.radiosity.warnings.splitlines()

    return bake


@pytest.fixture
def bake_copies(press, blender: ModuleType):
    """Give a function that presses the button with Baked Copy chosen, and returns all that is with the copies.

    Their faces are those of the originals, unless something else is asked for.
    """

    def bake(**settings):
        assert press(**{"target": 'COPY', "cut_large": False} | settings) == {'FINISHED'}
        return list(copy_collection(blender).objects)

    return bake


@pytest.fixture
def press(scene, blender: ModuleType):
    """Give a function that presses the button with settings, and returns what the operator does."""

    def press(**settings):
        for name, value in settings.items():
            setattr(scene.radiosity, name, value)
        return blender.ops.radiosity.bake()

    return press


@pytest.fixture
def run(addon: Callable[[str], ModuleType], scene, capsys: pytest.CaptureFixture[str]):
    """Give a function that runs the command in this process: exit code, stdout, stderr."""
    cli = addon("cli")

    def run(*arguments):
        capsys.readouterr()
        code = cli.main([str(argument) for argument in arguments], prog="bake.py")
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def save(blender: ModuleType, scene, tmp_path: Path):
    """Give a function that saves the scene as a file, then empties it."""

    def save(name="room.blend"):
        path = tmp_path / name
        blender.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
        blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        return path

    return save


@pytest.fixture
def room(scene, save):
    """Give a saved file with a glowing room."""
    add_room(scene, material=glowing())
    return save()


@pytest.fixture
def run_blender(blender: ModuleType, tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Give a function that runs a Python script with bpy in a process and with user settings of its own."""

    def run(script: Path | str, *arguments: str, timeout: float = 300.0) -> subprocess.CompletedProcess[str]:
        path = script if isinstance(script, Path) else tmp_path / "script.py"
        if isinstance(script, str):
            path.write_text(script, encoding="utf-8")
        if blender.app.binary_path:
            start = [blender.app.binary_path, "-b", "--python-exit-code", "1", "--python", str(path), "--", *arguments]
        else:
            start = [sys.executable, str(path), *arguments]
        env = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "user")}
        return subprocess.run(start, capture_output=True, text=True, timeout=timeout, env=env, check=False)

    return run


@pytest.fixture
def floor(scene):
    """Give a white floor to compare light on with Cycles."""
    return add_floor(scene)


@pytest.fixture
def cycles(floor):
    """Give a function that returns Cycles' direct irradiance at the vertices of the floor."""
    return lambda samples=512: cycles_irradiance(floor, samples)


@pytest.fixture
def direct(read, core: Callable[[str], ModuleType], floor):
    """Give a function that returns ours, and the scene as it was read."""

    def direct():
        scene = read().scene
        return direct_irradiance(core, scene, floor), scene

    return direct
