# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures as Markdown."""

from collections.abc import Iterable, Sequence

from . import runs
from .runs import CYCLES, OURS, Run

LEGEND = """\
Error: rms of luminance over its mean, at vertices off the emitters that are not on an open border, free of the \
references' noise; *exposed*: without vertices that are buried in other geometry, where a path tracer writes black. \
Cycles' time for the same error comes from a line fitted through the logarithms of its own times and errors; *times*: \
that time over ours; *corner by corner*: the same with no averaging over the corners that meet at a vertex, which \
Cycles' noise profits from. Times are from the scene in memory to the colours of its corners.
"""


def against_cycles(machine: str, measured: Sequence[Run]) -> str:
    """Return the comparison with Cycles as Markdown."""
    ours, cycles = [], []
    for scene in dict.fromkeys(run.scene for run in measured):
        theirs = runs.of(measured, scene, CYCLES)
        ours += [_our_row(run, theirs) for run in runs.of(measured, scene, OURS)]
        cycles += [_cycles_row(run) for run in theirs]
    head = ["scene", "quality", "seconds", "error", "exposed", "bias", "links", "rays"]
    head += ["Cycles, same error", "times", "exposed", "corner by corner"]
    cycles_head = ["scene", "Cycles samples", "seconds", "error", "exposed", "corner by corner"]
    parts = ["Machine: " + machine, table(head, ours), LEGEND.strip(), table(cycles_head, cycles)]
    return "\n\n".join(parts) + "\n"


def _our_row(run: Run, cycles: Sequence[Run]) -> list[str]:
    """Return one row of the first table."""
    same = runs.cycles_seconds(cycles, run.error, "error")
    times = [f"{runs.ratio(run, cycles, which):.1f}" for which in ("error", "error_exposed", "error_corners")]
    row = [run.scene, run.setting, f"{run.seconds:.2f}", percent(run.error), percent(run.error_exposed)]
    return [*row, percent(run.bias), f"{run.links:_}", f"{run.rays:_}", f"{same:.1f} s", *times]


def _cycles_row(run: Run) -> list[str]:
    """Return one row of the second table."""
    errors = map(percent, (run.error, run.error_exposed, run.error_corners))
    return [run.scene, run.setting, f"{run.seconds:.1f}", *errors]


def percent(value: float) -> str:
    """Return a share in per cent."""
    return f"{100 * value:.2f} %"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; all but the first two columns are numbers."""
    lines = [head, ["---", "---", *["---:"] * (len(head) - 2)], *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)
