# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the edges of patches may be where nobody has chosen: as the scene is large, then as light changes.

A wall of one face has light at four corners, and nothing in between. First every face is cut as evenly as the scene is
large; then, after a first look at the light, once more where it changes between neighbouring corners (adaptive
subdivision: Cohen, Greenberg, Immel, Brock 1986). Only where surfaces show light: black ones, such as most lamps, look
the same anywhere.
"""

import numpy as np

from .arrays import FloatArray
from .meshing import Patches
from .occlusion.core_part import CorePart, core_part
from .scene import Scene
from .unshown import light_on_faces

# Land around a house is no measure of it: the size is that of the box around so many of the faces, the smaller ones, or
# this share of the scene's.
_MOST_FACES, _SMALLEST = 0.75, 1 / 8
# Share of all patches that a single face may have before light is known.
_OF_ONE = 1 / 4
# Changes are told as screens show them: mid-grey is the mean light, and what is much brighter is white anyway.
_GAMMA, _WHITE = 1 / 2.2, 6.0
# Change along a patch that is no reason to cut it; each time as much more is a part more of its edges, up to the most.
_CHANGE, _PARTS = 0.08, 4
# The same for how far the mean of its light is from that of its corners.
_MISSED = 0.16


def even_edges(scene: Scene, size: float, most: int, *, white: bool = False) -> FloatArray:
    """Return how long the edges of patches may be, as the scene is large.

    Parameters
    ----------
    scene : Scene
    size : float
        Side of a square that is small enough, as a share of the diagonal of the scene's core, and of the way to it.
    most : int
        Patches that there may be on faces that are larger, about. The largest faces give way.
    white : bool
        Whether black surfaces show light, too.

    Returns
    -------
    ndarray of shape (f,)
        [m]; NaN for faces that are small, that look the same anywhere, or that have a length of their own.
    """
    corners, first = scene.vertices[scene.corner_vertex], scene.face_start[:-1]
    if not scene.live.any():
        return np.full(len(first), np.nan)
    low, high = np.minimum.reduceat(corners, first), np.maximum.reduceat(corners, first)
    core = core_part(low[scene.live], high[scene.live])
    edge = size * _extent(core, low[scene.live], high[scene.live]) * (1.0 + core.away(np.stack([low, high], axis=1)))
    count = scene.face_area / edge**2
    shows = white | (scene.reflectance > 0).any(axis=1) | (scene.transmittance > 0).any(axis=1)
    if scene.paint is not None:
        shows[scene.paint.face] = True
    cut = shows & scene.live & np.isnan(scene.max_edge) & (count > 1.0)
    edge[cut] *= np.sqrt(np.maximum(count[cut] / min(_cap(count[cut], most), _OF_ONE * most), 1.0))
    return np.where(cut, edge, np.nan)


def _extent(core: CorePart, low: FloatArray, high: FloatArray) -> float:
    """Return the diagonal of what most faces are in, if that is not very small in the core of the scene [m]."""
    order = np.argsort(((high - low) ** 2).sum(axis=1), kind="stable")[: int(np.ceil(_MOST_FACES * len(low)))]
    most = float(np.linalg.norm(high[order].max(axis=0) - low[order].min(axis=0)))
    return float(np.clip(most, _SMALLEST * core.size, core.size))


def changing_edges(
    scene: Scene, reflectance: FloatArray, patches: Patches, light: tuple[FloatArray, FloatArray], most: int
) -> FloatArray:
    """Return how long the edges of patches may be, as light changes on them.

    Parameters
    ----------
    scene : Scene
        Cut evenly.
    reflectance : ndarray of shape (f,)
        Of the whole face that each of its faces is a part of: patterns of textures are no changes of light.
    patches : Patches
        One or more of each face.
    light : tuple of ndarray of shape (p, 3) and (c, 3)
        What arrives at each patch and at each corner [W/m^2].
    most : int
        Patches that there may be more, about: where light changes least nothing is cut then.

    Returns
    -------
    ndarray of shape (f,)
        [m]; NaN where patches are small enough.
    """
    there, seen = (reflectance * values for values in light_on_faces(scene, patches, *light))
    E = scene.corner_emission.mean(axis=1)
    leaving = reflectance[scene.corner_face] * light[1].mean(axis=1) + E
    common = float(np.average(there, weights=scene.face_area)) or 1.0
    corner, first = _as_shown(leaving / common), scene.face_start[:-1]
    change = np.maximum.reduceat(corner, first) - np.minimum.reduceat(corner, first)
    missed = np.abs(_as_shown(there / common) - _as_shown(seen / common))
    urgency = np.maximum(change / _CHANGE, missed / _MISSED)
    parts = np.clip(np.ceil(urgency), 1, _PARTS)
    order = np.argsort(-urgency, kind="stable")
    parts[order[np.cumsum(parts[order] ** 2 - 1) > most]] = 1
    position = scene.vertices[scene.corner_vertex]
    length = np.linalg.norm(position[scene.following_corner] - position, axis=1)
    return np.where(parts > 1, np.maximum.reduceat(length, first) / parts, np.nan)


def _as_shown(light: FloatArray) -> FloatArray:
    """Return light, in shares of what is common, as bright as screens show it."""
    return np.asarray(np.clip(light, 0.0, _WHITE) ** _GAMMA)


def _cap(count: FloatArray, most: int) -> float:
    """Return the most that single numbers may be, so that all together are no more than some number."""
    ordered = np.sort(count)
    # With all above the k-th cut down to it.
    total = np.cumsum(ordered) + ordered * np.arange(len(ordered) - 1, -1, -1)
    fits = int(np.searchsorted(total, most, side="right"))
    if fits == len(ordered):
        return np.inf
    below = float(ordered[:fits].sum())
    return max((most - below) / (len(ordered) - fits), 1.0)
