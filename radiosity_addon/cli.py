# SPDX-License-Identifier: GPL-3.0-or-later
"""The command: bake a .blend or a scene in the thesis's text format from a terminal.

What was done goes to stdout, progress and complaints to stderr. Exit codes: 0 done, 1 failed, 2 wrong usage,
130 interrupted.
"""

import argparse
import json
import signal
import sys
import threading
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from ..core.errors import RadiosityError
from ..core.progress import Progress
from ..core.scene_text import read_scene_text
from ..core.settings import Settings
from . import object_properties
from .baking import SceneBake, bake_scene
from .cli_options import ENDINGS, parse
from .destination import COPY, Destination
from .gltf import export_glb
from .outputs import check_output, replacing
from .picture import render_picture
from .quiet import quiet
from .text_import import build_objects
from .unreadable import blenders_reason, blenders_reasons, why_unreadable
from .wording import gathered

DONE, FAILED, INTERRUPTED = 0, 1, 130
PROGRESS_EVERY = 5.0  # seconds, within a stage


def main(argv: list[str], *, prog: str, verb: str | None = None) -> int:
    """Bake, and write what is asked for.

    Parameters
    ----------
    argv : list of str
        The arguments.
    prog : str
        How the command was called, for its help.
    verb : str, optional
        Word that has to come first.

    Returns
    -------
    int
        Exit code.
    """
    try:
        options, settings, destination = parse(argv, prog, verb)
    except SystemExit as end:  # argparse has said what is wrong, or given help
        return int(end.code or 0)
    object_properties.ensure()
    try:
        with _interruptible():
            _run(options, settings, destination)
    except RadiosityError as error:
        return _fail(str(error))
    except OSError as error:
        return _fail(f"{error.filename or 'A file'}: {error.strerror or error}")
    except MemoryError:
        return _fail("There is not enough memory: take larger patches (--max-edge) or --method shooting")
    except KeyboardInterrupt:
        _fail("Interrupted; what was being done has been dropped")
        return INTERRUPTED
    return DONE


def _fail(message: str) -> int:
    """Complain in one line."""
    _tell(f"error: {' '.join(message.split())}")
    return FAILED


def _tell(message: str) -> None:
    """Write a line to standard error, whole even if Ctrl-C comes meanwhile: `print` writes its end apart."""
    sys.stderr.write(f"radiosity: {message}\n")
    sys.stderr.flush()


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt also inside Blender, which has a handler of its own."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        # None stands for a handler that was not set from Python, which cannot be put back.
        signal.signal(signal.SIGINT, signal.SIG_DFL if previous is None else previous)


def _run(options: argparse.Namespace, settings: Settings, destination: Destination) -> None:
    """Open the input, bake, write, and tell."""
    # What cannot be written is found out before the bake, not after it.
    files: dict[str, Path] = {name: getattr(options, name).absolute() for name in ENDINGS if getattr(options, name)}
    for path in files.values():
        check_output(path)
    source, settings, complaints = _open(options.input, settings)

    bake = _bake(settings, destination)
    bake.report["warnings"][:0] = complaints
    stops = _write(files, bake.report, options, destination)
    for warning in gathered(bake.report["warnings"]):
        _tell(f"warning: {warning}")
    if not files:
        _tell("warning: nothing was written: name a file with --output, --gltf, --render or --report")
    print("\n".join(_summary(source, bake.report, destination)))
    for name, path in files.items():
        print(f"Written:  {path}" + (f" (exposure {stops[name]:+.2f} stops)" if name in stops else ""))


def _open(path: Path | None, settings: Settings) -> tuple[Path, Settings, list[str]]:
    """Load the input; return its path, the settings that remain to be applied to it, and warnings."""
    if path is None:
        # Blender goes on with its default scene when it cannot read the file that was named.
        if not bpy.data.filepath:
            raise RadiosityError("No .blend is loaded: name one to bake; if one was named, Blender could not read it")
        return Path(bpy.data.filepath), settings, []
    path = path.absolute()
    if not path.is_file():
        raise RadiosityError(f"There is no file {path}")
    rectangles = read_scene_text(path) if path.suffix.lower() == ".txt" else None
    with quiet():
        # An unnamed scene: the name then tells whether a .blend was loaded.
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    if rectangles is None:
        return path, settings, _load(path)
    build_objects(bpy.context.scene, rectangles, settings.subdivide, name=path.stem)
    return path, replace(settings, subdivide=1), []


def _load(path: Path) -> list[str]:
    """Load a .blend; return what Blender could not read of it."""
    complaints = []
    try:
        with quiet():
            bpy.ops.wm.open_mainfile(filepath=str(path))
    except RuntimeError as error:
        # Blender calls it an error, too, where it has loaded the file but for a part.
        if not bpy.data.filepath:
            raise RadiosityError(f"Blender cannot read {path}: {why_unreadable(path, error)}") from error
        complaints = [f"A part of {path.name} is lost: {reason}" for reason in blenders_reasons(error)]
    if not bpy.data.filepath or not path.samefile(bpy.data.filepath):
        raise RadiosityError(f"Blender cannot read {path}")
    return complaints


def _depsgraph() -> bpy.types.Depsgraph:
    """Return the evaluated state of the active scene as it is now."""
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def _bake(settings: Settings, destination: Destination) -> SceneBake:
    """Bake the active scene and tell how far it is."""
    return _follow(bake_scene(bpy.context.scene, bpy.context.view_layer, _depsgraph(), settings, destination))


def _follow(steps: Generator[Progress, None, SceneBake]) -> SceneBake:
    """Exhaust a bake; say when a stage begins, and now and then how far it is."""
    stage, told = "", 0.0
    while True:
        try:
            progress = next(steps)
        except StopIteration as end:
            result: SceneBake = end.value
            return result
        now = time.monotonic()
        if progress.memory:
            _tell(f"{progress.stage} need {progress.memory / 2**20:.1f} MB")
        elif progress.stage != stage:
            _tell(progress.stage)
        elif now - told >= PROGRESS_EVERY:
            _tell(f"{progress.stage} {progress.fraction:.0%}")
        else:
            continue
        stage, told = progress.stage, now


def _write(
    files: dict[str, Path], report: dict[str, Any], options: argparse.Namespace, destination: Destination
) -> dict[str, float]:
    """Write every file that was asked for; return the exposures that were applied [stops]."""
    stops = {}
    shown = {
        "attribute": destination.attribute,
        "exposure": options.exposure,
        "copies": destination.target == COPY,
        "lighting": report["settings"]["light"] == "lighting",
    }
    if "output" in files:
        _save(files["output"])
    if "gltf" in files:
        with quiet():
            stops["gltf"] = export_glb(files["gltf"], _depsgraph(), notes=report["warnings"], **shown)
    if "render" in files:
        with quiet():
            stops["render"] = render_picture(files["render"], _depsgraph(), **shown)
    if "report" in files:
        with replacing(files["report"]) as temporary:
            temporary.write_text(json.dumps(report, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return stops


def _save(path: Path) -> None:
    """Save the scene; the file that was opened stays as it is unless this is its name."""
    try:
        with replacing(path) as temporary, quiet():
            bpy.ops.wm.save_as_mainfile(filepath=str(temporary), copy=True, check_existing=False)
    except RuntimeError as error:
        raise RadiosityError(f"Cannot write {path}: {blenders_reason(error)}") from error


def _summary(source: Path, report: dict[str, Any], destination: Destination) -> Iterator[str]:
    """Yield what was done, a line for each kind of figure."""
    scene, energy, rows, seconds = (report[key] for key in ("scene", "energy", "row_sum", "seconds"))
    end = "converged" if report["converged"] else "NOT converged"
    written = sum(item["written"] for item in report["objects"])
    yield f"Scene:    {source.name}: {scene['objects']} objects, {scene['faces']} faces, {scene['vertices']} vertices"
    yield (
        f"Light:    {report['settings']['method']}, {report['patches']} patches, {report['iterations']} iterations, "
        f"{end}, residual {report['residual']:.2g}"
    )
    yield f"Row sums: {rows['min']:.4f} to {rows['max']:.4f}, mean {rows['mean']:.4f} (1 where no light escapes)"
    yield (
        f"Energy:   {energy['emitted']:.4g} W emitted, {energy['absorbed']:.4g} W absorbed, "
        f"{energy['escaped']:.4g} W escaped, error {energy['error']:.2%}"
    )
    yield f"Time:     {seconds['total']:.1f} s, peak memory {report['peak_memory_mb']:.0f} MB"
    on = "copies" if destination.target == COPY else "objects"
    yield f"Baked:    \"{destination.attribute}\" on {written} {on}"
