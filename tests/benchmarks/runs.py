# SPDX-License-Identifier: GPL-3.0-or-later
"""What was measured, how it is kept, and how long Cycles takes for the same error."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

OURS, CYCLES = "radiosity", "cycles"


@dataclass(frozen=True)
class Run:
    """One scene baked in one way.

    Attributes
    ----------
    scene : str
    method : str
        OURS or CYCLES.
    setting : str
        The quality, or the number of samples.
    seconds : float
        Time from the scene in memory to the colours of its corners (ours: the median of several bakes).
    error : float
        Rms of luminance over its mean, at vertices off the emitters that are not on an open border.
    error_exposed : float
        The same without the vertices that are buried in other geometry.
    error_corners : float
        The same as `error` with every face corner for itself.
    bias : float
        Mean over the reference's mean, less one, at the exposed vertices.
    links, rays : int
        What the bake counted; 0 for Cycles.
    """

    scene: str
    method: str
    setting: str
    seconds: float
    error: float
    error_exposed: float
    error_corners: float
    bias: float
    links: int = 0
    rays: int = 0


def of(runs: Iterable[Run], scene: str, method: str) -> list[Run]:
    """Return the runs of one scene by one method."""
    return [run for run in runs if run.scene == scene and run.method == method]


def cycles_seconds(cycles: Sequence[Run], error: float, measure: str) -> float:
    """Return how long Cycles takes for an error.

    Noise falls with the square root of the time once a bake is long enough: a line is fitted through the logarithms.

    Parameters
    ----------
    cycles : sequence of Run
        Bakes of one scene with different numbers of samples.
    error : float
        The error to reach.
    measure : str
        Which error: the name of an attribute of `Run`.

    Returns
    -------
    float
        Time [s]; NaN when there are too few bakes to tell.
    """
    if len(cycles) < 2 or error <= 0.0:
        return float("nan")
    errors, seconds = np.array([[getattr(run, measure), run.seconds] for run in cycles]).T
    slope, start = np.polyfit(np.log(errors), np.log(seconds), 1)
    return float(np.exp(start + slope * np.log(error)))


def ratio(run: Run, cycles: Sequence[Run], measure: str) -> float:
    """Return how many times longer Cycles takes for the error of a run of ours."""
    return cycles_seconds(cycles, getattr(run, measure), measure) / run.seconds


def save(file: Path, machine: str, runs: Iterable[Run]) -> None:
    """Keep the runs as JSON."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps({"machine": machine, "runs": [asdict(run) for run in runs]}, indent=1))


def load(file: Path) -> tuple[str, list[Run]]:
    """Return the machine and the runs of a file."""
    kept = json.loads(file.read_text())
    return kept["machine"], [Run(**run) for run in kept["runs"]]
