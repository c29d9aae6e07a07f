# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines that turn right or have holes, filled with few trapezoids.

They are cut level between the heights at which their borders have corners; what lies between the same two borders at
several heights is one trapezoid.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import FloatArray, IntArray

# Borders whose angles differ by no more run the same way.
_SAME_ANGLE = 1e-4


def trapezoids(start: FloatArray, end: FloatArray, tolerance: float) -> FloatArray:
    """Fill an outline with trapezoids, rectangles wherever its borders allow.

    Parameters
    ----------
    start, end : ndarray of shape (e, 2)
        Ends of the border's edges, the inside on their left. Holes are borders like any other.
    tolerance : float
        Corners whose heights differ by less count as level [unit of the ends].

    Returns
    -------
    ndarray of shape (t, 4, 2)
        Counter-clockwise; where two borders meet, two corners are the same.
    """
    # A wall is cut into rectangles when an axis runs along most of its border; which of the two, is tried.
    span = end - start
    angle = np.arctan2(span[:, 1], span[:, 0]) % (0.5 * np.pi)
    _, first, alike = np.unique(np.round(angle / _SAME_ANGLE), return_index=True, return_inverse=True)
    most = angle[first[np.argmax(np.bincount(alike, weights=np.linalg.norm(span, axis=1)))]]
    across = np.array([np.cos(most), np.sin(most)])
    upright = np.array([across, [-across[1], across[0]]])
    lying = np.array([upright[1], -across])
    cuts = [
        np.array(list(_between_levels(start @ axes.T, end @ axes.T, tolerance))).reshape(-1, 4, 2) @ axes
        for axes in (upright, lying)
    ]
    return min(cuts, key=len)


def _between_levels(start: FloatArray, end: FloatArray, tolerance: float) -> Iterator[FloatArray]:
    """Yield trapezoids with level bottom and top, each as high as its two borders go on."""
    height = np.sort(np.concatenate([start[:, 1], end[:, 1]]))
    levels = height[np.concatenate([[True], np.diff(height) > tolerance])]
    # A height belongs to the last level that is not above it.
    low, high = (np.searchsorted(levels, ends[:, 1], side="right") - 1 for ends in (start, end))
    grown: dict[tuple[int, int], int] = {}
    for level in range(len(levels) - 1):
        crossing = np.flatnonzero((np.minimum(low, high) <= level) & (np.maximum(low, high) > level))
        middle = 0.5 * (levels[level] + levels[level + 1])
        order = crossing[np.argsort(_at(start, end, crossing, middle), kind="stable")]
        # Upward borders have the inside on their left: left borders run down, right ones up, in turns.
        pairs = {(int(a), int(b)) for a, b in zip(order[0::2], order[1::2], strict=False)}
        for pair in [pair for pair in grown if pair not in pairs]:
            yield _trapezoid(start, end, pair, levels[grown.pop(pair)], levels[level])
        for pair in sorted(pairs - grown.keys()):
            grown[pair] = level
    for pair, level in grown.items():
        yield _trapezoid(start, end, pair, levels[level], levels[-1])


def _at(start: FloatArray, end: FloatArray, edge: IntArray, height: float) -> FloatArray:
    """Return where edges cross a height."""
    a, b = start[edge], end[edge]
    share = np.clip((height - a[:, 1]) / (b[:, 1] - a[:, 1]), 0.0, 1.0)
    return np.asarray(a[:, 0] + share * (b[:, 0] - a[:, 0]))


def _trapezoid(start: FloatArray, end: FloatArray, pair: tuple[int, int], bottom: float, top: float) -> FloatArray:
    """Return the corners between two borders and two heights, counter-clockwise."""
    left, right = (np.array([edge]) for edge in pair)
    a, b = _at(start, end, left, bottom)[0], _at(start, end, right, bottom)[0]
    c, d = _at(start, end, right, top)[0], _at(start, end, left, top)[0]
    return np.array([[a, bottom], [b, bottom], [c, top], [d, top]])
