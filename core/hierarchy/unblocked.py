# SPDX-License-Identifier: GPL-3.0-or-later
"""Light straight from emitters and lamps, as if nothing stood in the way: it tells where patches are to be split.

What is near a lamp is hardly hidden from it, so no rays are needed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..lighting.area_lamps import AreaLamp
from ..lighting.kinds import Lamp
from ..lighting.round_lamps import PointLamp
from ..meshing import Patches
from ..runs import counted
from .kernels import far_form_factors, near_form_factors
from .links import find_links
from .receivers import group_receivers
from .sources import Sources, build_sources
from .tree import Float, Int

# Of a lamp of power P a piece of side s at a distance d misplaces P (s / d)^3 over this, about.
_CUBED = 8.0
# Emitters that stand one behind the other in any direction, at most, for how bright they can be together.
_LAYERS = 4


@dataclass(frozen=True, eq=False)
class Unblocked:
    """What shines on pieces of patches.

    Attributes
    ----------
    power : float
        Of all emitters and lamps, over all channels [W].
    emitters : ndarray of shape (l,)
        Patches that emit.
    corners : ndarray of shape (l, 4, 3)
        Theirs [m].
    sources : Sources or None
        A hierarchy of them; None where there are none.
    radiosity : ndarray of shape (m,)
        Of its nodes, mean over the channels [W/m^2].
    lamps : tuple of PointLamp or AreaLamp
        Those that are somewhere: the light of suns and skies does not change with the place.
    fine : float
        Share of the power that a piece may misplace.
    """

    power: float
    emitters: Int
    corners: Float
    sources: Sources | None
    radiosity: Float
    lamps: tuple[PointLamp | AreaLamp, ...]
    fine: float

    def irradiance(self, point: Float, normal: Float, size: Float) -> Float:
        """Return the light at points of pieces, mean over the channels [W/m^2].

        Parameters
        ----------
        point, normal : ndarray of shape (k, n, 3)
            The same k points of each of n pieces [m], the middle last, and their unit normals.
        size : ndarray of shape (n,)
            Side of each piece [m]; lamps that are far for that are left out, and all emitters where a piece is so small
            that it could not misplace too much of the brightest light.

        Returns
        -------
        ndarray of shape (k, n)
        """
        light = np.zeros(point.shape[:2])
        # Points lie half of the range apart from their mean, at most; powers are of three channels.
        most = 3 * 0.5 * _LAYERS * float(np.max(self.radiosity, initial=0.0))
        large = np.flatnonzero(most * size**2 > self.fine * self.power)
        at, facing = point[:, large].reshape(-1, 3), normal[:, large].reshape(-1, 3)
        if self.sources is not None:
            shining = unblocked_irradiance(at, facing, self.sources, self.corners, self.radiosity[:, None])
            light[:, large] = shining.reshape(len(point), -1)
        for lamp in self.lamps:
            power, radius = _power(lamp), _radius(lamp)
            distance = np.sqrt(((point[-1] - lamp.centre) ** 2).sum(axis=1)) - radius
            # A narrow cone is the brighter for the power that it lets out.
            least = np.cbrt(_CUBED * self.fine * self.power / max(power, 1e-300) * _width(lamp))
            near = np.flatnonzero(size > least * distance)
            at, facing = point[:, near].reshape(-1, 3), normal[:, near].reshape(-1, 3)
            light[:, near] += lamp.unshadowed(at, facing).mean(axis=1).reshape(len(point), -1)
        return light


def unblocked_irradiance(point: Float, normal: Float, sources: Sources, corners: Float, radiosity: Float) -> Float:
    """Return the light of emitters at points as if nothing stood in the way.

    Parameters
    ----------
    point, normal : ndarray of shape (n, 3)
        [m]; unit length.
    sources : Sources
        Of the emitters.
    corners : ndarray of shape (l, 4, 3)
        Of the emitters [m].
    radiosity : ndarray of shape (m, k)
        Of the nodes of the sources [W/m^2].

    Returns
    -------
    ndarray of shape (n, k)
    """
    light = np.zeros((len(point), radiosity.shape[1]))
    if not len(point):
        return light
    receivers = group_receivers(point, normal)
    one = np.ones(len(radiosity))
    links = find_links(receivers, np.arange(len(receivers)), sources, one, angle=0.7, error=np.inf)
    count = np.diff(receivers.first)[links.group]
    pair, receiver = counted(count, receivers.first[links.group])
    factors = np.zeros(len(pair))
    near, node = links.near[pair], links.node[pair]
    for where, exact in ((np.flatnonzero(near), True), (np.flatnonzero(~near), False)):
        at, facing = receivers.point[receiver[where]], receivers.normal[receiver[where]]
        if exact:
            emitter = sources.tree.order[sources.tree.start[node[where]]]
            factors[where] = near_form_factors(at, facing, corners[emitter])
        else:
            factors[where] = far_form_factors(at, facing, sources, node[where])
    for channel, shining in zip(light.T, radiosity.T, strict=True):
        channel[receivers.index] = np.bincount(receiver, factors * shining[node], len(point))
    return light


def unblocked_light(patches: Patches, lamps: Sequence[Lamp], fine: float) -> Unblocked:
    """Return what shines straight on patches.

    Parameters
    ----------
    patches : Patches
    lamps : sequence of Lamp
    fine : float
        Share of all power that a piece may misplace.
    """
    lit = np.flatnonzero(patches.emission.any(axis=1))
    somewhere = tuple(lamp for lamp in lamps if isinstance(lamp, PointLamp | AreaLamp))
    power = float((patches.area[lit, None] * patches.emission[lit]).sum()) + sum(map(_power, somewhere))
    corners, sources, radiosity = patches.corners[lit], None, np.zeros(0)
    if len(lit) and power > 0:
        sources = build_sources(corners, patches.centre[lit], patches.normal[lit], patches.area[lit])
        shining = patches.emission[lit].mean(axis=1)
        radiosity = sources.tree.sums((patches.area[lit] * shining)[:, None])[:, 0] / sources.area
    return Unblocked(power, lit, corners, sources, radiosity, somewhere, fine)


def _power(lamp: PointLamp | AreaLamp) -> float:
    """Return what a lamp sends out, over all channels [W]."""
    if isinstance(lamp, PointLamp):
        return float(4 * np.pi * _width(lamp) * lamp.intensity.sum())
    area = 4 * float(np.linalg.norm(np.cross(lamp.half_u, lamp.half_v))) * (np.pi / 4 if lamp.ellipse else 1.0)
    return float(np.pi * area * lamp.radiance.sum())


def _radius(lamp: PointLamp | AreaLamp) -> float:
    """Return how far a lamp reaches from its middle [m]."""
    if isinstance(lamp, PointLamp):
        return lamp.radius
    return float(np.linalg.norm(lamp.half_u) + np.linalg.norm(lamp.half_v))


def _width(lamp: PointLamp | AreaLamp) -> float:
    """Return the share of all directions that a lamp shines in."""
    if isinstance(lamp, AreaLamp):
        return float(0.5 * (1 - np.cos(0.5 * lamp.spread)))
    return 1.0 if lamp.cone is None else float(0.5 * (1 - np.cos(0.5 * lamp.cone.angle)))
