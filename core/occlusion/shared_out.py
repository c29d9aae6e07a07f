# SPDX-License-Identifier: GPL-3.0-or-later
"""Segments shared out among workers: what is asked at once about a whole scene."""

from __future__ import annotations

from concurrent.futures import Executor
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..workers import in_order

if TYPE_CHECKING:
    from ..visibility import Surroundings

# Segments that a worker is asked at a time: as many as go down a tree together, or so many parts of fewer.
_PART, _PARTS, _LEAST = 1 << 17, 4, 1 << 13
# Parts that are asked ahead of the one that is waited for.
_AHEAD = 8


class SharedOut:
    """Surroundings that workers are asked about; nobody among these may ask it, for they would wait for each other.

    Parameters
    ----------
    surroundings : Surroundings
        Who knows.
    workers : concurrent.futures.Executor
        Who asks; the answers do not depend on it.
    """

    def __init__(self, surroundings: Surroundings, workers: Executor) -> None:
        self._surroundings, self._workers = surroundings, workers

    def blocked(self, origins: FloatArray, targets: FloatArray) -> BoolArray:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        size = min(_PART, max(_LEAST, -(-len(origins) // _PARTS)))
        if len(origins) <= size:
            return self._surroundings.blocked(origins, targets)

        def ask(first: int) -> BoolArray:
            part = slice(first, first + size)
            return self._surroundings.blocked(origins[part], targets[part])

        return np.concatenate(list(in_order(self._workers, ask, range(0, len(origins), size), _AHEAD)))

    def nearest(self, origins: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return face, distance and side of what rays hit first; see `BruteForceOccluders.nearest`."""
        return self._surroundings.nearest(origins, directions)
