# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the thesis's room once, in a process of its own, so that its memory can be told: ``one_bake ROOM FACTOR …``."""

import json
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy  # noqa: F401  (first of all: Blender's mathutils can be imported only after it)
import numpy as np

from core.bake import Bake, bake
from core.progress import exhaust
from core.scene_text import read_scene_text, rectangles_to_scene
from core.settings import Settings


@dataclass(frozen=True)
class Figures:
    """What one bake took.

    Attributes
    ----------
    patches : int
    seconds : float
        From the read scene to the colours.
    peak_before, peak : float
        Largest memory of the process before and after the bake [MiB].
    """

    patches: int
    seconds: float
    peak_before: float
    peak: float


def bake_room(room: Path, factor: int, settings: Settings) -> tuple[Bake, float]:
    """Return the baked room and the time it took."""
    scene = rectangles_to_scene(read_scene_text(room), factor)
    start = time.perf_counter()
    baked = exhaust(bake(scene, settings))
    return baked, time.perf_counter() - start


def in_own_process(room: Path, factor: int, method: str, quality: str) -> Figures:
    """Run this module in a new process and return its figures."""
    command = [sys.executable, "-m", __spec__.name, str(room), str(factor), method, quality]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed:\n{done.stderr}")
    return Figures(**json.loads(done.stdout.splitlines()[-1]))


def _peak() -> float:
    """Return the largest memory of this process so far [MiB]."""
    import resource

    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


if __name__ == "__main__":
    path, times, method_name, quality_name = sys.argv[1:]
    # Linear algebra starts its threads at its first use, which is none of the bake's doing.
    np.linalg.norm(np.eye(64) @ np.eye(64))
    before = _peak()
    result, took = bake_room(Path(path), int(times), Settings(method=method_name, quality=quality_name))
    print(json.dumps(asdict(Figures(len(result.patches.area), took, before, _peak()))))
