# SPDX-License-Identifier: GPL-3.0-or-later
"""What light takes on of clear surfaces on its way: the tint of the panes that a segment goes through.

Of light that comes to the surface of glass, a part is reflected, the more the flatter it comes (Fresnel's equations).
What is reflected is not followed, and light goes on without being bent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import BoolArray, FloatArray
from .sieve import unnoticed
from .single_rays import single_rays
from .streams import StreamOccluders
from .surfaces import separate_polygons

if TYPE_CHECKING:
    from ..scene import Scene

# Panes on one way, at most; tints and indices of refraction that are worth asking for.
_DEEPEST = 16
_CLEAR, _DENSE = 0.99, 1.01
# Faces that are asked one ray after the other: leaves of many thousands are as good as clear.
_MOST = 100_000


class Panes:
    """Surfaces that light goes through, and takes on color.

    Parameters
    ----------
    scene : Scene
    chosen : ndarray of shape (f,)
        The faces.

    Attributes
    ----------
    solid : ndarray of shape (f,)
        Share of each face of the scene that scatters light, as a screen of the same color does that has holes.
    """

    def __init__(self, scene: Scene, chosen: BoolArray) -> None:
        self._tint, self._ior, self._normal = scene.tint, scene.ior, scene.face_normal
        # What is noticed is there itself, where light does not go through.
        self.solid = np.where(chosen & ~unnoticed(scene), 1.0 - scene.tint.mean(axis=1), 1.0)
        panes = separate_polygons(scene, chosen)
        self._tree, self._stream = single_rays(panes), StreamOccluders(panes)

    def tint(self, origins: FloatArray, targets: FloatArray) -> FloatArray:
        """Return what light is multiplied with on segments.

        Parameters
        ----------
        origins, targets : ndarray of shape (m, 3)
            Receivers, and where their light comes from [m].

        Returns
        -------
        ndarray of shape (m, 3)
            The product of all panes in between.
        """
        return self.through(origins, targets)[0]

    def through(self, origins: FloatArray, targets: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what light is multiplied with on segments, and what is left of the place that it comes from.

        Parameters
        ----------
        origins, targets
            See `tint`.

        Returns
        -------
        tint : ndarray of shape (m, 3)
        left : ndarray of shape (m,)
            Share of the view that screens in between do not fill themselves.
        """
        tint, left = np.ones((len(origins), 3)), np.ones(len(origins))
        crossing = np.flatnonzero(self._stream.blocked(origins, targets))
        if len(crossing):
            tint[crossing], left[crossing] = self._gathered(origins[crossing], targets[crossing])
        return tint, left

    def _gathered(self, origins: FloatArray, targets: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the same of segments that go through panes, from one to the next."""
        tint, open_share = np.ones((len(origins), 3)), np.ones(len(origins))
        way = targets - origins
        length = np.linalg.norm(way, axis=1)
        way /= np.maximum(length, 1e-300)[:, None]
        gone, left = np.zeros(len(origins)), np.flatnonzero(length > 0.0)
        # In how many things of glass the way is.
        inside = np.zeros(len(origins), dtype=np.int64)
        for _ in range(_DEEPEST):
            if not len(left):
                break
            # Where a ray starts in the plane of a pane, that one is behind it.
            face, distance, front = self._tree.nearest(origins[left] + gone[left, None] * way[left], way[left])
            met = gone[left] + distance < length[left]
            left, face, front = left[met], face[met], front[met]
            gone[left] += distance[met]
            # Leaving what was entered before mirrors as much as entering it does; leaving what was not, at an open
            # sheet or from within, is as steep a step out of glass as Blender makes of it.
            out = ~front & (inside[left] == 0)
            inside[left] += np.where(front, 1, np.where(out, 0, -1))
            ior = np.where(out, 1.0 / self._ior[face], self._ior[face])
            cosine = np.abs((self._normal[face] * way[left]).sum(axis=1))
            tint[left] *= self._tint[face] * (1.0 - reflected_share(cosine, ior))[:, None]
            open_share[left] *= np.where(self.solid[face] < 1.0, 1.0 - self.solid[face], 1.0)
        return tint, open_share


def reflected_share(cosine: FloatArray, ior: FloatArray) -> FloatArray:
    """Return the share of unpolarized light that the surface of something clear reflects (Fresnel).

    Parameters
    ----------
    cosine : ndarray of shape (n,)
        Of the angle between light and normal, 0 to 1.
    ior : ndarray of shape (n,)
        Index of refraction behind the surface over that before it.

    Returns
    -------
    ndarray of shape (n,)
        1 where all is reflected, at flat angles where the index falls.
    """
    bent = 1.0 - (1.0 - cosine**2) / ior**2
    beyond = np.sqrt(np.maximum(bent, 0.0))
    across, along = cosine + ior * beyond, ior * cosine + beyond
    s, p = (cosine - ior * beyond) / np.maximum(across, 1e-12), (ior * cosine - beyond) / np.maximum(along, 1e-12)
    return np.where(bent > 0.0, 0.5 * (s**2 + p**2), 1.0)


def ior_of(reflected: FloatArray) -> FloatArray:
    """Return the index of refraction of what reflects a share of light that comes straight down, below 1."""
    root = np.sqrt(np.clip(reflected, 0.0, 0.9))
    return np.asarray((1.0 + root) / (1.0 - root))


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
    chosen = scene.live & ~blocking & ((scene.tint < _CLEAR).any(axis=1) | (scene.ior > _DENSE))
    return Panes(scene, chosen) if 0 < np.count_nonzero(chosen) <= _MOST else None
