# SPDX-License-Identifier: GPL-3.0-or-later
"""What light takes on of clear surfaces on its way: the tint of the panes that a segment goes through.

Of light that comes to the surface of glass, a part is reflected, the more the flatter it comes (Fresnel's equations).
What is reflected is not followed, and light goes on without being bent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import BoolArray, FloatArray
from .crossings import Crossings, Hits
from .sieve import unnoticed
from .surfaces import separate_polygons

if TYPE_CHECKING:
    from ..scene import Scene

# Tints and indices of refraction that are worth asking for, and a share that is as good as nothing.
_CLEAR, _DENSE, _NOTHING = 0.99, 1.01, 1e-30
# Of very many such faces, as of leaves, no ray finds all: they are as good as clear.
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
        self._tint, self._ior = scene.tint, scene.ior
        # What is noticed is there itself, where light does not go through.
        self.solid = np.where(chosen & ~unnoticed(scene), 1.0 - scene.tint.mean(axis=1), 1.0)
        self._crossings = Crossings(separate_polygons(scene, chosen))

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
        hits = self._crossings.along(origins, targets)
        # Leaving what was entered before reflects as much as entering it does; leaving what was not, at an open sheet
        # or from within, is as steep a step out of glass as Blender makes of it.
        ior = self._ior[hits.face]
        ior = np.where(_leaving(hits, ior > 1.0), 1.0 / ior, ior)
        passed = self._tint[hits.face] * (1.0 - reflected_share(hits.cosine, ior))[:, None]
        solid = self.solid[hits.face]
        passed = np.column_stack((passed, np.where(solid < 1.0, 1.0 - solid, 1.0)))
        logs = np.log(np.maximum(passed, _NOTHING))
        product = np.exp([np.bincount(hits.segment, column, len(origins)) for column in logs.T]).T
        return product[:, :3], product[:, 3]


def _leaving(hits: Hits, glass: BoolArray) -> BoolArray:
    """Return where segments leave something of glass that they did not enter before."""
    if not len(hits.segment):
        return np.zeros(0, dtype=bool)
    step, first = np.where(hits.front, 1, -1) * glass, np.append(True, np.diff(hits.segment) > 0)
    total = np.cumsum(step)
    start = np.maximum.accumulate(np.where(first, np.arange(len(step)), 0))
    # In how many things of glass the way is; on each segment lower than on any before, so that one sweep does for all.
    ground = -2 * len(step) * np.cumsum(first)
    inside = ground + total - (total - step)[start]
    lowest = np.append(0, np.minimum.accumulate(inside)[:-1])
    return np.asarray(~hits.front & (inside < np.minimum(lowest, ground)))


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
