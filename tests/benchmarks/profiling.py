# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the time of one bake goes: ``python -m tests.benchmarks.profiling BLEND [--quality medium]``.

The seconds of the stages first, with all processors; then the functions that take most, with one, as a profiler sees
nothing of what other threads do. The profile is kept for other tools.
"""

import cProfile
import pstats
from argparse import ArgumentParser
from pathlib import Path

import bpy

from core.hierarchy.quality import QUALITIES
from example_blends.bake import load
from tests.at_once import AtOnce

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Bake twice, and print what took how long."""
    parser = ArgumentParser(prog="python -m tests.benchmarks.profiling", description=__doc__)
    parser.add_argument("blend", type=Path)
    parser.add_argument("--quality", default="medium", choices=list(QUALITIES))
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
    profile.runcall(lambda: exhaust(bake(reading.scene, settings, executor=AtOnce())))
    chosen.output.parent.mkdir(parents=True, exist_ok=True)
    profile.dump_stats(chosen.output)
    pstats.Stats(profile).strip_dirs().sort_stats(chosen.sort).print_stats(chosen.most)


if __name__ == "__main__":
    main()
