# SPDX-License-Identifier: GPL-3.0-or-later
"""What hangs together in a graph."""

import numpy as np

from ..arrays import IntArray


def connected(one: IntArray, other: IntArray, count: int) -> IntArray:
    """Return for each of so many nodes the least one that it is connected to by edges.

    Trees that know only their root hook on to the least neighbour of any of their nodes, until none has neighbours:
    a few rounds, whatever the shape (Shiloach, Vishkin 1982).
    """
    root = np.arange(count)
    while True:
        one, other = root[one], root[other]
        apart = one != other
        if not apart.any():
            return root
        one, other = one[apart], other[apart]
        low, high = np.minimum(one, other), np.maximum(one, other)
        order = np.lexsort((low, high))
        low, high = low[order], high[order]
        least = np.append(True, high[1:] != high[:-1])
        root[high[least]] = low[least]
        while True:
            above = root[root]
            if np.array_equal(above, root):
                break
            root = above
