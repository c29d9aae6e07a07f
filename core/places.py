# SPDX-License-Identifier: GPL-3.0-or-later
"""Places: vertices that lie on each other, to the last bit."""

import numpy as np

from .arrays import FloatArray, IntArray

# Odd numbers of 64 bits that make one number of three coordinates (the primes of xxHash).
_MIXERS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)


def places(points: FloatArray) -> IntArray:
    """Return the first point at the place of each; sorting mixed bits is faster than sorting coordinates.

    Parameters
    ----------
    points : ndarray of shape (v, 3)
        [m].

    Returns
    -------
    ndarray of shape (v,)
        Its own number for every point that lies alone.
    """
    # Minus zero is where zero is.
    bits = (points + 0.0).view(np.uint64).reshape(-1, 3)
    mixed = np.zeros(len(bits), dtype=np.uint64)
    for coordinate, mixer in zip(bits.T, _MIXERS, strict=True):
        # Round numbers differ in their upper bits only; products carry upwards, so these come down in between.
        mixed = (mixed ^ coordinate) * mixer
        mixed ^= mixed >> np.uint64(32)
    order = np.argsort(mixed, kind="stable")
    begin = np.ones(len(order), dtype=np.bool_)
    begin[1:] = mixed[order][1:] != mixed[order][:-1]
    leader = order[np.flatnonzero(begin)][np.cumsum(begin) - 1]
    # Points that only seem to be at the same place stay apart.
    equal = (points[order] == points[leader]).all(axis=1)
    place = np.arange(len(order))
    place[order[equal]] = leader[equal]
    return place
