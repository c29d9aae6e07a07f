# SPDX-License-Identifier: GPL-3.0-or-later
"""The light that comes from all around, from as far away as one likes: one colour, or a picture by direction."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from .discs import frame, square_to_disc

# Products of receivers and directions that are looked at together.
_PAIRS = 1 << 20


@dataclass(frozen=True, eq=False)
class SkyLamp:
    """Light from all directions.

    Attributes
    ----------
    name : str
    radiance : ndarray of shape (h, w, 3)
        By direction [W/(m^2 sr)]: rows from straight down to straight up, columns from -x over +y... as an
        equirectangular picture in Blender, u = 1/2 - atan2(y, x) / (2 pi). One row and column for a sky of one colour.
    shadows : bool
        Whether anything blocks it.
    """

    name: str
    radiance: FloatArray
    shadows: bool = True

    @property
    def even(self) -> bool:
        """Return whether one ray tells everything: never."""
        return False

    def unshadowed(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the irradiance of points, shape (n, 3), if nothing stood in the way [W/m^2]."""
        if self.radiance.shape[:2] == (1, 1):
            return np.broadcast_to(np.pi * self.radiance[0, 0], points.shape)
        directions, weights = self._pixels
        # Flat walls have few normals; seven digits do for sums of thousands of pixels, in half the time.
        unique, which = np.unique(normals.astype(np.float32), axis=0, return_inverse=True)
        light = np.zeros(unique.shape)
        rows = max(1, _PAIRS // len(directions))
        for start in range(0, len(unique), rows):
            cosines = unique[start : start + rows] @ directions.T
            light[start : start + rows] = np.maximum(cosines, 0, out=cosines) @ weights
        return light[which.reshape(-1)]

    def sample(
        self, points: FloatArray, normals: FloatArray, u: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a direction, shape (n, 3), infinity, and the light from there up to a factor, shape (n,) or (n, 3)."""
        # Malley: what is even on the disc below is even by cosine on the hemisphere.
        x, y = square_to_disc(u, v)
        first, second = frame(normals)
        up = np.sqrt(np.maximum(1 - x * x - y * y, 0))
        out = x[:, None] * first + y[:, None] * second + up[:, None] * normals
        light = np.ones(len(points)) if self.radiance.shape[:2] == (1, 1) else self.seen(out)
        return out, np.full(len(points), np.inf), light

    def seen(self, out: FloatArray) -> FloatArray:
        """Return the radiance from directions, shape (n, 3) [W/(m^2 sr)]."""
        rows, columns = self.radiance.shape[:2]
        u = 0.5 - np.arctan2(out[:, 1], out[:, 0]) / (2 * np.pi)
        v = 0.5 + np.arcsin(np.clip(out[:, 2], -1, 1)) / np.pi
        row, column = np.minimum((v * rows).astype(int), rows - 1), (u * columns).astype(int) % columns
        return np.asarray(self.radiance[row, column])

    @cached_property
    def _pixels(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the directions of the picture's pixels, shape (h w, 3), and radiance times solid angle."""
        rows, columns = self.radiance.shape[:2]
        edge = np.sin(np.pi * (np.arange(rows + 1) / rows - 0.5))
        height = np.pi * ((np.arange(rows) + 0.5) / rows - 0.5)
        turn = np.pi * (1 - 2 * (np.arange(columns) + 0.5) / columns)
        flat, z = np.cos(height)[:, None], np.sin(height)[:, None]
        directions = np.stack(np.broadcast_arrays(flat * np.cos(turn), flat * np.sin(turn), z), axis=-1)
        solid = np.diff(edge)[:, None, None] * 2 * np.pi / columns
        weights = solid * self.radiance
        return directions.reshape(-1, 3).astype(np.float32), weights.reshape(-1, 3).astype(np.float32)
