# SPDX-License-Identifier: GPL-3.0-or-later
"""What a long computation yields while it runs: every step of a bake is a generator of `Progress`.

The modal operator steps such a generator, the command exhausts it, a test looks inside, closing it cancels.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from typing import TypeVar

from .arrays import FloatArray

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Progress:
    """One moment of a bake.

    Attributes
    ----------
    stage : str
        What is being done, in words for the user ("Form factors").
    fraction : float
        How much of this stage is done, 0 to 1.
    iteration : int
        Sweeps or shots done so far; 0 outside a solver.
    residual : float
        Largest relative change of the last sweep; NaN outside a solver.
    unshot : float
        Unshot energy over emitted energy; NaN outside a solver.
    radiosity : ndarray of shape (n, 3) or None
        The solution so far, for display [W/m^2]; a solver's own array: read, do not write or keep.
    memory : int
        What the links of this stage will take, told before the first is kept; 0 when not known [bytes].
    """

    stage: str
    fraction: float
    iteration: int = 0
    residual: float = float("nan")
    unshot: float = float("nan")
    radiosity: FloatArray | None = None
    memory: int = 0


def exhaust(steps: Generator[Progress, None, T]) -> T:
    """Run a generator of progress to its end and return its result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: T = end.value
            return result


def told(steps: Generator[Progress, None, T], tell: Callable[[Progress], Progress]) -> Generator[Progress, None, T]:
    """Run a computation as a part of another one, and tell its steps in other words; closing this closes it."""
    try:
        while True:
            try:
                step = next(steps)
            except StopIteration as end:
                result: T = end.value
                return result
            yield tell(step)
    finally:
        steps.close()


def within(stage: str, steps: Generator[Progress, None, T]) -> Generator[Progress, None, T]:
    """Tell the steps of a computation as parts of a stage."""
    return told(steps, lambda step: replace(step, stage=f"{stage}: {step.stage.lower()}"))


def renamed(steps: Generator[Progress, None, T], stage: str) -> Generator[Progress, None, T]:
    """Let steps be part of one stage; what they show so far is too rough to be shown."""
    return told(steps, lambda _: Progress(stage, 1.0))


def scaled(steps: Generator[Progress, None, T], first: float, last: float) -> Generator[Progress, None, T]:
    """Let steps be a part of their stage, from one share of it to another."""
    return told(steps, lambda step: replace(step, fraction=first + (last - first) * step.fraction))
