# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said about memory follows what is taken."""

import gc
import subprocess
import sys
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core import bake as baking
from core import memory
from core.bake import bake
from core.errors import RadiosityError
from core.hierarchy import foresight, solve
from core.hierarchy.scenery import build_scenery
from core.progress import exhaust
from core.scene import BOTH, FRONT
from core.settings import Settings

ROOT = Path(__file__).resolve().parents[2]

MEMINFO = "MemTotal:       16000000 kB\nMemFree:         1000000 kB\nMemAvailable:    8000000 kB\n"


def test_the_peak_grows_with_what_is_taken():
    # In a process of its own: here much may have been taken before.
    code = """
import numpy as np
from core.memory import peak_memory
before = peak_memory()
kept = np.ones(2**23)
print((peak_memory() - before) / kept.nbytes)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert float(done.stdout) == pytest.approx(1.0, abs=0.1)


def test_some_memory_is_available():
    assert memory.available_memory() > 2**20


@pytest.mark.parametrize(
    ("limit", "used", "expected"),
    [("max", "5", 8_000_000 * 1024), ("3000", "1000", 2000), ("1000", "3000", 0), (None, None, 8_000_000 * 1024)],
)
def test_a_container_may_leave_less_than_the_machine(tmp_path, limit, used, expected):
    (tmp_path / "meminfo").write_text(MEMINFO)
    if limit is not None:
        (tmp_path / "memory.max").write_text(limit + "\n")
        (tmp_path / "memory.current").write_text(used + "\n")
    assert memory._linux_available(tmp_path / "meminfo", tmp_path) == expected


def test_what_a_rough_solution_was_made_of_is_gone_when_the_links_are_made(cube, monkeypatch):
    made = []

    def noted(*args, **options):
        scenery = build_scenery(*args, **options)
        made.append(weakref.ref(scenery))
        return scenery

    monkeypatch.setattr(solve, "build_scenery", noted)
    steps = bake(cube(0.5, 1.0, 6), Settings(quality="preview"))
    while next(steps).stage != "Links":
        pass
    gc.collect()
    assert len(made) == 2 and made[0]() is None and made[1]() is not None


@pytest.mark.parametrize("sides", [FRONT, BOTH])
def test_what_cannot_fit_is_refused_in_one_line_before_it_begins(cube, monkeypatch, sides):
    # As many kilobytes as there are faces, and half as many again.
    scene = cube(0.5)
    scene = replace(scene, sides=np.full(len(scene.sides), sides))
    free = 6 * 1024 * len(scene.face_area)
    monkeypatch.setattr(foresight, "available_memory", lambda: free)
    steps = bake(scene, Settings())
    if sides == FRONT:
        assert next(steps).stage == "Patches"
        steps.close()
    else:
        with pytest.raises(
            RadiosityError, match=r"^To light \d+ patches takes 0.0 GiB of memory at least, and 0.0 GiB"
        ):
            exhaust(steps)
    monkeypatch.setattr(foresight, "available_memory", lambda: free // 2)
    monkeypatch.setattr(baking, "mesh", None)
    with pytest.raises(RadiosityError, match="are free: leave out or simplify what has most faces"):
        next(bake(scene, Settings()))
