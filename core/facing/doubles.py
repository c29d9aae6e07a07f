# SPDX-License-Identifier: GPL-3.0-or-later
"""Doubled faces: two or more that lie in each other, corner on corner, as imports and failed extrusions leave them.

Each of them would receive the light that arrives there and send it on, so there would be twice as much. One of them
does; the others are lit like it.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, IntArray
from ..places import places
from ..scene import BACK, FRONT, Scene

_FIRST, _SECOND = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xC2B2AE3D27D4EB4F)


def without_doubles(scene: Scene) -> Scene:
    """Let only one of each set of doubled faces give light to others and stand in its way.

    Parameters
    ----------
    scene : Scene
        With sides that are decided.

    Returns
    -------
    Scene
        The same where no face is doubled. Sheets that lie on each other back to back, each lit on its own side, are
        none.
    """
    spare = _spare(scene)
    if not spare.any():
        return scene
    kept = {name: getattr(scene, name) & ~spare for name in ("occludes", "shades", "reflects", "emits")}
    return replace(scene, **kept)


def _spare(scene: Scene) -> BoolArray:
    """Return the faces in whose place another one is that does all that they do."""
    spare = np.zeros(len(scene.face_object), dtype=np.bool_)
    place = places(scene.vertices)[scene.corner_vertex]
    key = _keys(place, scene.face_start)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    some = np.unique(order[np.concatenate((same, same + 1))])
    some = some[scene.live[some]]
    if not len(some):
        return spare
    # Who is lit on both sides or emits is the one that stays.
    best = np.lexsort((some, -scene.emission[some].sum(axis=1), -_count(scene.sides[some]), key[some]))
    some = some[best]
    begin = np.append(True, key[some][1:] != key[some][:-1])
    first = some[np.flatnonzero(begin)][np.cumsum(begin) - 1]
    size = np.diff(scene.face_start)
    alike = (first != some) & (size[first] == size[some])
    some, first = some[alike], first[alike]
    does = np.array([scene.occludes, scene.shades, scene.reflects, scene.emits])
    alike = (does[:, first] >= does[:, some]).all(axis=0)
    alike &= ~scene.transmittance[some].any(axis=1) & ~scene.transmittance[first].any(axis=1)
    turned = (scene.face_normal[first] * scene.face_normal[some]).sum(axis=1) < 0
    sides = scene.sides[some]
    there = np.where(turned, (sides & FRONT) * BACK // FRONT | (sides & BACK) * FRONT // BACK, sides)
    alike &= (there & ~scene.sides[first]) == 0
    some, first = some[alike], first[alike]
    spare[some] = _same_corners(place, scene.face_start, some, first)
    return spare


def _keys(place: IntArray, face_start: IntArray) -> NDArray[np.uint64]:
    """Return a number for each face that depends on the places of its corners, whichever comes first."""
    mixed = (place.astype(np.uint64) + np.uint64(1)) * _FIRST
    mixed = (mixed ^ (mixed >> np.uint64(32))) * _SECOND
    mixed ^= mixed >> np.uint64(29)
    keys: NDArray[np.uint64] = np.add.reduceat(mixed, face_start[:-1])
    return keys


def _count(sides: NDArray[np.uint8]) -> IntArray:
    """Return how many sides are lit."""
    return np.asarray((sides & FRONT) // FRONT + (sides & BACK) // BACK, dtype=np.int64)


def _same_corners(place: IntArray, face_start: IntArray, some: IntArray, other: IntArray) -> BoolArray:
    """Tell which faces have corners at the same places as others that have as many, shape (n,)."""
    size = (face_start[1:] - face_start[:-1])[some]
    face = np.repeat(np.arange(len(some)), size)
    slot = np.arange(len(face)) - np.repeat(np.cumsum(size) - size, size)
    both = [place[face_start[which][face] + slot] for which in (some, other)]
    one, two = (corners[np.lexsort((corners, face))] for corners in both)
    return np.asarray(np.bincount(face, one != two, len(some)) == 0)
