# SPDX-License-Identifier: GPL-3.0-or-later
"""What light takes on of clear surfaces on its way: the tint of the panes that a segment goes through."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import BoolArray, FloatArray
from .single_rays import single_rays
from .surfaces import separate_polygons

if TYPE_CHECKING:
    from ..scene import Scene

# Panes on one way, at most, and tints that are worth asking for.
_DEEPEST = 16
_CLEAR = 0.99
# Faces that are asked one ray after the other: leaves of many thousands are as good as clear.
_MOST = 20_000


class Panes:
    """Surfaces that light goes through, and takes on color.

    Parameters
    ----------
    scene : Scene
    chosen : ndarray of shape (f,)
        The faces.
    """

    def __init__(self, scene: Scene, chosen: BoolArray) -> None:
        self._tint = scene.tint
        self._tree = single_rays(separate_polygons(scene, chosen))

    def tint(self, origins: FloatArray, targets: FloatArray) -> FloatArray:
        """Return what light is multiplied with on segments.

        Parameters
        ----------
        origins, targets : ndarray of shape (m, 3)
            [m].

        Returns
        -------
        ndarray of shape (m, 3)
            The product of all panes in between.
        """
        tint = np.ones((len(origins), 3))
        way = targets - origins
        length = np.linalg.norm(way, axis=1)
        way /= np.maximum(length, 1e-300)[:, None]
        gone, left = np.zeros(len(origins)), np.flatnonzero(length > 0.0)
        for _ in range(_DEEPEST):
            if not len(left):
                break
            # Where a ray starts in the plane of a pane, that one is behind it.
            face, distance, _ = self._tree.nearest(origins[left] + gone[left, None] * way[left], way[left])
            met = gone[left] + distance < length[left]
            left, face = left[met], face[met]
            gone[left] += distance[met]
            tint[left] *= self._tint[face]
        return tint


def find_panes(scene: Scene, blocking: BoolArray) -> Panes | None:
    """Return the panes of a scene.

    Parameters
    ----------
    scene : Scene
    blocking : ndarray of shape (f,)
        Faces that light does not go through.

    Returns
    -------
    Panes or None
        None where there is nothing that light takes on color from.
    """
    chosen = scene.live & ~blocking & (scene.tint < _CLEAR).any(axis=1)
    return Panes(scene, chosen) if 0 < np.count_nonzero(chosen) <= _MOST else None
