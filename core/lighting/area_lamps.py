# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat lamps: rectangles and ellipses that shine from one side, evenly or like a softbox with a grid before it.

Without a grid their irradiance is that of a polygon, exact with the horizon's clipping (Lambert 1760). A grid of slats
lets out less the more light slants: of light at an angle a, (tan(s/2) - tan(a)) / (tan(s/2) - s/2) at a spread s, such
that the power stays what it is. Only the part of the lamp that a receiver sees within the spread is looked at then.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..form_factors import point_to_polygon
from .discs import lattice, square_to_disc

# Corners of the polygon that stands for an ellipse of the same area: irradiance off by 1e-3 at worst, at its rim.
_CORNERS = 24
# Narrower spreads are taken as this [rad].
_NARROWEST = 0.01
# Rectangles larger than this, of 4, miss enough of the ellipse in them.
_MOSTLY = 1.0
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class AreaLamp:
    """A rectangle or an ellipse that shines from one side.

    Attributes
    ----------
    name : str
    radiance : ndarray of shape (3,)
        Straight ahead where there is no grid: power / (pi area) [W/(m^2 sr)].
    centre : ndarray of shape (3,)
        [m].
    half_u, half_v : ndarray of shape (3,)
        From the centre to the middle of two sides [m].
    direction : ndarray of shape (3,)
        Unit normal of the side that shines.
    ellipse : bool
        The ellipse inside the rectangle.
    spread : float
        Angle that the light leaves within [rad]; pi for no grid.
    shadows : bool
        Whether anything blocks it.
    """

    name: str
    radiance: FloatArray
    centre: FloatArray
    half_u: FloatArray
    half_v: FloatArray
    direction: FloatArray
    ellipse: bool = False
    spread: float = np.pi
    shadows: bool = True

    @property
    def even(self) -> bool:
        """Return whether one ray tells everything: never."""
        return False

    def unshadowed(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the irradiance of points, shape (n, 3), if nothing stood in the way [W/m^2]."""
        light = np.zeros(len(points))
        before = np.flatnonzero((points - self.centre) @ self.direction > 0)
        x, n = points[before], normals[before]
        if self.spread < np.pi:
            light[before] = self._through_grid(x, n)
        else:
            light[before] = self._form_factor(x, n)
        return np.asarray(np.pi * light[:, None] * self.radiance)

    def sample(
        self, points: FloatArray, normals: FloatArray, u: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a direction, shape (n, 3), the way to the lamp there [m], and the light from there up to a factor."""
        return self._sample(points, normals, u, v)[:3]

    def _sample(
        self, points: FloatArray, normals: FloatArray, u: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return what `sample` does, and the light without the grid and from all of the rectangle."""
        (low_u, high_u), (low_v, high_v) = self._part(points)
        a, b = low_u + u * (high_u - low_u), low_v + v * (high_v - low_v)
        if self.ellipse:
            x, y = square_to_disc(u, v)
            mostly = self._mostly(points)
            a, b = np.where(mostly, x, a), np.where(mostly, y, b)
        way = self.centre + a[:, None] * self.half_u + b[:, None] * self.half_v - points
        squared = np.maximum((way * way).sum(axis=1), _TINY)
        length = np.sqrt(squared)
        out = way / length[:, None]
        slant = np.maximum(-(out @ self.direction), 0)
        bare = np.maximum((out * normals).sum(axis=1), 0) * slant / squared
        light = bare * self._share(slant)
        # Rounding must not put out the rim.
        return out, length, light * (a * a + b * b <= 1 + 1e-9) if self.ellipse else light, bare

    def _through_grid(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the form factor of the lamp times what its grid lets out of it."""
        (low_u, high_u), (low_v, high_v) = self._part(points)
        corners = [(low_u, low_v), (high_u, low_v), (high_u, high_v), (low_u, high_v)]
        quads = [self.centre + u[:, None] * self.half_u + v[:, None] * self.half_v for u, v in corners]
        form: FloatArray = np.asarray(point_to_polygon(points, normals, np.stack(self._facing(quads), axis=1)), float)
        if self.ellipse:
            mostly = np.flatnonzero(self._mostly(points))
            form[mostly] = self._form_factor(points[mostly], normals[mostly])
        seen = np.flatnonzero(form)
        through, total = np.zeros(len(seen)), np.full(len(seen), _TINY)
        for u, v in lattice(len(seen)):
            _, _, light, bare = self._sample(points[seen], normals[seen], u, v)
            through += light
            total += bare
        form[seen] *= through / total
        return form

    def _form_factor(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the form factor of all of the lamp."""
        quads = (np.broadcast_to(quad, (len(points), 4, 3)) for quad in self._quads())
        return np.asarray(sum(point_to_polygon(points, normals, quad) for quad in quads))

    def _share(self, slant: FloatArray) -> FloatArray | float:
        """Return how much light the grid lets out under an angle of that cosine, relative to no grid."""
        if self.spread >= np.pi:
            return 1.0
        half = 0.5 * max(self.spread, _NARROWEST)
        slope = np.sqrt(np.maximum(1 - slant * slant, 0)) / np.maximum(slant, _TINY)
        return np.asarray(np.maximum(np.tan(half) - slope, 0) / (np.tan(half) - half))

    def _part(self, points: FloatArray) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
        """Return from where to where the lamp can shine at points, along u and v, as shares of the half sides."""
        if self.spread >= np.pi:
            one = np.ones(len(points))
            return (-one, one), (-one, one)
        way = points - self.centre
        reach = np.maximum(way @ self.direction, 0) * np.tan(0.5 * max(self.spread, _NARROWEST))
        ranges = []
        for half in (self.half_u, self.half_v):
            size = float(half @ half)
            at, wide = way @ half / size, reach / np.sqrt(size)
            ranges.append((np.clip(at - wide, -1, 1), np.clip(at + wide, -1, 1)))
        return ranges[0], ranges[1]

    def _mostly(self, points: FloatArray) -> BoolArray:
        """Return which points are better sampled over all of an ellipse than over the rectangle they see of it."""
        (low_u, high_u), (low_v, high_v) = self._part(points)
        return np.asarray((high_u - low_u) * (high_v - low_v) > _MOSTLY)

    def _quads(self) -> list[FloatArray]:
        """Return quadrilaterals, shape (4, 3), that make up the lamp, counter-clockwise seen from where it shines."""
        if not self.ellipse:
            corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        else:
            turn = 2 * np.pi * np.arange(_CORNERS) / _CORNERS
            grown = np.sqrt(2 * np.pi / _CORNERS / np.sin(2 * np.pi / _CORNERS))
            corners = list(zip(grown * np.cos(turn), grown * np.sin(turn), strict=True))
        ring = self._facing([self.centre + u * self.half_u + v * self.half_v for u, v in corners])
        last = len(ring) - 1
        return [np.stack((ring[k], ring[k + 1], ring[last - k - 1], ring[last - k])) for k in range(len(ring) // 2 - 1)]

    def _facing(self, ring: list[FloatArray]) -> list[FloatArray]:
        """Return corners in the order that is counter-clockwise seen from where the lamp shines."""
        return ring if np.cross(self.half_u, self.half_v) @ self.direction > 0 else ring[::-1]
