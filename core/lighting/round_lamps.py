# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that look round from everywhere: point and spot with a radius, and the sun with an angle.

Each is a disc of even radiance in the sky of a receiver, of angular radius alpha about the direction to its middle. The
irradiance of a disc that is wholly above the horizon is that of a point of the same intensity; `discs` tells that of
one that the horizon cuts.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray
from .discs import disc_directions, disc_form, lattice
from .patterns import Pattern

# Directions to the rim of a disc that tell whether the edge of a cone of light is on it.
_RIM = 8
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class PointLamp:
    """A ball or, with `soft`, a disc that turns to whoever looks at it; with a `cone` a spot light.

    Attributes
    ----------
    name : str
    intensity : ndarray of shape (3,)
        Radiant intensity [W/sr]: of a lamp of power P, P / (4 pi), also inside a cone.
    centre : ndarray of shape (3,)
        [m].
    radius : float
        [m]; 0 casts sharp shadows.
    soft : bool
        A disc across the line of sight, as Blender's *soft falloff*, rather than a ball.
    cone : Cone, optional
        Where a spot light shines.
    shadows : bool
        Whether anything blocks it.
    pattern : Pattern, optional
        What its light is multiplied with, by direction from its centre.
    """

    name: str
    intensity: FloatArray
    centre: FloatArray
    radius: float = 0.0
    soft: bool = False
    cone: "Cone | None" = None
    shadows: bool = True
    pattern: Pattern | None = None

    @property
    def even(self) -> bool:
        """Return whether one ray tells everything."""
        return self.radius == 0

    def unshadowed(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the irradiance of points, shape (n, 3), if nothing stood in the way [W/m^2]."""
        way, distance, sine = self._disc(points)
        inside = self._inside(distance)
        cosine = np.where(inside, 1.0, (way * normals).sum(axis=1))
        # Squared sine over squared radius, which lasts when the radius is nothing.
        squared = np.where(inside, self.radius**2, distance**2 + (self.radius**2 if self.soft else 0.0))
        light = disc_form(sine, cosine) / np.maximum(squared, _TINY)
        if self.cone is not None:
            light *= self._cone_share(points, normals)
        if self.pattern is None:
            return light[:, None] * self.intensity
        return light[:, None] * self.intensity * self.pattern.share(points - self.centre)

    def sample(
        self, points: FloatArray, normals: FloatArray, u: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a direction, shape (n, 3), the way to the lamp there [m], and the light from there up to a factor."""
        way, distance, sine = self._disc(points)
        inside = self._inside(distance)
        out, drop = disc_directions(np.where(inside[:, None], normals, way), sine, u, v)
        if self.soft:
            length = distance / np.maximum(1 - drop, _TINY)
        else:
            along = (out * way).sum(axis=1) * distance
            across = np.maximum(self.radius**2 - distance**2 + along**2, 0)
            length = along + np.where(inside, 1, -1) * np.sqrt(across)
        light = np.maximum((out * normals).sum(axis=1), 0)
        if self.cone is not None:
            light = light * self.cone.share(-out)
        return out, length, light

    def _disc(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return direction and distance of the middle, and the sine of the angular radius."""
        way = self.centre - points
        distance = np.sqrt((way * way).sum(axis=1))
        far = np.hypot(distance, self.radius) if self.soft else distance
        sine = np.minimum(self.radius / np.maximum(far, _TINY), 1)
        return way / np.maximum(distance, _TINY)[:, None], distance, sine

    def _inside(self, distance: FloatArray) -> BoolArray:
        """Return which points are inside the ball, and see it all around."""
        return np.asarray((distance <= self.radius) & (not self.soft))

    def _cone_share(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return how much of the light the cone lets out to each point."""
        assert self.cone is not None
        if self.even:
            return self.cone.share(points - self.centre)
        way, distance, sine = self._disc(points)
        way = np.where(self._inside(distance)[:, None], normals, way)
        share = self.cone.share(-way)
        # Most see the lamp from within the cone or from without.
        edge = np.zeros(len(points), bool)
        for turn in 2 * np.pi * np.arange(_RIM) / _RIM:
            # Round the square, which is the rim of the disc.
            u, v = 0.5 + 0.5 * np.array((np.cos(turn), np.sin(turn))) / max(abs(np.cos(turn)), abs(np.sin(turn)))
            rim, _ = disc_directions(way, sine, np.full(len(points), u), np.full(len(points), v))
            edge |= self.cone.share(-rim) != share
        at = np.flatnonzero(edge)
        through, whole = np.zeros(len(at)), np.full(len(at), _TINY)
        for u, v in lattice(len(at)):
            out, _ = disc_directions(way[at], sine[at], u, v)
            light = np.maximum((out * normals[at]).sum(axis=1), 0)
            whole += light
            through += light * self.cone.share(-out)
        share[at] = through / whole
        return share


@dataclass(frozen=True, eq=False)
class Cone:
    """Where a spot light shines.

    Attributes
    ----------
    to_lamp : ndarray of shape (3, 3)
        Turns world directions into the lamp's own, in which it shines along -z within a round cone.
    angle : float
        Between opposite sides [rad].
    blend : float
        Share of the cone, 0 to 1, in which the light fades towards the rim.
    """

    to_lamp: FloatArray
    angle: float
    blend: float

    def share(self, out: FloatArray) -> FloatArray:
        """Return how much light leaves in the directions, shape (n, 3) of any length: 0 to 1."""
        own = out @ self.to_lamp.T
        cosine = -own[:, 2] / np.maximum(np.sqrt((own * own).sum(axis=1)), _TINY)
        rim = np.cos(0.5 * self.angle)
        t = np.clip((cosine - rim) / max((1 - rim) * self.blend, 1e-9), 0, 1)
        return np.asarray(t * t * (3 - 2 * t))


@dataclass(frozen=True, eq=False)
class SunLamp:
    """A disc in the sky, far away.

    Attributes
    ----------
    name : str
    irradiance : ndarray of shape (3,)
        Of a surface that faces it [W/m^2]; that of the disc's middle where part of the disc has set.
    direction : ndarray of shape (3,)
        Unit vector towards it.
    angle : float
        Diameter [rad], at most pi.
    shadows : bool
        Whether anything blocks it.
    """

    name: str
    irradiance: FloatArray
    direction: FloatArray
    angle: float = 0.0
    shadows: bool = True

    @property
    def even(self) -> bool:
        """Return whether one ray tells everything."""
        return self.angle == 0

    def unshadowed(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the irradiance of points, shape (n, 3), if nothing stood in the way [W/m^2]."""
        sine = np.full(len(points), np.sin(0.5 * self.angle))
        return disc_form(sine, normals @ self.direction)[:, None] * self.irradiance

    def sample(
        self, points: FloatArray, normals: FloatArray, u: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a direction, shape (n, 3), infinity, and the light from there up to a factor."""
        sine = np.full(len(points), np.sin(0.5 * self.angle))
        out, _ = disc_directions(np.broadcast_to(self.direction, points.shape), sine, u, v)
        return out, np.full(len(points), np.inf), np.maximum((out * normals).sum(axis=1), 0)
