# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs: groups of items that lie one after the other in an array."""

import numpy as np

from .arrays import IntArray


def counted(count: IntArray, first: IntArray | None = None) -> tuple[IntArray, IntArray]:
    """Return for each item of some runs, laid end to end, the run that it belongs to and its place.

    Parameters
    ----------
    count : ndarray of shape (n,)
        Items of each run.
    first : ndarray of shape (n,), optional
        Where each run begins: places are counted from there, otherwise within each run from 0.

    Returns
    -------
    run, place : ndarray of shape (sum of `count`,)
    """
    run = np.repeat(np.arange(len(count)), count)
    begin = np.cumsum(count) - count
    return run, np.arange(len(run)) - np.repeat(begin if first is None else begin - first, count)
