# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmarks' command: ``python -m tests.benchmarks cycles | growth | race [options]``, from the repository."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

import bpy  # noqa: F401  (first of all: Blender's mathutils can be imported only after it)

from . import against_cycles, growth, thesis_race
from .scenes import SCENES

ROOT = Path(__file__).resolve().parents[2]
QUALITIES = ["preview", "medium", "high", "production"]


def _options() -> Namespace:
    """Read the command line."""
    parser = ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "benchmarks", help="where results are left")
    parser.add_argument("--method", default="hierarchical", help="method of ours (default: %(default)s)")
    tasks = parser.add_subparsers(required=True)

    task = tasks.add_parser("cycles", help="error against time, ours and Cycles")
    task.add_argument("--scenes", nargs="+", choices=list(SCENES), help="default: all")
    task.add_argument("--samples", nargs="+", type=int, default=[16, 64, 256, 1024], help="of Cycles' bakes")
    task.add_argument("--qualities", nargs="+", choices=QUALITIES, default=QUALITIES)
    task.add_argument("--reference-samples", type=int, default=2048, help="of each of the two references")
    task.set_defaults(run=against_cycles.main)

    room = ROOT / "example_blends" / "thesis_room.txt"
    task = tasks.add_parser("growth", help="time and memory against the number of patches")
    task.add_argument("--room", type=Path, default=room, help="scene in the thesis's format")
    task.add_argument("--factors", nargs="+", type=int, default=[2, 4, 8, 18], help="on the patches along a row")
    task.add_argument("--quality", choices=QUALITIES, default="medium")
    task.set_defaults(run=growth.main)

    task = tasks.add_parser("race", help="the thesis's room against the thesis's program")
    task.add_argument("--room", type=Path, default=room, help="scene in the thesis's format")
    task.add_argument("--factors", nargs="+", type=int, default=[5], help="on the patches along a row")
    task.add_argument("--opponent", type=Path, help="program that takes SCENE FACTOR ITERATIONS")
    task.add_argument("--iterations", type=int, default=200, help="of the opponent")
    task.add_argument("--qualities", nargs="+", choices=QUALITIES, default=QUALITIES)
    task.add_argument("--samples", type=int, default=64, help="of Cycles' bake at the patches' centres")
    task.set_defaults(run=thesis_race.main)
    return parser.parse_args()


if __name__ == "__main__":
    chosen = _options()
    chosen.run(chosen)
