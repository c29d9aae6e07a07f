# SPDX-License-Identifier: GPL-3.0-or-later
"""Which elements rays meet first: what a receiver sees, told without asking for all that it might see."""

from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ..occlusion.single_rays import SingleRays, single_rays
from ..occlusion.surfaces import loose_polygons
from .tree import Float, Int


class ElementHits:
    """Rays against elements.

    Parameters
    ----------
    corners : ndarray of shape (n, 4, 3)
        Of the elements [m].
    blocks : ndarray of shape (n,)
        Which of them are of surfaces that block.

    Attributes
    ----------
    blocks : ndarray of shape (n,)
    """

    def __init__(self, corners: Float, blocks: NDArray[np.bool_]) -> None:
        self._corners, self.blocks = corners, blocks
        self._making = Lock()
        self._made: tuple[SingleRays, Int, Int] | None = None

    def _sheets(self) -> tuple[SingleRays, Int, Int]:
        """Return what rays meet, the element that each sheet of it is, and the one on its other side, -1 for none."""
        # Whoever asks first makes them, and the others wait.
        with self._making:
            if self._made is None:
                which = np.flatnonzero(self.blocks)
                first, other = _both_sides(self._corners[which])
                element = which[first]
                rays = single_rays(loose_polygons(self._corners[element]))
                self._made = rays, element, np.append(which, -1)[other]
            return self._made

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
        rays, element, other = self._sheets()
        sheet, distance, front = rays.any_nearest(origins, ways)
        found = np.where(front, np.append(element, -1)[sheet], np.append(other, -1)[sheet])
        return found, distance


def _both_sides(corners: Float) -> tuple[Int, Int]:
    """Return the first of all polygons that have the same corners, and another one of them, -1 for none."""
    order = np.lexsort(corners.reshape(-1, 3).T)
    ordered = corners.reshape(-1, 3)[order]
    number = np.zeros(len(order), np.int64)
    number[order[1:]] = np.cumsum((ordered[1:] != ordered[:-1]).any(axis=1))
    vertex = number.reshape(-1, 4)
    # A triangle has the same corners whichever it repeats.
    vertex[vertex[:, 3] == vertex[:, 2], 3] = -1
    vertex.sort(axis=1)
    order = np.lexsort(vertex.T)
    again = np.append(False, (vertex[order[1:]] == vertex[order[:-1]]).all(axis=1))[: len(order)]
    first = order[~again]
    other = np.full(len(first), -1)
    other[(np.cumsum(~again) - 1)[again]] = order[again]
    return first, other
