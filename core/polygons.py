# SPDX-License-Identifier: GPL-3.0-or-later
"""`Polygons`: faces of any number of corners, and what their shape alone tells.

They are kept like Blender's: corners in one long list, each with its vertex, and the first corner of every face.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from .arrays import BoolArray, FloatArray, IntArray, indices, table
from .errors import RadiosityError

# Area over squared extent below which a face is a line: Blender's single precision cannot tell the two apart.
FLAT = 1e-7
# Products of lengths must not vanish [m].
SMALLEST = 1e-30


@dataclass(frozen=True, eq=False)
class Polygons:
    """Polygons that share vertices.

    Attributes
    ----------
    vertices : ndarray of shape (v, 3)
        Positions [m].
    corner_vertex : ndarray of shape (c,)
        Vertex of each face corner; the corners of a face run counter-clockwise seen from its front.
    face_start : ndarray of shape (f + 1,)
        First corner of each face; the last entry is c.
    """

    vertices: FloatArray
    corner_vertex: IntArray
    face_start: IntArray

    @cached_property
    def corner_face(self) -> IntArray:
        """Return the face of each corner, shape (c,)."""
        return np.repeat(np.arange(len(self.face_start) - 1), np.diff(self.face_start))

    @property
    def following_corner(self) -> IntArray:
        """Return the next corner of the face of each corner, shape (c,)."""
        following = np.arange(1, len(self.corner_vertex) + 1)
        following[self.face_start[1:] - 1] = self.face_start[:-1]
        return following

    @property
    def preceding_corner(self) -> IntArray:
        """Return the corner before each corner of its face, shape (c,)."""
        preceding = np.arange(-1, len(self.corner_vertex) - 1)
        preceding[self.face_start[:-1]] = self.face_start[1:] - 1
        return preceding

    @cached_property
    def area_vector(self) -> FloatArray:
        """Return Newell's vector area of each face, shape (f, 3) [m^2]: exact for any shape, planar or not."""
        # Relative to the face's own first corner, so that a face far from the origin keeps its digits.
        arm = self._arms
        twice = np.add.reduceat(np.cross(arm, arm[self.following_corner]), self.face_start[:-1], axis=0)
        return np.asarray(0.5 * twice)

    @cached_property
    def face_area(self) -> FloatArray:
        """Return the area of each face, shape (f,) [m^2]; of a non-planar one, as seen along its normal."""
        return np.asarray(np.linalg.norm(self.area_vector, axis=1))

    @cached_property
    def face_extent(self) -> FloatArray:
        """Return the diagonal of each face's bounding box, shape (f,) [m]."""
        arm, first = self._arms, self.face_start[:-1]
        span = np.maximum.reduceat(arm, first, axis=0) - np.minimum.reduceat(arm, first, axis=0)
        return np.asarray(np.linalg.norm(span, axis=1))

    @cached_property
    def extent(self) -> float:
        """Return the diagonal of the bounding box of all faces [m], or 0 without any."""
        points = self.vertices[self.corner_vertex]
        return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0

    @cached_property
    def live(self) -> BoolArray:
        """Return which faces have an area, shape (f,); the others keep their corners but get no patches."""
        return (self.face_area > FLAT * self.face_extent**2) & (self.face_extent > SMALLEST)

    @cached_property
    def face_normal(self) -> FloatArray:
        """Return the unit normal of each face, shape (f, 3); zero for a face without area."""
        size = np.where(self.live, self.face_area, np.inf)
        return np.asarray(self.area_vector / size[:, None])

    @property
    def _arms(self) -> FloatArray:
        """Return each corner as seen from the first corner of its face, shape (c, 3) [m]."""
        position = self.vertices[self.corner_vertex]
        return np.asarray(position - position[self.face_start[self.corner_face]])


def checked_polygons(vertices: ArrayLike, corner_vertex: ArrayLike, face_start: ArrayLike) -> Polygons:
    """Copy the arrays of polygons, if they are of the right kind and the faces lie one after the other.

    Parameters
    ----------
    vertices, corner_vertex, face_start : array_like
        See `Polygons`.

    Returns
    -------
    Polygons

    Raises
    ------
    RadiosityError
        When shapes do not fit.
    """
    points, corners = table("vertices", vertices, None), indices("corner_vertex", corner_vertex, None)
    starts = indices("face_start", face_start, None)
    if len(starts) < 1 or starts[0] != 0 or starts[-1] != len(corners) or np.any(np.diff(starts) < 0):
        raise RadiosityError(f"face_start must run from 0 up to the number of corners, {len(corners)}")
    return Polygons(points, corners, starts)
