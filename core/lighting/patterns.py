# SPDX-License-Identifier: GPL-3.0-or-later
"""What a lamp shines into each direction: a slide before a spot light, or the measured light of a luminaire (IES)."""

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Pattern:
    """A picture about a lamp, by rings round its axis.

    Attributes
    ----------
    to_lamp : ndarray of shape (3, 3)
        Turns world directions into the lamp's own, whose axis is -z.
    widest : float
        Angle between the axis and where the picture ends [rad]; beyond it shines what is at its rim.
    picture : ndarray of shape (t, p, 3)
        At the middles of t rings and p sectors, the first of which begins at x: what the light is multiplied with.
    """

    to_lamp: FloatArray
    widest: float
    picture: FloatArray

    def share(self, out: FloatArray) -> FloatArray:
        """Return what light that leaves in directions is multiplied with, shape (n, 3); those may be of any length."""
        own = out @ self.to_lamp.T
        rings, sectors, _ = self.picture.shape
        tilt = np.arctan2(np.hypot(own[:, 0], own[:, 1]), -own[:, 2])
        turn = np.arctan2(own[:, 1], own[:, 0]) / (2 * np.pi)
        ring = np.clip(tilt / self.widest * rings - 0.5, 0, rings - 1)
        sector = turn * sectors - 0.5
        inner, left = np.floor(ring).astype(np.int64), np.floor(sector).astype(np.int64)
        outwards, onwards = (ring - inner)[:, None], (sector - left)[:, None]
        outer = np.minimum(inner + 1, rings - 1)

        def along(at: IntArray) -> FloatArray:
            first, second = self.picture[at, left % sectors], self.picture[at, (left + 1) % sectors]
            return np.asarray(first + onwards * (second - first))

        nearer, farther = along(inner), along(outer)
        return np.asarray(nearer + outwards * (farther - nearer))


def pattern_directions(rings: int, sectors: int, widest: float) -> tuple[FloatArray, FloatArray]:
    """Return the lamp's own directions that a picture tells, and the solid angles that each stands for.

    Parameters
    ----------
    rings, sectors : int
    widest : float
        As in `Pattern`.

    Returns
    -------
    directions : ndarray of shape (rings, sectors, 3)
        Unit length.
    solid : ndarray of shape (rings, sectors)
        [sr].
    """
    tilt = ((np.arange(rings) + 0.5) / rings * widest)[:, None]
    turn = ((np.arange(sectors) + 0.5) / sectors * 2 * np.pi)[None]
    sides = np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn)
    edges = np.cos(np.arange(rings + 1) / rings * widest)
    solid = np.broadcast_to((-np.diff(edges) * 2 * np.pi / sectors)[:, None], (rings, sectors))
    return np.stack((*sides, np.broadcast_to(-np.cos(tilt), (rings, sectors))), axis=-1), solid
