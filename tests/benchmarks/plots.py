# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures as pictures; matplotlib is needed for nothing else in this project."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from . import runs
from .runs import CYCLES, OURS, Run

COLUMNS = 2
COLOURS = {OURS: "tab:orange", CYCLES: "tab:blue"}
NAMES = {OURS: "Radiosity", CYCLES: "Cycles (samples)"}


def against_cycles(file: Path, measured: Sequence[Run]) -> None:
    """Draw error at exposed vertices against time, one panel a scene, both axes logarithmic."""
    scenes = list(dict.fromkeys(run.scene for run in measured))
    columns = min(COLUMNS, len(scenes))
    rows = -(-len(scenes) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.2 * rows))
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for panel, scene in zip(panels.flat, scenes, strict=False):
        panel.set_title(scene.replace("_", " "))
        _extend(panel, runs.of(measured, scene, CYCLES), runs.of(measured, scene, OURS))
        for method in (OURS, CYCLES):
            _draw(panel, runs.of(measured, scene, method), method)
        panel.grid(True, which="both", alpha=0.25)
        panel.tick_params(labelbottom=True)
        panel.set_xlabel("time [s]")
    for panel in panels.flat[len(scenes) :]:
        panel.set_axis_off()
    for panel in panels[:, 0]:
        panel.set_ylabel("error (rms over mean)")
    panels.flat[0].legend()
    figure.tight_layout()
    figure.savefig(file, dpi=110)


def _draw(panel: Axes, shown: Sequence[Run], method: str) -> None:
    """Draw the runs of one method as a line with its settings written beside the points."""
    if not shown:
        return
    seconds, errors = np.array([[run.seconds, run.error_exposed] for run in shown]).T
    panel.loglog(seconds, errors, "o-", color=COLOURS[method], label=NAMES[method])
    for run in shown:
        at = run.seconds, run.error_exposed
        panel.annotate(run.setting, at, textcoords="offset points", xytext=(5, 4), fontsize=7)
    panel.xaxis.set_major_locator(LogLocator(subs=(1, 3)))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    panel.yaxis.set_minor_formatter(NullFormatter())


def _extend(panel: Axes, cycles: Sequence[Run], ours: Sequence[Run]) -> None:
    """Draw Cycles' line on to the errors of ours, dashed: what the times for the same error are read off."""
    if len(cycles) < 2 or not ours:
        return
    least = min(run.error_exposed for run in (*cycles, *ours))
    errors = np.array([min(run.error_exposed for run in cycles), least])
    seconds = [runs.cycles_seconds(cycles, error, "error_exposed") for error in errors]
    panel.loglog(seconds, errors, "--", color=COLOURS[CYCLES])
