# SPDX-License-Identifier: GPL-3.0-or-later
"""Attendance: a computation in a thread of its own, so that whoever waits for a long step hears that it goes on.

A step that takes half a minute would keep a window from being drawn, and from being told to cancel, as long.
"""

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor, wait
from contextvars import copy_context
from dataclasses import replace
from typing import Any

from .progress import Progress, T

# How long a step may take until its last progress is told once more [s].
EVERY = 0.05


def attended(steps: Generator[Progress, None, T], stage: str, every: float = EVERY) -> Generator[Progress, None, T]:
    """Run a computation aside, and pass on its steps; of a long one tell again and again where it is.

    Parameters
    ----------
    steps : generator of Progress
        Advanced in another thread, when it is asked for a step and never ahead.
    stage : str
        What is told until the first step is done.
    every : float
        How often something is told at least [s].

    Yields
    ------
    Progress

    Returns
    -------
    object
        What the computation returns. Closing this in the middle of a step does not wait for it: the computation is
        closed at its end.
    """

    def advance() -> tuple[Progress | None, Any]:
        try:
            return next(steps), None
        except StopIteration as end:
            return None, end.value

    # What NumPy does about errors is a matter of the context.
    aside, context, last = ThreadPoolExecutor(1, "Radiosity"), copy_context(), Progress(stage, 0.0)
    idle = True
    try:
        while True:
            ahead, idle = aside.submit(context.run, advance), False
            while wait([ahead], every).not_done:
                yield last
            idle = True
            step, result = ahead.result()
            if step is None:
                value: T = result
                return value
            yield step
            # The solution so far is its owner's again.
            last = replace(step, radiosity=None, memory=0)
    finally:
        aside.submit(steps.close)
        aside.shutdown(wait=idle)
