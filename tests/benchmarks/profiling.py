# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the time of one bake goes: ``python -m tests.benchmarks.profiling BLEND [--quality medium]``.

The seconds of the stages first, with all processors; then the functions that take most, with one, as a profiler sees
nothing of what other threads do. The profile is kept for other tools.
"""

import cProfile
import importlib.util
import pstats
import sys
from argparse import ArgumentParser
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy

ROOT = Path(__file__).resolve().parents[2]
# Not the name of the installed extension, which may be enabled as well.
ALIAS = "radiosity_profiled"


class Inline(Executor):
    """Does at once, in this thread, what it is given."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return what is done already."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def load(name: str) -> ModuleType:
    """Import a module of the extension from this checkout, whatever its folder is called."""
    if ALIAS not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            ALIAS, ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
        )
        sys.modules[ALIAS] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[ALIAS])
    return importlib.import_module(f"{ALIAS}.{name}")


def main() -> None:
    """Bake twice, and print what took how long."""
    parser = ArgumentParser(prog="python -m tests.benchmarks.profiling", description=__doc__)
    parser.add_argument("blend", type=Path)
    parser.add_argument("--quality", default="medium", choices=("preview", "medium", "high", "production"))
    parser.add_argument("--sort", default="cumtime", choices=("tottime", "cumtime"), help="default: %(default)s")
    parser.add_argument("--most", type=int, default=40, help="functions that are listed (default: %(default)s)")
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "bake.prof", help="default: %(default)s")
    chosen = parser.parse_args()
    bpy.ops.wm.open_mainfile(filepath=str(chosen.blend.absolute()))
    load("radiosity_addon.object_properties").ensure()
    context = bpy.context
    context.view_layer.update()
    reading = load("radiosity_addon.scene_reader").read_scene(
        context.scene, context.view_layer, context.evaluated_depsgraph_get()
    )
    bake, exhaust = load("core.bake").bake, load("core.progress").exhaust
    settings = load("core.settings").Settings(quality=chosen.quality)

    report = exhaust(bake(reading.scene, settings)).report
    print(f"\n{report.patches} patches, {report.links} links, {report.rays} rays; seconds:")
    for stage, seconds in report.seconds.items():
        print(f"  {stage:14}{seconds:8.2f}")
    profile = cProfile.Profile()
    profile.runcall(lambda: exhaust(bake(reading.scene, settings, executor=Inline())))
    chosen.output.parent.mkdir(parents=True, exist_ok=True)
    profile.dump_stats(chosen.output)
    pstats.Stats(profile).strip_dirs().sort_stats(chosen.sort).print_stats(chosen.most)


if __name__ == "__main__":
    main()
