# SPDX-License-Identifier: GPL-3.0-or-later
"""A benchmark scene as arrays, the way `core.scene.Scene` takes them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Geometry:
    """Polygons in world space; see `core.scene.Scene` for the meaning of the arrays.

    Attributes
    ----------
    vertices : ndarray of shape (v, 3)
        Positions [m].
    corner_vertex : ndarray of shape (c,)
    face_start : ndarray of shape (f + 1,)
    reflectance : ndarray of shape (f, 3)
    emission : ndarray of shape (f, 3)
        Radiant exitance [W/m^2].
    corner_normals : ndarray of shape (c, 3)
    face_object : ndarray of shape (f,)
    sides : ndarray of shape (f,)
        1 front, 2 back, 3 both.
    object_names : tuple of str
    """

    vertices: NDArray[np.float64]
    corner_vertex: NDArray[np.int64]
    face_start: NDArray[np.int64]
    reflectance: NDArray[np.float64]
    emission: NDArray[np.float64]
    corner_normals: NDArray[np.float64]
    face_object: NDArray[np.int64]
    sides: NDArray[np.uint8]
    object_names: tuple[str, ...]

    def __post_init__(self) -> None:
        """Give every array the type that the core expects."""
        for name in ("vertices", "reflectance", "emission", "corner_normals"):
            object.__setattr__(self, name, getattr(self, name).astype(np.float64))
        for name in ("corner_vertex", "face_start", "face_object"):
            object.__setattr__(self, name, getattr(self, name).astype(np.int64))

    @property
    def corner_face(self) -> NDArray[np.int64]:
        """The face of every corner, shape (c,)."""
        return np.repeat(np.arange(len(self.face_start) - 1), np.diff(self.face_start))

    @property
    def next_corner(self) -> NDArray[np.int64]:
        """The corner that follows each one around its face, shape (c,)."""
        following = np.arange(1, len(self.corner_vertex) + 1)
        following[self.face_start[1:] - 1] = self.face_start[:-1]
        return following
