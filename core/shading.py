# SPDX-License-Identifier: GPL-3.0-or-later
"""From light on patches to colours at the corners of the mesh, so that borders between patches do not show (T16).

What is interpolated is the irradiance H, not the colour: a corner takes the mean of H over the patches that meet at
its vertex, but only those of the same object whose corners there share its normal. Smooth surfaces and flat stretches
blend, hard edges stay hard, and other surfaces at the same place never bleed. The surface's own reflectance and
emission then give the colour, such as the radiance L = (E + rho H) / pi.
"""

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .meshing import Patches
from .scene import BACK, Scene
from .translucence import LightBehind

# Unit normals that differ by less are one: single precision and rounding, not a bend [rad].
SAME_NORMAL = 1e-3


def corner_colours(
    scene: Scene,
    irradiance: FloatArray,
    direct: FloatArray,
    light: str = "combined",
    behind: LightBehind | None = None,
) -> FloatArray:
    """Return the colour of every face corner from the light that arrives there.

    Parameters
    ----------
    scene : Scene
    irradiance : ndarray of shape (c, 3)
        H at each of the scene's c corners [W/m^2].
    direct : ndarray of shape (c, 3)
        The part of it that comes straight from what emits, from lamps and from the sky [W/m^2].
    light : {"combined", "lighting", "direct", "indirect"}
        (E + rho H) / pi, H / pi, (E + rho direct) / pi, or rho (H - direct) / pi.
    behind : LightBehind, optional
        What arrives on the other side of translucent faces: tau times that is added to rho H. Their lighting is what
        a white surface would show there that shares its light out between both sides as they do.

    Returns
    -------
    ndarray of shape (c, 3)
        Radiance L, linear [W/(m^2 sr)].
    """
    E, rho = scene.corner_emission, scene.corner_reflectance
    leaving = (1.0 if light == "lighting" else rho) * _asked_for(light, irradiance, direct)
    if behind is not None:
        here, there = behind.corner, _asked_for(light, behind.irradiance, behind.direct)
        tau = scene.transmittance[scene.corner_face[here]]
        if light == "lighting":
            leaving[here] += tau / np.maximum(rho[here] + tau, 1e-300) * (there - leaving[here])
        else:
            leaving[here] += tau * there
    return np.asarray((E + leaving if light in {"combined", "direct"} else leaving) / np.pi)


def _asked_for(light: str, irradiance: FloatArray, direct: FloatArray) -> FloatArray:
    """Return the part of what arrives that a kind of colours tells of."""
    if light == "direct":
        return direct
    # Rounding must not make darkness negative.
    return np.maximum(irradiance - direct, 0.0) if light == "indirect" else irradiance


def corner_irradiance(scene: Scene, patches: Patches, irradiance: FloatArray) -> FloatArray:
    """Return the light that arrives at every face corner.

    Parameters
    ----------
    scene : Scene
    patches : Patches
        p patches that mesh the scene.
    irradiance : ndarray of shape (p, 3)
        H of every patch [W/m^2].

    Returns
    -------
    ndarray of shape (c, 3)
        H at each of the scene's c corners [W/m^2].
    """
    place = _places(scene)
    smooth = _groups(place, shown_normals(scene))
    of_group, lit = _means(smooth, patches, irradiance)
    # Corners of faces without patches take what else is lit at their vertex.
    of_place, _ = _means(place, patches, irradiance)
    return np.where(lit[smooth][:, None], of_group[smooth], of_place[place])


def corner_angles(scene: Scene) -> FloatArray:
    """Return the angle of the face at each corner of a scene, shape (c,) [rad]; 0 at an edge without length.

    As weights they make a vertex's mean independent of how its faces are cut into triangles.
    """
    position = scene.vertices[scene.corner_vertex]
    ahead, behind = position[scene.following_corner] - position, position[scene.preceding_corner] - position
    sine = np.linalg.norm(np.cross(ahead, behind), axis=1)
    return np.asarray(np.arctan2(sine, np.einsum("ij,ij->i", ahead, behind)))


def vertex_means(colours: FloatArray, weight: FloatArray, corner_vertex: IntArray, count: int) -> FloatArray:
    """Average the colours of the corners at each vertex.

    Parameters
    ----------
    colours : ndarray of shape (c, 3)
        One for each corner.
    weight : ndarray of shape (c,)
        Weight of each corner, not negative.
    corner_vertex : ndarray of shape (c,)
        Vertex of each corner.
    count : int
        Number of vertices.

    Returns
    -------
    ndarray of shape (count, 3)
        Black at vertices without faces.
    """
    total = np.bincount(corner_vertex, weight, count)
    # Where all angles are 0 the corners count alike.
    weight = np.where(total[corner_vertex] > 0.0, weight, 1.0)
    total = np.bincount(corner_vertex, weight, count)
    sums = np.stack([np.bincount(corner_vertex, weight * channel, count) for channel in colours.T], axis=1)
    return sums / np.maximum(total, np.finfo(float).tiny)[:, None]


def _places(scene: Scene) -> IntArray:
    """Return for each corner a number that it shares with the corners of the same object at the same vertex."""
    key = scene.face_object[scene.corner_face] * max(1, len(scene.vertices)) + scene.corner_vertex
    return np.asarray(np.unique(key, return_inverse=True)[1]).reshape(-1)


def shown_face_normals(scene: Scene) -> FloatArray:
    """Return the unit normals of faces on the sides that they show, shape (f, 3): the back's where only that is lit."""
    return np.where(scene.sides == BACK, -1.0, 1.0)[:, None] * scene.face_normal


def shown_normals(scene: Scene) -> FloatArray:
    """Return the normals of corners on the sides that their faces show.

    A surface that is lit on both sides shows its front: what Cycles bakes, and what viewers show that leave out backs.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    ndarray of shape (c, 3)
        Unit normals; where one looks away from the side that is shown, it is turned round, since the normals of smooth
        surfaces are those of most faces, however the others are turned.
    """
    away = (scene.corner_normals * shown_face_normals(scene)[scene.corner_face]).sum(axis=1) < 0.0
    return np.where(away[:, None], -scene.corner_normals, scene.corner_normals)


def smooth_groups(scene: Scene) -> IntArray:
    """Return for each corner a number that it shares with those it has to look like.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    ndarray of shape (c,)
        From 0 up, without gaps: one for each vertex of an object and each normal there.
    """
    return _groups(_places(scene), shown_normals(scene))


def _groups(place: IntArray, normals: FloatArray) -> IntArray:
    """Return for each corner a number that it shares with the corners at the same place with the same normal."""
    group = np.full(len(place), -1)
    left = np.arange(len(place))
    # One normal of every place at a time: its first corner left leads those that look the same way.
    while len(left):
        _, first, which = np.unique(place[left], return_index=True, return_inverse=True)
        leader = left[first][which.reshape(-1)]
        same = np.linalg.norm(normals[left] - normals[leader], axis=1) < SAME_NORMAL
        group[left[same]] = leader[same]
        left = left[~same]
    return np.asarray(np.unique(group, return_inverse=True)[1]).reshape(-1)


def _means(group: IntArray, patches: Patches, irradiance: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return the mean irradiance of each group's patches, shape (g, 3), and which groups have any."""
    groups = int(np.max(group, initial=-1)) + 1
    at = group[patches.touch_corner]
    count = np.bincount(at, minlength=groups)
    H = irradiance[patches.touch_patch]
    total = np.stack([np.bincount(at, H[:, channel], minlength=groups) for channel in range(3)], axis=1)
    return total / np.maximum(count, 1)[:, None], count > 0
