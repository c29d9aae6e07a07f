# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlook: the light that single rays see, of what they meet or of the sky."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lighting.sky import SkyLamp
from ..scene import Scene
from ..visibility import Surroundings, panes_of, sky_occluders
from .element_hits import ElementHits
from .solve import Lit
from .tree import Float


@dataclass(frozen=True, eq=False)
class Outlook:
    """What rays can see.

    Attributes
    ----------
    hits : ElementHits
    sent : ndarray of shape (n, 6)
        What the elements send: all of it, and what they emit [W/m^2].
    skies : sequence of SkyLamp
    occluders : Surroundings
        What hides the sky; its panes give color to what is behind them.
    reach : float
        A way that leaves the scene from everywhere in it [m].
    """

    hits: ElementHits
    sent: Float
    skies: Sequence[SkyLamp]
    occluders: Surroundings
    reach: float

    def look(self, origins: Float, ways: Float) -> tuple[Float, NDArray[np.bool_], Float]:
        """Return what rays see.

        Parameters
        ----------
        origins, ways : ndarray of shape (m, 3)
            [m]; unit length.

        Returns
        -------
        light : ndarray of shape (m, 6)
            As much as would arrive if all that is seen were like that: all of it, and what is emitted [W/m^2].
        lit : ndarray of shape (m,)
            Which rays met something from the side that has light, or nothing.
        distance : ndarray of shape (m,)
            Infinite where nothing is met [m].
        """
        element, distance = self.hits.met(origins, ways)
        met, free = np.flatnonzero(element >= 0), np.isinf(distance)
        light = np.zeros((len(origins), 6))
        light[met] = self.sent[element[met]]
        panes = panes_of(self.occluders)
        if panes is not None:
            end = origins[met] + distance[met, None] * ways[met]
            light[met] *= np.tile(panes.tint(origins[met], end), 2)
        light += np.tile(self._sky(origins, ways, free), 2)
        return light, free | (element >= 0), distance

    def _sky(self, origins: Float, ways: Float, free: NDArray[np.bool_]) -> Float:
        """Return what rays see of the sky, of which those that are free meet nothing, shape (m, 3) [W/m^2]."""
        light, end = np.zeros_like(origins), origins + self.reach * ways
        blockers = sky_occluders(self.occluders)
        if self.skies and blockers is not self.occluders:
            free = ~blockers.blocked(origins, end)
        panes = panes_of(blockers)
        for sky in self.skies:
            out = np.flatnonzero(free | (not sky.shadows))
            seen = np.pi * sky.seen(ways[out])
            if sky.shadows and panes is not None:
                seen *= panes.tint(origins[out], end[out])
            light[out] += seen
        return light


def find_outlook(scene: Scene, lit: Lit, sent: Float) -> Outlook | None:
    """Tell what rays can see in a scene but for lamps.

    Parameters
    ----------
    scene : Scene
        Whose sky it is; all faces, or some of them.
    lit : Lit
        What was solved.
    sent : ndarray of shape (n, 6)
        What its elements send: all of it, and what they emit [W/m^2].

    Returns
    -------
    Outlook or None
        None where rays are not asked what they meet.
    """
    thickets = lit.scenery.thickets
    if thickets is None:
        return None
    skies = [lamp for lamp in scene.lamps if isinstance(lamp, SkyLamp)]
    others = np.maximum(sent - np.tile(lit.lamp, 2), 0)
    # Of all there is: the scene may be some faces of it.
    reach = 2 * float(np.linalg.norm(np.ptp(lit.elements.corners.reshape(-1, 3), axis=0)))
    return Outlook(thickets.hits, others, skies, lit.scenery.occluders, reach)
