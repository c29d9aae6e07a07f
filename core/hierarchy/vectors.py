# SPDX-License-Identifier: GPL-3.0-or-later
"""Products of many vectors in rows of three, column by column: several times as fast as sums along an axis of three."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .tree import Float

Real = TypeVar("Real", NDArray[np.float64], NDArray[np.float32])


def dots(a: Real, b: Real) -> Real:
    """Return the dot products of vectors, (k, 3) and (k, 3) to (k,)."""
    product = a[:, 0] * b[:, 0]
    product += a[:, 1] * b[:, 1]
    product += a[:, 2] * b[:, 2]
    return product


def crosses(a: Float, b: Float) -> Float:
    """Return the cross products of vectors, (k, 3) and (k, 3) to (k, 3)."""
    turns = ((1, 2), (2, 0), (0, 1))
    return np.stack([a[:, one] * b[:, other] - a[:, other] * b[:, one] for one, other in turns], axis=1)
