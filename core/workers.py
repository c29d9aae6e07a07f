# SPDX-License-Identifier: GPL-3.0-or-later
"""Work shared out among workers: results come in order, whoever finishes first."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from typing import TypeVar

S = TypeVar("S")
R = TypeVar("R")


def in_order(workers: Executor, compute: Callable[[S], R], items: Iterable[S], most: int) -> Iterator[R]:
    """Compute something of every item and yield the results in order.

    Parameters
    ----------
    workers : concurrent.futures.Executor
    compute : callable
    items : iterable
    most : int
        Items that are computed ahead of the one that is waited for.

    Yields
    ------
    object
        What `compute` returns. Closing the iterator cancels what has not begun.
    """
    ahead: deque[Future[R]] = deque()
    try:
        for item in items:
            ahead.append(workers.submit(compute, item))
            if len(ahead) > most:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()
    finally:
        for future in ahead:
            future.cancel()
