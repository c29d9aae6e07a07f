# SPDX-License-Identifier: GPL-3.0-or-later
"""Which elements rays meet first: what a receiver sees, told without asking for all that it might see."""

from functools import cached_property

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

    @cached_property
    def _sheets(self) -> tuple[SingleRays, Int, Int]:
        """Return what rays meet, the element that each sheet of it is, and the one on its other side, -1 for none.

        Made when it is first asked for; two threads may do this at a time, and both get the same.
        """
        which = np.flatnonzero(self.blocks)
        # Both sides of a sheet have the same corners.
        _, vertex = np.unique(self._corners[which].reshape(-1, 3), axis=0, return_inverse=True)
        vertex = vertex.reshape(-1, 4)
        vertex[vertex[:, 3] == vertex[:, 2], 3] = -1
        _, sheet = np.unique(np.sort(vertex, axis=1), axis=0, return_inverse=True)
        order = np.argsort(sheet.reshape(-1), kind="stable")
        again = np.diff(sheet.reshape(-1)[order], prepend=-1) == 0
        first = order[~again]
        other = np.full(len(first), -1)
        turn = np.cumsum(~again) - 1
        other[turn[again]] = which[order[again]]
        element = which[first]
        return single_rays(loose_polygons(self._corners[element])), element, other

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
        rays, element, other = self._sheets
        sheet, distance, front = rays.any_nearest(origins, ways)
        found = np.where(front, np.append(element, -1)[sheet], np.append(other, -1)[sheet])
        return found, distance
