# SPDX-License-Identifier: GPL-3.0-or-later
"""Which elements rays meet first: what a receiver sees, told without asking for all that it might see.

What blocks knows no elements: there flat faces are joined, and two sides are one.
"""

from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..occlusion.core_part import core_part
from ..occlusion.single_rays import SingleRays, single_rays
from ..occlusion.surfaces import MARGIN, loose_polygons
from ..places import places
from .tree import Float, Int

# Two sides of one sheet that are cut differently are met at one place, up to this share of the scene's size.
_SAME = 2 * MARGIN


class Sheets(NamedTuple):
    """Elements, one for both sides of a sheet where those are cut alike."""

    rays: SingleRays
    element: Int  # (s,)
    other: Int  # (s,), on the other side, -1 for none

    def met(self, origins: Float, ways: Float) -> tuple[Int, Float]:
        """Return what rays meet, see `ElementHits.met`."""
        sheet, distance, front = self.rays.any_nearest(origins, ways)
        # Nothing is the last.
        found = np.where(front, np.append(self.element, -1)[sheet], np.append(self.other, -1)[sheet])
        return found, distance


class ElementHits:
    """Rays against elements.

    Parameters
    ----------
    corners : ndarray of shape (n, 4, 3)
        Of the elements [m].
    face : ndarray of shape (n,)
        The face of the scene that each is a part of.
    side : ndarray of shape (n,)
        1 on its front, -1 on its back.
    blocks : ndarray of shape (n,), optional
        Which of them are of surfaces that block; all when not given.

    Attributes
    ----------
    blocks : ndarray of shape (n,)
    """

    def __init__(
        self, corners: Float, face: Int, side: NDArray[np.int8], blocks: NDArray[np.bool_] | None = None
    ) -> None:
        self._corners, self._face, self._side = corners, face, side
        self.blocks = np.ones(len(corners), bool) if blocks is None else blocks
        self._same = _SAME * core_part(corners.min(axis=1), corners.max(axis=1)).size
        self._making = Lock()
        self._made: list[Sheets] | None = None

    def met(self, origins: Float, ways: Float) -> tuple[Int, Float]:
        """Return what rays meet first.

        Parameters
        ----------
        origins, ways : ndarray of shape (m, 3)
            [m]; unit length. What the origin lies on is not met.

        Returns
        -------
        element : ndarray of shape (m,)
            -1 where none is met, or one from behind.
        distance : ndarray of shape (m,)
            Infinite where nothing is met [m].
        """
        first, *more = self._sheets()
        element, distance = first.met(origins, ways)
        for sheets in more:
            another, there = sheets.met(origins, ways)
            # A side that faces the ray is before one at the same place that does not.
            nearer = there - self._same * (another >= 0) < distance - self._same * (element >= 0)
            element, distance = np.where(nearer, another, element), np.where(nearer, there, distance)
        return element, distance

    def _sheets(self) -> list[Sheets]:
        """Return everything that blocks, and by themselves backs that are not cut as their fronts are."""
        # Whoever asks first makes them, and the others wait.
        with self._making:
            if self._made is None:
                which = np.flatnonzero(self.blocks)
                first, other = _both_sides(self._corners[which])
                element, other = which[first], np.append(which, -1)[other]
                back, alone = self._side[element] < 0, other < 0
                apart = alone & back & np.isin(self._face[element], self._face[element[alone & ~back]])
                parts = (~apart, apart) if apart.any() else (~apart,)
                self._made = [self._grown(element[part], other[part]) for part in parts]
            return self._made

    def _grown(self, element: Int, other: Int) -> Sheets:
        return Sheets(single_rays(loose_polygons(self._corners[element])), element, other)


def _both_sides(corners: Float) -> tuple[Int, Int]:
    """Return the first of all polygons that have the same corners, and another one of them, -1 for none."""
    vertex = places(corners.reshape(-1, 3)).reshape(-1, 4)
    # A triangle has the same corners whichever it repeats.
    vertex[vertex[:, 3] == vertex[:, 2], 3] = -1
    vertex.sort(axis=1)
    order = np.lexsort(vertex.T)
    again = np.append(False, (vertex[order[1:]] == vertex[order[:-1]]).all(axis=1))[: len(order)]
    first = order[~again]
    other = np.full(len(first), -1)
    other[(np.cumsum(~again) - 1)[again]] = order[again]
    return first, other
