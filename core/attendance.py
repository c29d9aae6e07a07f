# SPDX-License-Identifier: GPL-3.0-or-later
"""Attendance: a computation in a thread of its own, so that whoever waits for a long step hears that it goes on.

A step that takes half a minute would keep a window from being drawn, and from being told to cancel, as long.
"""

from __future__ import annotations

from collections.abc import Generator
from contextvars import copy_context
from dataclasses import replace
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Generic

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
    aside, last = _Aside(steps), Progress(stage, 0.0)
    try:
        while True:
            aside.ask()
            while aside.busy:
                if not aside.wait(every):
                    yield last
            step = aside.answer()
            if step is None:
                return aside.result
            yield step
            # The solution so far is its owner's again.
            last = replace(step, radiosity=None, memory=0)
    finally:
        aside.leave()


class _Aside(Generic[T]):
    """A generator that another thread advances, a step each time that it is asked."""

    result: T

    def __init__(self, steps: Generator[Progress, None, T]) -> None:
        self.busy = False
        self._steps = steps
        self._asked: SimpleQueue[bool] = SimpleQueue()
        self._answers: SimpleQueue[Progress | BaseException | None] = SimpleQueue()
        self._answer: Progress | BaseException | None = None
        # What NumPy does about errors is a matter of the context.
        self._thread = Thread(target=copy_context().run, args=(self._run,), name="Radiosity", daemon=True)
        self._thread.start()

    def ask(self) -> None:
        """Let the next step begin."""
        self.busy = True
        self._asked.put(True)

    def wait(self, most: float) -> bool:
        """Wait for the step for a while [s], and tell whether it is done."""
        try:
            self._answer = self._answers.get(timeout=most)
        except Empty:
            return False
        self.busy = False
        return True

    def answer(self) -> Progress | None:
        """Return the step, None after the last one; raise what went wrong."""
        answer, self._answer = self._answer, None
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def leave(self) -> None:
        """Close the computation: now, or when the step that it is in is done."""
        self._asked.put(False)
        if not self.busy:
            self._thread.join()

    def _run(self) -> None:
        while self._asked.get():
            try:
                self._answers.put(next(self._steps))
            except StopIteration as end:
                self.result = end.value
                self._answers.put(None)
            except BaseException as error:
                self._answers.put(error)
        self._steps.close()
