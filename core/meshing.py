# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons cut into patches of constant radiosity, with the way back from patches to faces and mesh corners.

`grids` say how finely a face is cut, `cutting` cuts it; here its fronts and backs become `Patches`.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray, IntArray
from .cutting import Cut, cut
from .errors import RadiosityError
from .grids import check_count, grid
from .occlusion.sieve import unnoticed
from .paint.paint import Paint
from .scene import AUTO, BACK, BOTH, FRONT, Scene
from .triangulation import pieces


@dataclass(frozen=True, eq=False)
class Patches:
    """Small convex surfaces of constant radiosity, in the order of the faces, front before back.

    Attributes
    ----------
    corners : ndarray of shape (p, 4, 3)
        Corners [m], counter-clockwise seen from the radiating side; a triangle repeats its last corner.
    centre : ndarray of shape (p, 3)
        The middle of the patch, a point on its surface [m].
    normal : ndarray of shape (p, 3)
        Unit normals towards the radiating side.
    area : ndarray of shape (p,)
        Areas [m^2]; of a non-planar patch, as seen along its normal.
    face : ndarray of shape (p,)
        The face of the scene that each patch is a part of.
    side : ndarray of shape (p,)
        1 on the front of the face, -1 on its back.
    reflectance, emission : ndarray of shape (p, 3)
        Means over the patch: rho, and exitance E [W/m^2]; zero where the face does not light others with it.
    transmittance : ndarray of shape (p, 3)
        tau, likewise.
    opposite : ndarray of shape (p,)
        The patch on the other side of each one that is translucent, -1 for the others.
    touch_corner, touch_patch : ndarray of shape (k,)
        Pairs of a mesh corner (index into `Scene.corner_vertex`) and a patch that has it as a corner of its own, on the
        front of the face unless only the back radiates. Sorted by corner; every corner of a live face has one.
    paint : Paint or None
        How the faces vary inside, see `Scene`.
    solid : ndarray of shape (p,)
        Share of what the corners enclose that `area` counts, and that reflects: less than 1 for screens.
    """

    corners: FloatArray
    centre: FloatArray
    normal: FloatArray
    area: FloatArray
    face: IntArray
    side: NDArray[np.int8]
    reflectance: FloatArray
    emission: FloatArray
    transmittance: FloatArray
    opposite: IntArray
    touch_corner: IntArray
    touch_patch: IntArray
    solid: FloatArray
    paint: Paint | None = None

    def surface(self, corners: FloatArray, patch: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return what pieces of patches reflect and emit.

        Parameters
        ----------
        corners : ndarray of shape (n, 4, 3)
            Corners of the pieces [m]; a triangle repeats its last corner.
        patch : ndarray of shape (n,)
            The patch that each is a piece of.

        Returns
        -------
        reflectance, emission : ndarray of shape (n, 3)
        """
        reflectance, emission = self.reflectance[patch], self.emission[patch]
        if self.paint is not None:
            pieces = np.flatnonzero(np.bincount(patch, minlength=len(self.area))[patch] > 1)
            reflectance *= self.solid[patch, None]
            _paint(self.paint, pieces, corners, self.face[patch], reflectance, emission)
            reflectance /= self.solid[patch, None]
        return reflectance, emission


def mesh(scene: Scene, *, max_edge: float | None = None, subdivide: int = 1) -> Patches:
    """Cut the faces of a scene into patches.

    Parameters
    ----------
    scene : Scene
        The polygons; every edge is cut into at least `divisions` * `subdivide` parts (T12).
    max_edge : float, optional
        No edge of a patch may be longer [m], but for faces with a length of their own.
    subdivide : int
        Factor on the scene's own divisions.

    Returns
    -------
    Patches
        Patches and the maps back to faces and mesh corners.

    Raises
    ------
    RadiosityError
        When a setting makes no sense or the patches would be too many; before they are allocated.
    """
    if max_edge is not None and not (math.isfinite(max_edge) and max_edge > 0):
        raise RadiosityError(f"The largest patch edge must be a length above zero, not {max_edge:g} m")
    if not (subdivide >= 1 and subdivide == subdivide // 1):
        raise RadiosityError(f"The subdivision must be a whole number from 1 up, not {subdivide}")
    whole = pieces(scene)
    check_count(scene, whole, max_edge, subdivide)
    return _arranged(scene, cut(grid(scene, whole, max_edge, subdivide)))


def _arranged(scene: Scene, fronts: Cut) -> Patches:
    """Return the fronts and backs that radiate, one after the other for every face."""
    translucent = scene.transmittance.any(axis=1)
    lit = np.where(translucent, BOTH, np.where(scene.sides == AUTO, FRONT, scene.sides))
    shown = np.where(unnoticed(scene), 0, lit)[fronts.face]
    source = np.concatenate([np.flatnonzero(shown & FRONT), np.flatnonzero(shown & BACK)])
    side = np.ones(len(source), dtype=np.int8)
    side[np.count_nonzero(shown & FRONT) :] = -1
    order = np.lexsort((source, -side, fronts.face[source]))
    source, side = source[order], side[order]

    corners, back = _corners(scene, fronts)[source], side < 0
    corners[back] = _turned(corners[back])
    normal, area, centre = _measures(fronts)
    face = fronts.face[source]
    reflectance = np.where(scene.reflects[face, None], scene.reflectance[face], 0.0)
    emission = np.where(scene.emits[face, None], scene.emission[face], 0.0)
    if scene.paint is not None:
        cut_up = np.bincount(fronts.face, minlength=len(scene.face_area))[face] > 1
        _paint(scene.paint, np.flatnonzero(cut_up), corners, face, reflectance, emission)

    transmittance = np.where(scene.reflects[face, None], scene.transmittance[face], 0.0)
    place = np.full((2, len(shown)), -1)
    place[(side < 0).astype(np.int64), source] = np.arange(len(source))
    opposite = np.where(transmittance.any(axis=1), place[(side > 0).astype(np.int64), source], -1)

    # A mesh corner shows the front, or the back where only the back radiates.
    place = place[np.where(scene.sides[fronts.face] == BACK, 1, 0), np.arange(len(shown))]
    touch = _adopted(scene, fronts.touch[:, :2])
    touch = touch[place[touch[:, 1]] >= 0]
    touch_corner, touch_patch = touch[:, 0], place[touch[:, 1]]
    order = np.lexsort((touch_patch, touch_corner))
    return Patches(
        corners=corners,
        centre=centre[source],
        normal=normal[source] * side[:, None],
        area=area[source],
        face=face,
        side=side,
        reflectance=reflectance,
        emission=emission,
        transmittance=transmittance,
        opposite=opposite,
        touch_corner=touch_corner[order],
        touch_patch=touch_patch[order],
        solid=np.ones(len(source)),
        paint=scene.paint,
    )


def _paint(
    paint: Paint, pieces: IntArray, corners: FloatArray, face: IntArray, reflectance: FloatArray, emission: FloatArray
) -> None:
    """Give some pieces of faces what is on them, in place; what is dark as a whole stays so."""
    known, reflected, emitted = paint.means(corners[pieces], face[pieces])
    for values, painted in ((reflectance, reflected), (emission, emitted)):
        bright = known & values[pieces].any(axis=1)
        values[pieces[bright]] = painted[bright]


def _corners(scene: Scene, fronts: Cut) -> FloatArray:
    """Return the corners of all fronts; those at a mesh corner are exactly there, shape (p, 4, 3) [m]."""
    corners = fronts.base[:, None] + fronts.offset
    corner, patch, slot = fronts.touch.T
    corners[patch, slot] = scene.vertices[scene.corner_vertex[corner]]
    # Where the last corner is a repetition it follows the third.
    same = np.all(fronts.offset[:, 2] == fronts.offset[:, 3], axis=1)
    corners[same, 3] = corners[same, 2]
    return corners


def _turned(corners: FloatArray) -> FloatArray:
    """Return patches as seen from behind: the corners in opposite order."""
    turned = corners[:, ::-1].copy()
    triangle = np.all(turned[:, 0] == turned[:, 1], axis=1)
    turned[triangle] = turned[triangle][:, [1, 2, 3, 3]]
    return turned


def _measures(fronts: Cut) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit normal, area and centre of every front."""
    a, b, c, d = (fronts.offset[:, slot] for slot in range(4))
    vector = 0.5 * np.cross(c - a, d - b)
    area = np.asarray(np.linalg.norm(vector, axis=1))
    # The mean of four corners lies on their bilinear surface, which their centroid need not.
    triangle = np.all(c == d, axis=1)[:, None]
    centre = fronts.base + np.where(triangle, (a + b + c) / 3, (a + b + c + d) / 4)
    return vector / area[:, None], area, centre


def _adopted(scene: Scene, touch: IntArray) -> IntArray:
    """Return the pairs of mesh corner and patch with the corners that no patch has as its own.

    Only corners at the same place as another corner of their face, or at the tip of a spike without area, are left out
    by triangulation; they take the patches of the nearest corner of the face.
    """
    known = np.bincount(touch[:, 0], minlength=len(scene.corner_vertex)) > 0
    lost = np.flatnonzero(~known & scene.live[scene.corner_face])
    # Every lost corner beside all corners of its face.
    first, size = scene.face_start[scene.corner_face[lost]], np.diff(scene.face_start)[scene.corner_face[lost]]
    begin = np.cumsum(size) - size
    row = np.repeat(np.arange(len(lost)), size)
    other = np.arange(len(row)) + (first - begin)[row]
    reach = scene.vertices[scene.corner_vertex[other]] - scene.vertices[scene.corner_vertex[lost]][row]
    far = np.where(known[other], np.sum(reach**2, axis=1), np.inf)
    nearest = other[np.lexsort((far, row))[begin]]
    # What touches the nearest corner touches the lost one.
    order = np.argsort(touch[:, 0], kind="stable")
    owner, patch = touch[order].T
    begin, end = (np.searchsorted(owner, nearest, side=side) for side in ("left", "right"))
    count = end - begin
    which = np.arange(count.sum()) + np.repeat(begin - np.cumsum(count) + count, count)
    return np.concatenate([touch, np.stack([np.repeat(lost, count), patch[which]], axis=1)])
