# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's Table 1 with our times beside its own (T18): ``python -m tests.benchmarks.thesis_table [FACTOR ...]``.

The room of the thesis's format, meshed 1 to 5 times finer, is lit by the thesis's method: the whole matrix of form
factors, then 200 sweeps of gathering, or as many as change anything. Every size runs in a process of its own, so that
its memory can be told. The thesis's times are those of its author's machine: their growth compares, not the programs.
"""

import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOM = Path(__file__).resolve().parents[2] / "example_blends" / "thesis_room.txt"
ITERATIONS = 200
# Kramaric 2015, Table 1, Intel i5-3210M: patches, seconds for the form factors, seconds for all of it.
THESIS = {
    1: (656, 1.375, 2.267),
    2: (2624, 20.549, 33.163),
    3: (5904, 104.557, 167.504),
    4: (10496, 336.688, 534.096),
    5: (16400, 878.201, 1359.861),
}
HEAD = ("patches", "form factors, thesis [s]", "ours [s]", "whole, thesis [s]", "ours [s]", "ratio", "sweeps", "GiB")


def measure(factor: int) -> dict[str, Any]:
    """Light the room once, meshed ``factor`` times finer."""
    import bpy  # noqa: F401  (first of all: Blender's mathutils can be imported only after it)

    from core.bake import bake
    from core.progress import exhaust
    from core.rectangles import rectangles_to_scene
    from core.scene_text import read_scene_text
    from core.settings import Settings

    settings = Settings(method="gathering", form_factors="exact", iterations=ITERATIONS, tolerance=0.0)
    start = time.perf_counter()
    baked = exhaust(bake(rectangles_to_scene(read_scene_text(ROOM), factor), settings))
    report = baked.report.as_dict()
    return {
        "patches": report["patches"],
        "iterations": report["iterations"],
        "form_factors": report["seconds"]["form_factors"],
        "whole": time.perf_counter() - start,
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,  # GiB, of KiB
    }


def in_own_process(factor: int) -> dict[str, Any]:
    """Measure in a new process."""
    command = [sys.executable, "-m", __spec__.name, "--measure", str(factor)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def main(factors: list[int]) -> None:
    """Print the table as Markdown, row by row."""
    from tests.benchmarks.machine import description

    print(f"Ours: {description()}. The thesis's: Intel i5-3210M, {ITERATIONS} iterations.\n")
    print(f"| {' | '.join(HEAD)} |\n|{'---:|' * len(HEAD)}")
    for factor in factors:
        patches, form_factors, whole = THESIS[factor]
        ours = in_own_process(factor)
        if ours["patches"] != patches:
            raise RuntimeError(f"Not the thesis's patches: {ours['patches']} instead of {patches}")
        seconds = (form_factors, ours["form_factors"], whole, ours["whole"])
        cells = [f"{patches}", *(f"{value:.1f}" for value in seconds)]
        cells += [f"{whole / ours['whole']:.0f}", f"{ours['iterations']}", f"{ours['peak']:.2f}"]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(int(sys.argv[2]))))
    else:
        main([int(word) for word in sys.argv[1:]] or list(THESIS))
