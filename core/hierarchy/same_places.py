# SPDX-License-Identifier: GPL-3.0-or-later
"""Who else is where a corner of a mesh is: the receivers of other surfaces at the same place."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..meshing import Patches
from ..places import places
from ..scene import Scene
from .glances import Corners
from .tree import Int


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Which receiver stands for a patch at the place of another receiver.

    Attributes
    ----------
    place : ndarray of shape (q,)
        Number of the place of each receiver: the same for all that stand for corners there.
    key, receiver : ndarray of shape (t,)
        Place and patch in one number, ascending, and who stands for that patch there.
    patches : int
        How many there are.
    """

    place: Int
    key: Int
    receiver: Int
    patches: int

    def of(self, receiver: Int, patch: Int) -> Int:
        """Return who stands for patches at the places of receivers, pair by pair, shape (k,); -1 for nobody."""
        wanted = self.place[receiver] * self.patches + patch
        found = np.minimum(np.searchsorted(self.key, wanted), len(self.key) - 1)
        known: Int = np.where(self.key[found] == wanted, self.receiver[found], -1)
        return known


def corner_places(scene: Scene, corners: Corners) -> tuple[Int, Int]:
    """Return numbers for the places where corners of a mesh are, whatever vertices they belong to.

    Parameters
    ----------
    scene : Scene
    corners : Corners
        Its receivers.

    Returns
    -------
    of_corner : ndarray of shape (c,)
        Place of each of the scene's corners.
    of_receiver : ndarray of shape (q,)
    """
    of_corner = places(scene.vertices)[scene.corner_vertex]
    of_receiver = np.zeros(len(corners.point), np.int64)
    of_receiver[corners.group] = of_corner
    return of_corner, of_receiver


def at_edges(scene: Scene, corners: Corners) -> NDArray[np.bool_]:
    """Return which receivers share their place with another surface's, shape (q,); see `corner_places`."""
    _, place = corner_places(scene, corners)
    edge: NDArray[np.bool_] = np.bincount(place)[place] > 1
    return edge


def neighbours(scene: Scene, corners: Corners, patches: Patches) -> Neighbours:
    """Find out which corners of a mesh are at the same place; parameters as for `meetings.find_meetings`."""
    at, place = corner_places(scene, corners)
    key = at[patches.touch_corner] * len(patches.area) + patches.touch_patch
    order = np.argsort(key, kind="stable")
    return Neighbours(place, key[order], corners.group[patches.touch_corner[order]], len(patches.area))
