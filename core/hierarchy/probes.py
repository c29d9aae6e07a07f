# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes: whether any light of a receiver leaves the scene, or meets what has none."""

import numpy as np
from numpy.typing import NDArray

from ..scene import BACK, FRONT
from ..sequences import GOLDEN
from ..visibility import Occluders, Surroundings
from .receivers import Receivers
from .tree import Float, Int
from .vectors import across

# Directions that each is probed in, and in how many rounds. An opening that fills a twentieth of what is seen must not
# slip through: its light would be made up by that of the walls around it.
_PROBES, _ROUNDS = 96, 8
# Groups that are asked first whether any of all sees a way out.
_FEW = 256
# Directions that tell whether a point is inside of something, and the share that then meets sides without light.
_LOOKS, _MOST = 12, 0.5


def receivers_shut_in(receivers: Receivers, corners: Float, occluders: Occluders) -> NDArray[np.bool_]:
    """Probe receivers group by group; parameters and result as of `groups_shut_in`, in the receivers' order."""
    return groups_shut_in(receivers.point, receivers.normal, receivers.first, corners, occluders)


def all_shut_in(receivers: Receivers, corners: Float, occluders: Occluders) -> bool:
    """Return whether no receiver sees a way out; parameters as of `receivers_shut_in`.

    Once one has found some, nobody else is asked.
    """
    first, asked = 0, _FEW
    while first < len(receivers):
        last = min(first + asked, len(receivers))
        if not groups_shut_in(
            receivers.point, receivers.normal, receivers.first[first : last + 1], corners, occluders
        ).all():
            return False
        first, asked = last, 4 * asked
    return True


def groups_shut_in(point: Float, normal: Float, first: Int, corners: Float, occluders: Occluders) -> NDArray[np.bool_]:
    """Probe points group by group, each direction from another one of the group.

    Parameters
    ----------
    point, normal : ndarray of shape (r, 3)
        [m]; unit length.
    first : ndarray of shape (g + 1,)
        First of each group.
    corners : ndarray of shape (n, 4, 3)
        Of everything there is [m].
    occluders : Occluders

    Returns
    -------
    ndarray of shape (r,)
        True for all of a group where every probe was blocked.
    """
    count = np.diff(first)
    turn = np.arange(_PROBES)
    chosen = first[:-1, None] + turn % np.maximum(count, 1)[:, None]
    return np.repeat(_shut_in(point[chosen], normal[chosen], corners, occluders), count)


def points_shut_in(point: Float, normal: Float, corners: Float, occluders: Occluders) -> NDArray[np.bool_]:
    """Probe single points, shape (k, 3); otherwise as `groups_shut_in`."""
    origin, axis = (np.repeat(part[:, None], _PROBES, axis=1) for part in (point, normal))
    return _shut_in(origin, axis, corners, occluders)


def points_facing_dark(
    point: Float, normal: Float, sides: NDArray[np.uint8] | None, occluders: Surroundings
) -> NDArray[np.bool_]:
    """Tell which points look at a side without light, as under a box, or on a shelf where a book stands.

    Parameters
    ----------
    point, normal : ndarray of shape (k, 3)
        [m]; unit length.
    sides : ndarray of shape (f,) or None
        Which sides of all faces that block have light, see `Scene`; the fronts when None.
    occluders : Surroundings

    Returns
    -------
    ndarray of shape (k,)
    """
    face, _, front = occluders.nearest(point, normal)
    lit = FRONT if sides is None else sides[face]
    return np.asarray((face >= 0) & (lit == np.where(front, BACK, FRONT)))


def points_among_dark(
    point: Float, normal: Float, sides: NDArray[np.uint8] | None, occluders: Surroundings
) -> NDArray[np.bool_]:
    """Tell which points look at a side without light, or mostly at such sides, as inside of a wall.

    Other walls may end in there, with their lit side. Parameters and result as of `points_facing_dark`.
    """
    dark = points_facing_dark(point, normal, sides, occluders)
    asked = np.flatnonzero(~dark)
    if len(asked):
        axis = np.repeat(normal[asked, None], _LOOKS, axis=1)
        start = np.repeat(point[asked, None], _LOOKS, axis=1)
        seen = points_facing_dark(start.reshape(-1, 3), ways_round(axis).reshape(-1, 3), sides, occluders)
        dark[asked] = seen.reshape(-1, _LOOKS).mean(axis=1) >= _MOST
    return dark


def ways_round(axis: Float, number: Int | None = None) -> Float:
    """Return directions round axes: as many as each counts, by Lambert's cosine, and even round the axis.

    Parameters
    ----------
    axis : ndarray of shape (k, n, 3)
        Unit length, n times the same.
    number : ndarray of shape (k,), optional
        By which they are turned; by default they are counted.

    Returns
    -------
    ndarray of shape (k, n, 3)
    """
    probes = axis.shape[1]
    cosine = np.sqrt((np.arange(probes) + 0.5) / probes)
    number = np.arange(len(axis)) if number is None else number
    angle = 2 * np.pi * GOLDEN * (number[:, None] * probes + np.arange(probes))
    t = across(axis)
    b = np.cross(axis, t)
    sine = np.sqrt(1 - cosine * cosine)
    around = (sine * np.cos(angle))[:, :, None] * t + (sine * np.sin(angle))[:, :, None] * b
    ways: Float = cosine[:, None] * axis + around
    return ways


def _shut_in(origin: Float, axis: Float, corners: Float, occluders: Occluders) -> NDArray[np.bool_]:
    """Return whether all probes from origins (k, probes, 3), round axes of the same shape, are blocked."""
    if not len(axis):
        return np.zeros(0, bool)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    far = 4 * float(np.sqrt(((high - low) ** 2).sum())) + 1e-300
    way = ways_round(axis)
    shut = np.ones(len(axis), bool)
    # A few at a time: who has found a way out needs no more.
    for few in range(_ROUNDS):
        asked = np.flatnonzero(shut)
        start, end = origin[asked, few::_ROUNDS], (origin + far * way)[asked, few::_ROUNDS]
        blocked = occluders.blocked(start.reshape(-1, 3), end.reshape(-1, 3))
        shut[asked] = blocked.reshape(start.shape[:2]).all(axis=1)
    return shut
