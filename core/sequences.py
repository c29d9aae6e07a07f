# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences of numbers that fill an interval, a square or a cube evenly, however many of them are taken.

Multiples of an irrational number, modulo one: additive recurrences. Those of the golden ratio spread best along a line,
those of the plastic number in a square. They stand in for random numbers, and the same come every time.

References
----------
M. Roberts, The unreasonable effectiveness of quasirandom sequences, 2018.
"""

import numpy as np

from .arrays import FloatArray

# The reciprocal of the golden ratio, the root of x^2 = x + 1.
GOLDEN = 0.6180339887498949
# Those of the plastic number, the root of x^3 = x + 1, and of its square.
PLASTIC = (0.7548776662466927, 0.5698402909980532)


def spread_points(count: int, axes: int) -> FloatArray:
    """Return points that fill a unit cube evenly: the recurrence of the golden ratio of so many axes.

    Parameters
    ----------
    count : int
        How many.
    axes : int
        Of how many numbers each.

    Returns
    -------
    ndarray of shape (axes, count)
    """
    # The positive root of x^(axes + 1) = x + 1.
    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (axes + 1))
    steps = ratio ** -np.arange(1.0, axes + 1)
    return np.asarray((0.5 + np.outer(steps, np.arange(count))) % 1.0)
