# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that enters translucent surfaces and leaves diffusely on their other side: lampshades, curtains, leaves, paper.

What such a surface shows on one side is reflected there or comes from the other: B = E + rho H + tau H of the other
side. Both of its sides have patches, which know each other; nothing else in the exchange of light changes.
"""

from dataclasses import dataclass, replace

import numpy as np

from .arrays import FloatArray, IntArray
from .meshing import Patches
from .scene import BACK, FRONT, Scene


@dataclass(frozen=True, eq=False)
class Translucence:
    """Who has light from whose other side.

    Attributes
    ----------
    piece, other : ndarray of shape (k,)
        Each of the patches or elements that are translucent, and the one on its other side.
    share : ndarray of shape (k, 3)
        Of what arrives at the other side, what leaves here: tau.
    """

    piece: IntArray
    other: IntArray
    share: FloatArray

    def leaving(self, irradiance: FloatArray) -> FloatArray:
        """Return the light that comes through, shape (n, 3) [W/m^2], of what arrives at all n pieces."""
        light = np.zeros_like(irradiance)
        light[self.piece] = self.share * irradiance[self.other]
        return light

    def albedo(self, reflectance: FloatArray) -> FloatArray:
        """Return the share of what arrives that leaves on either side, shape (n, 3)."""
        total = reflectance.copy()
        total[self.other] += self.share
        return total


def scattered(reflectance: FloatArray, irradiance: FloatArray, through: Translucence | None) -> FloatArray:
    """Return what leaves surfaces of the light that arrives at them.

    Parameters
    ----------
    reflectance : ndarray of shape (n, 3)
        rho.
    irradiance : ndarray of shape (n, 3)
        H [W/m^2].
    through : Translucence or None
        None where nothing is translucent.

    Returns
    -------
    ndarray of shape (n, 3)
        [W/m^2].
    """
    light = reflectance * irradiance
    return light if through is None else light + through.leaving(irradiance)


def patch_translucence(patches: Patches) -> Translucence | None:
    """Return which patches have light from their other side; None where nothing is translucent."""
    piece = np.flatnonzero(patches.opposite >= 0)
    if not len(piece):
        return None
    return Translucence(piece, patches.opposite[piece], patches.transmittance[piece])


def piece_translucence(corners: FloatArray, patch: IntArray, patches: Patches) -> Translucence | None:
    """Return which pieces of patches have light from their other side.

    Parameters
    ----------
    corners : ndarray of shape (n, 4, 3)
        Of the pieces [m]; a triangle repeats its last corner. Both sides are cut alike.
    patch : ndarray of shape (n,)
        The patch that each is a piece of.
    patches : Patches

    Returns
    -------
    Translucence or None
        None where nothing is translucent.
    """
    piece = np.flatnonzero(patches.opposite[patch] >= 0)
    if not len(piece):
        return None
    own = patch[piece]
    pair = np.minimum(own, patches.opposite[own])
    # Pieces back to back have the same corners, bit for bit, in another order.
    points = corners[piece].copy()
    triangle = (points[:, 2] == points[:, 3]).all(axis=1)
    points[triangle, 3] = np.inf
    points.sort(axis=1)
    points[triangle, 3] = 0.0
    x, y, z = points.sum(axis=1).T
    order = np.lexsort((z, y, x, own > pair, pair))
    # The one half of each pair's pieces follows the other half.
    begin = np.searchsorted(pair[order], pair[order])
    count = np.searchsorted(pair[order], pair[order], side="right") - begin
    place = np.arange(len(order)) - begin
    other = np.zeros(len(order), dtype=np.int64)
    other[order] = order[begin + (place + count // 2) % count]
    return Translucence(piece, piece[other], patches.transmittance[own])


@dataclass(frozen=True, eq=False)
class Behind:
    """The other sides of translucent faces, as a scene of their own.

    Attributes
    ----------
    scene : Scene
        Those faces, with the side shown that is not shown else.
    patches : Patches
        Of the whole scene; but the corners of `scene` touch the patches on that side.
    corner : ndarray of shape (k,)
        Which of the whole scene's corners those of `scene` are.
    """

    scene: Scene
    patches: Patches
    corner: IntArray


def behind(scene: Scene, patches: Patches) -> Behind | None:
    """Turn to the other sides of translucent faces.

    Parameters
    ----------
    scene : Scene
        Without sides that are left open.
    patches : Patches
        How it is meshed.

    Returns
    -------
    Behind or None
        None where nothing is translucent.
    """
    face = np.unique(patches.face[patches.opposite >= 0])
    if not len(face):
        return None
    chosen = np.zeros(len(scene.face_object), dtype=np.bool_)
    chosen[face] = True
    corner = np.flatnonzero(chosen[scene.corner_face])
    fields = ("reflectance", "emission", "transmittance", "tint", "ior", "face_object", "divisions", "max_edge")
    flags = ("occludes", "shades", "reflects", "emits")
    part = replace(
        scene,
        corner_vertex=scene.corner_vertex[corner],
        face_start=np.append(0, np.cumsum(np.diff(scene.face_start)[face])),
        corner_normals=scene.corner_normals[corner],
        sides=np.where(scene.sides[face] == BACK, FRONT, BACK),
        paint=None,
        **{name: getattr(scene, name)[face] for name in fields + flags},
    )
    number = np.full(len(scene.corner_vertex), -1)
    number[corner] = np.arange(len(corner))
    touching = number[patches.touch_corner] >= 0
    touch = number[patches.touch_corner[touching]], patches.opposite[patches.touch_patch[touching]]
    return Behind(part, replace(patches, touch_corner=touch[0], touch_patch=touch[1]), corner)


@dataclass(frozen=True, eq=False)
class LightBehind:
    """What arrives on the other side at corners of translucent faces.

    Attributes
    ----------
    corner : ndarray of shape (k,)
        Of the scene.
    irradiance, direct : ndarray of shape (k, 3)
        All of it, and the part that comes straight from what emits, from lamps and from the sky [W/m^2].
    """

    corner: IntArray
    irradiance: FloatArray
    direct: FloatArray
