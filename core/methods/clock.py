# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the stages of a method take."""

import time
from collections import defaultdict
from collections.abc import Generator

from ..progress import Progress, T


class Clock:
    """Tells how long each stage of some generators of progress takes, by what they yield."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)

    def watch(self, steps: Generator[Progress, None, T]) -> Generator[Progress, None, T]:
        """Pass on what `steps` yields, and return what it returns; closing this closes `steps`."""
        stage, begun = "", time.perf_counter()
        try:
            while True:
                try:
                    progress = next(steps)
                except StopIteration as end:
                    result: T = end.value
                    return result
                finally:
                    now = time.perf_counter()
                    elapsed, begun = now - begun, now
                    self.seconds[stage] += elapsed
                # A stage is named by the first progress within it, which comes after some work.
                if progress.stage.lower() != stage:
                    self.seconds[stage] -= elapsed
                    stage = progress.stage.lower()
                    self.seconds[stage] += elapsed
                yield progress
        finally:
            steps.close()
