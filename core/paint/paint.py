# SPDX-License-Identifier: GPL-3.0-or-later
"""`Paint`: reflectance and emission inside faces, as their patches, elements and corners have them.

A face that is large for its texture has a raster, a small picture in a plane of its own, so that its patches and
elements can have what is on them. The corners of all faces have a value that stands for what is around them. Faces
without a raster are as their mean, which is the scene's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray, SingleArray
from ..errors import RadiosityError

# Places along each edge of a patch that its mean is taken over, at most.
MOST_PLACES = 16
# Lookups at a time, so that a million patches do not fill the memory.
_AT_ONCE = 1 << 20


@dataclass(frozen=True, eq=False)
class Paint:
    """Reflectance and emission inside faces.

    Attributes
    ----------
    corner_reflectance, corner_emission : ndarray of shape (c, 3)
        Around each of the scene's corners: rho, and exitance E [W/m^2].
    face : ndarray of shape (t,)
        Faces that have a raster, ascending.
    frame : ndarray of shape (t, 3, 3)
        Where each raster lies: its first corner, and the edges along its columns and rows, from there [m].
    size : ndarray of shape (t, 2)
        Columns and rows.
    reflectance, emission : ndarray of shape (x, 3)
        Of the texels of all rasters, row after row.
    weight : ndarray of shape (x,)
        Area of the face that each texel stands for; 0 outside it.
    """

    corner_reflectance: SingleArray
    corner_emission: SingleArray
    face: IntArray
    frame: FloatArray
    size: IntArray
    reflectance: SingleArray
    emission: SingleArray
    weight: SingleArray

    def checked(self, faces: int, corners: int, brightest: float) -> "Paint":
        """Return this with no reflectance above a limit.

        Parameters
        ----------
        faces, corners : int
            Of the scene.
        brightest : float
            Limit of the reflectance.

        Returns
        -------
        Paint

        Raises
        ------
        RadiosityError
            When it does not fit the scene, or when a value is negative or not finite.
        """
        if len(self.corner_reflectance) != corners or np.any((self.face < 0) | (self.face >= faces)):
            raise RadiosityError(f"The paint does not fit a scene of {faces} faces and {corners} corners")
        values = (self.corner_reflectance, self.corner_emission, self.reflectance, self.emission)
        if not all(np.all(np.isfinite(value) & (value >= 0)) for value in values):
            raise RadiosityError("A reflectance or emission inside a face is negative or not a finite number")
        return replace(
            self,
            corner_reflectance=np.minimum(self.corner_reflectance, np.float32(brightest)),
            reflectance=np.minimum(self.reflectance, np.float32(brightest)),
        )

    def means(self, corners: FloatArray, face: IntArray) -> tuple[BoolArray, FloatArray, FloatArray]:
        """Return what convex pieces of faces look like.

        Parameters
        ----------
        corners : ndarray of shape (n, 4, 3)
            Corners of quads [m]; a triangle repeats its last corner.
        face : ndarray of shape (n,)
            The face that each is a piece of.

        Returns
        -------
        known : ndarray of shape (n,)
            Pieces that lie on a raster.
        reflectance, emission : ndarray of shape (n, 3)
            Means over those; 0 for the others.
        """
        raster = self._raster_of(face)
        sums = np.zeros((len(face), 7))
        # A piece that spans many texels is looked at in more places.
        span = self._span(corners, raster)
        places = 2 ** np.ceil(np.log2(np.clip(span, 2, MOST_PLACES))).astype(np.int64)
        for count in np.unique(places[raster >= 0]):
            of_count = np.flatnonzero((raster >= 0) & (places == count))
            for part in np.array_split(of_count, -(-len(of_count) * count**2 // _AT_ONCE)):
                sums[part] = self._sampled(_inside(corners[part], int(count)), raster[part])
        known = sums[:, 6] > 0
        mean = sums[:, :6] / np.where(known, sums[:, 6], 1.0)[:, None]
        return known, mean[:, :3], mean[:, 3:]

    def moved(self, linear: FloatArray, offset: FloatArray, order: IntArray) -> "Paint":
        """Return this on faces that were moved.

        Parameters
        ----------
        linear : ndarray of shape (3, 3)
        offset : ndarray of shape (3,)
            A point p is at `linear` p + `offset` now.
        order : ndarray of shape (c,)
            Which of the corners each corner was.

        Returns
        -------
        Paint
        """
        frame = self.frame @ linear.T
        frame[:, 0] += offset
        corner = (self.corner_reflectance[order], self.corner_emission[order])
        return Paint(*corner, self.face, frame, self.size, self.reflectance, self.emission, self.weight)

    def _raster_of(self, face: IntArray) -> IntArray:
        """Return the raster of each face, -1 where it has none."""
        if not len(self.face):
            return np.full(len(face), -1)
        place = np.minimum(np.searchsorted(self.face, face), len(self.face) - 1)
        return np.where(self.face[place] == face, place, -1)

    def _at(self, points: FloatArray, raster: IntArray) -> FloatArray:
        """Return columns and rows of points (n, k, 3) on rasters (n,), shape (n, k, 2); from 0 to the size within."""
        origin, u, v = self.frame[raster].transpose(1, 0, 2)
        # The shares of two edges that need not be square to each other.
        uu, uv, vv = (u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)
        scale = np.maximum(uu * vv - uv * uv, 1e-300)[:, None]
        across = (vv[:, None] * u - uv[:, None] * v) / scale
        along = (uu[:, None] * v - uv[:, None] * u) / scale
        arm = points - origin[:, None]
        share = np.stack([np.einsum("nki,ni->nk", arm, dual) for dual in (across, along)], axis=2)
        return np.asarray(share * self.size[raster][:, None])

    def _span(self, corners: FloatArray, raster: IntArray) -> FloatArray:
        """Return how many texels each piece reaches over, shape (n,)."""
        span = np.zeros(len(raster))
        on = raster >= 0
        span[on] = np.ptp(self._at(corners[on], raster[on]), axis=1).max(axis=1, initial=0.0)
        return span

    def _sampled(self, points: FloatArray, raster: IntArray) -> FloatArray:
        """Return weighted sums of reflectance and emission at points (n, k, 3), and of the weights: (n, 7)."""
        size = self.size[raster][:, None]
        cell = np.clip(np.floor(self._at(points, raster)).astype(np.int64), 0, size - 1)
        first = np.cumsum(np.append(0, self.size.prod(axis=1)))[raster]
        texel = first[:, None] + cell[..., 1] * size[..., 0] + cell[..., 0]
        weight = self.weight[texel].astype(np.float64)
        values = np.concatenate([self.reflectance[texel], self.emission[texel]], axis=2)
        sums = np.einsum("nk,nkc->nc", weight, values)
        return np.column_stack([sums, weight.sum(axis=1)])


def join_paint(parts: Sequence[tuple[FloatArray, FloatArray, IntArray, Paint | None]]) -> Paint | None:
    """Put the paints of several meshes one after the other.

    Parameters
    ----------
    parts : sequence of (reflectance, emission, corner_face, Paint or None)
        For each mesh the values of its f faces, the face of each of its corners, and its paint if it has one.

    Returns
    -------
    Paint or None
        None where no mesh has any.
    """
    if all(paint is None for *_, paint in parts):
        return None
    whole = [paint or plain_paint(reflectance, emission, corner) for reflectance, emission, corner, paint in parts]
    first = np.cumsum([0] + [len(reflectance) for reflectance, *_ in parts])
    names = ("corner_reflectance", "corner_emission", "face", "frame", "size", "reflectance", "emission", "weight")
    columns = {name: [getattr(paint, name) for paint in whole] for name in names}
    columns["face"] = [face + start for face, start in zip(columns["face"], first, strict=False)]
    return Paint(**{name: np.concatenate(column) for name, column in columns.items()})


def plain_paint(reflectance: FloatArray, emission: FloatArray, corner_face: IntArray) -> Paint:
    """Return the paint of faces that do not vary: no rasters, and corners like their faces.

    Parameters
    ----------
    reflectance, emission : ndarray of shape (f, 3)
    corner_face : ndarray of shape (c,)

    Returns
    -------
    Paint
    """
    corner = (reflectance[corner_face].astype(np.float32), emission[corner_face].astype(np.float32))
    texels = (np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32), np.zeros(0, np.float32))
    return Paint(*corner, np.zeros(0, np.int64), np.zeros((0, 3, 3)), np.zeros((0, 2), np.int64), *texels)


def _inside(corners: FloatArray, count: int) -> FloatArray:
    """Return count x count places spread evenly over quads and triangles, shape (n, count^2, 3) [m]."""
    middle = (np.arange(count) + 0.5) / count
    s, t = (axis.ravel()[:, None] for axis in np.meshgrid(middle, middle))
    a, b, c, d = corners.transpose(1, 0, 2)[:, :, None]
    quad = (1 - s) * (1 - t) * a + s * (1 - t) * b + s * t * c + (1 - s) * t * d
    # The square root spreads the places over a triangle as evenly.
    root = np.sqrt(s)
    triangle = (1 - root) * a + root * (1 - t) * b + root * t * c
    return np.asarray(np.where(np.all(c == d, axis=2)[..., None], triangle, quad))
