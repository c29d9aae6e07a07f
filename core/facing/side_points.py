# SPDX-License-Identifier: GPL-3.0-or-later
"""Points on the sides of patches, spread evenly: where the search for light begins, and where its paths come by."""

from dataclasses import dataclass, fields

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..meshing import Patches
from ..occlusion.core_part import core_part
from ..occlusion.surfaces import MARGIN
from ..scene import AUTO, Scene
from .orientation import Orientation

# Share of a patch, from each edge, without points: there surfaces touch.
_EDGE = 0.02
# Points stand so many margins before their surface, but no farther than this share of their patch's size: from closer
# the faces next door in a hollow count as the same plane, and do not block.
_MARGINS, _NEAR = 3.0, 0.05


@dataclass(frozen=True, eq=False)
class SidePoints:
    """Points on one side of a surface, or just before it.

    Attributes
    ----------
    place, normal : ndarray of shape (k, 3)
        Where, and the unit normal of the side [m].
    node : ndarray of shape (k,)
        The side that a path through the point began on: twice the number of its island, one more for the back.
    alone : ndarray of shape (k,)
        Whether all surfaces of that path are parts of the same island.
    """

    place: FloatArray
    normal: FloatArray
    node: IntArray
    alone: BoolArray

    def __getitem__(self, chosen: IntArray | BoolArray) -> "SidePoints":
        return SidePoints(self.place[chosen], self.normal[chosen], self.node[chosen], self.alone[chosen])


def joined(parts: list[SidePoints]) -> SidePoints:
    """Return points one after the other."""
    columns = (np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(SidePoints))
    return SidePoints(*columns)


class PatchSides:
    """Sides of patches that may have light, to draw points from.

    Parameters
    ----------
    scene : Scene
        The other side of a patch counts as well where its face is marked AUTO.
    patches : Patches
    group : ndarray of shape (f,)
        The island of each face.
    shape : Orientation
        Of the scene.
    chosen : ndarray of shape (p,)
        The patches that count.

    Attributes
    ----------
    node : ndarray of shape (s,)
        Of each side, as in `SidePoints`; sorted.
    """

    def __init__(self, scene: Scene, patches: Patches, group: IntArray, shape: Orientation, chosen: BoolArray) -> None:
        sure = np.flatnonzero(chosen)
        undecided = sure[scene.sides[patches.face[sure]] == AUTO]
        patch = np.concatenate([sure, undecided])
        turned = np.repeat([1, -1], [len(sure), len(undecided)])
        behind = (turned * patches.side[patch] < 0) ^ shape.turned[patches.face[patch]]
        node = 2 * group[patches.face[patch]] + behind
        order = np.argsort(node, kind="stable")
        patch, self.node = patch[order], node[order]
        self._corners = patches.corners[patch]
        self._normal = patches.normal[patch] * turned[order, None]
        self._below = np.append(0.0, np.cumsum(patches.area[patch]))
        low, high = patches.corners.min(axis=1), patches.corners.max(axis=1)
        size = core_part(low, high).size if len(low) else 0.0
        self._lift = np.minimum(_MARGINS * MARGIN * size, _NEAR * np.sqrt(patches.area[patch]))

    def draw(self, nodes: IntArray, each: int, rng: np.random.Generator) -> SidePoints:
        """Return so many points of each node, spread evenly over its area."""
        start = np.repeat(np.searchsorted(self.node, nodes, side="left"), each)
        stop = np.repeat(np.searchsorted(self.node, nodes, side="right"), each)
        share = (np.tile(np.arange(each), len(nodes)) + rng.random(len(start))) / each
        target = self._below[start] + share * (self._below[stop] - self._below[start])
        slot = np.clip(np.searchsorted(self._below, target, side="right") - 1, start, stop - 1)
        a, b, c, d = self._corners[slot].transpose(1, 0, 2)
        u, v = _EDGE + (1.0 - 2.0 * _EDGE) * rng.random((2, len(slot), 1))
        # A triangle is half a parallelogram: fold the other half back.
        triangle = (c == d).all(axis=1)[:, None]
        fold = triangle & (u + v > 1.0)
        u, v = np.where(fold, 1.0 - u, u), np.where(fold, 1.0 - v, v)
        quad = (1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * d + u * c)
        place = np.where(triangle, a + u * (b - a) + v * (c - a), quad) + self._lift[slot, None] * self._normal[slot]
        return SidePoints(place, self._normal[slot], np.repeat(nodes, each), np.ones(len(slot), dtype=bool))
