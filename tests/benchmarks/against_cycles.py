# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake every scene with ours at every quality and with Cycles at several sample counts, taking turns.

In each turn ours bakes once at every quality, then Cycles bakes once: whatever else the machine does falls on both.
"""

import time
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from statistics import median

import numpy as np
from numpy.typing import NDArray

from core.bake import bake
from core.progress import exhaust
from core.scene import Scene
from core.settings import Settings

from . import cycles, machine, measure, references, runs, tables
from .geometry import Geometry
from .measure import Points
from .runs import CYCLES, OURS, Run
from .scenes import SCENES

FloatArray = NDArray[np.float64]


def main(options: Namespace) -> None:
    """Measure the scenes asked for, and write table and plot."""
    from . import plots

    folder: Path = options.output
    where, measured = machine.description(), []
    for name in options.scenes or SCENES:
        measured += list(_measure(name, options))
        # After every scene: a long benchmark that is stopped leaves what it has.
        runs.save(folder / "cycles.json", where, measured)
        (folder / "cycles.md").write_text(tables.against_cycles(where, measured))
        plots.against_cycles(folder / "cycles.png", measured)
    print((folder / "cycles.md").read_text())


def _measure(name: str, options: Namespace) -> Iterator[Run]:
    """Yield the runs of one scene."""
    items = SCENES[name]()
    objects = cycles.build(items)
    geometry = cycles.read(items, objects)
    kept = options.output / "references"
    judge = _Judge(
        measure.points(geometry),
        references.hidden(kept, name, geometry),
        references.reference(kept, name, geometry, objects, options.reference_samples),
    )
    # Neither side pays for what is loaded once.
    cycles.bake(objects, 1, 0)
    _ours(geometry, Settings(method=options.method, quality="preview"))

    seconds: dict[str, list[float]] = {quality: [] for quality in options.qualities}
    results: dict[str, tuple[FloatArray, dict[str, object]]] = {}
    for samples in options.samples:
        for quality in options.qualities:
            radiance, took, report = _ours(geometry, Settings(method=options.method, quality=quality))
            seconds[quality].append(took)
            results[quality] = radiance, report
            print(f"{name}: ours, {quality}: {took:.2f} s ({machine.load()})", flush=True)
        radiance, took = cycles.bake(objects, samples, seed=1)
        print(f"{name}: Cycles, {samples} samples: {took:.1f} s ({machine.load()})", flush=True)
        yield Run(name, CYCLES, str(samples), took, **judge.errors(radiance))
    for quality, (radiance, report) in results.items():
        counts = {key: int(str(report.get(key, 0))) for key in ("links", "rays")}
        yield Run(name, OURS, quality, median(seconds[quality]), **judge.errors(radiance), **counts)


class _Judge:
    """Knows the truth about one scene."""

    def __init__(self, points: Points, hidden: NDArray[np.bool_], truth: tuple[FloatArray, FloatArray]) -> None:
        self.points, self.truth = points, truth
        self.exposed = points.without(hidden)
        self.corners = Points(np.arange(len(points.point)), points.counted[points.point])

    def errors(self, radiance: FloatArray) -> dict[str, float]:
        """Return the figures of a `Run`."""
        return {
            "error": measure.error(self.points, radiance, *self.truth),
            "error_exposed": measure.error(self.exposed, radiance, *self.truth),
            "error_corners": measure.error(self.corners, radiance, *self.truth),
            "bias": measure.bias(self.exposed, radiance, *self.truth),
        }


def _ours(geometry: Geometry, settings: Settings) -> tuple[FloatArray, float, dict[str, object]]:
    """Bake with ours; return the radiance at the corners, the time from arrays to colours, and the report."""
    arrays = {field.name: getattr(geometry, field.name) for field in fields(geometry)}
    start = time.perf_counter()
    baked = exhaust(bake(Scene(**arrays), settings))
    seconds = time.perf_counter() - start
    return baked.corner_radiance, seconds, baked.report.as_dict()
