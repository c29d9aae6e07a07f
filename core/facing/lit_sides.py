# SPDX-License-Identifier: GPL-3.0-or-later
"""Where light can reach, by a few thousand rays.

Paths from the emitters, and from where lamps and the sky shine, leave points that light comes to. Then points on both
sides of every island of faces look for one of those, or for a lamp: at once, or after some bounces of their own. That
is bidirectional path tracing (Lafortune, Willems 1993; Veach, Guibas 1995), asked only whether, not how much.

What is wanted is the geometry of the light, so every surface passes light on, whatever its reflectance. Two kinds of
lit sides do not count when the other side has light as well: a back that shines only on its own island, like the inside
of a bulb, and a side that sees nothing but the sky: a back always, a front where the back is the inside of a room.
Neither does the inside of a closed island in which no light starts, nor its outside where all light starts in it.

"Front" and "back" are those of most faces of an island: what is turned against its neighbours has its own the other
way round.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lighting.lamps import SkyLamp, scene_reach
from ..meshing import Patches
from ..occlusion.core_part import core_part
from ..occlusion.surfaces import MARGIN
from ..scene import AUTO, BACK, BOTH, FRONT, BoolArray, FloatArray, IntArray, Scene
from ..visibility import Surroundings, sky_occluders
from .enclosures import Enclosure, enclosure
from .orientation import Orientation

Generator = np.random.Generator

# Paths from light, and how often they are followed from surface to surface.
PATHS = 512
BOUNCES = 5
# Points on islands that look for light, and how often they look farther; the least and the most on one side.
LOOKS = 1024
LOOK_BOUNCES = 3
FEWEST, MOST = 4, 48
# Times as many points look a second time from fronts, where only the back has light so far.
_AGAIN = 4
# Shares of the rays from the inside of a room that are caught, and that the room itself catches, at least.
_CAUGHT, _CAUGHT_BY_ITSELF = 0.7, 0.3
# Lit points among which the one that faces a point best is asked for.
_CANDIDATES = 48
# Share of a patch, from each edge, without points: there surfaces touch.
_EDGE = 0.02
# Points stand so many margins before their surface, but no farther than this share of their patch's size: from closer
# the faces next door in a hollow count as the same plane, and do not block.
_MARGINS, _NEAR = 3.0, 0.05
# A path turns this share of its way before the surface it hits: where it has been, it is in no other surface.
_SHORT = 1e-3
# Cosine below which a point does not see along its surface.
_GRAZING = 1e-3
_NAMES = ("place", "normal", "node", "alone")


def lit_sides(
    scene: Scene, patches: Patches, group: IntArray, shape: Orientation, occluders: Surroundings, rng: Generator
) -> NDArray[np.uint8]:
    """Find the sides that light can reach.

    Parameters
    ----------
    scene : Scene
        Sides that are off absorb what meets them.
    patches : Patches
        How the scene is meshed.
    group : ndarray of shape (f,)
        What is decided as one: the island of each face, or something coarser.
    shape : Orientation
        Which faces have their front where the others of their island have their back.
    occluders : Surroundings
        What blocks.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of shape (g,)
        FRONT, BACK or BOTH for each group, as faces have it that are not turned; FRONT for those without faces marked
        AUTO, and where no light comes.
    """
    search = _Search(scene, patches, group, shape, occluders, rng)
    mine = 2 * np.unique(group[(scene.sides == AUTO) & scene.live])
    nodes = np.sort(np.concatenate([mine, mine + 1]))
    lit = search.paths()
    reached, alone = search.look(nodes, lit)
    # A front that is missed would be dark in the result: look once more where only the back has light.
    doubted = np.flatnonzero((reached | alone)[1::2] & ~(reached | alone)[::2]) * 2
    for found, more in zip((reached, alone), search.look(doubted, lit, _AGAIN), strict=True):
        found |= more
    front = (reached | alone)[::2]
    back = reached[1::2] | (alone[1::2] & ~front)

    # What gets through the edges of a closed shell is no light.
    for shell in np.flatnonzero(front & back):
        starts = search.enclosure(int(shell))
        if starts is not None and starts.front != starts.back:
            front[shell], back[shell] = starts.front, starts.back

    # Where both are lit, one from which nothing is seen adds nothing to the light elsewhere.
    torn = np.flatnonzero(front & back) * 2
    caught, own = search.caught(np.sort(np.concatenate([torn, torn + 1])))
    inside = (caught[1::2] > _CAUGHT) & (own[1::2] > _CAUGHT_BY_ITSELF)
    back &= ~(front & (caught[1::2] == 0))
    front &= ~(back & (caught[::2] == 0) & inside)
    return np.where(front & back, BOTH, np.where(back, BACK, FRONT)).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class _Points:
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

    def __getitem__(self, chosen: IntArray | BoolArray) -> "_Points":
        return _Points(self.place[chosen], self.normal[chosen], self.node[chosen], self.alone[chosen])


class _Search:
    """The rays of `lit_sides`, which has the same parameters."""

    def __init__(
        self,
        scene: Scene,
        patches: Patches,
        group: IntArray,
        shape: Orientation,
        occluders: Surroundings,
        rng: Generator,
    ) -> None:
        self._scene, self._group, self._shape, self._occluders, self._rng = scene, group, shape, occluders, rng
        self._surface = _Surface(scene, patches, group, shape, np.ones(len(patches.face), dtype=bool))
        self._emitters = _Surface(scene, patches, group, shape, patches.emission.any(axis=1))
        self._reach = scene_reach(scene)
        nodes = np.unique(self._emitters.node)
        self._starts = self._emitters.draw(nodes, max(1, PATHS // max(1, len(nodes))), rng)

    def enclosure(self, shell: int) -> Enclosure | None:
        """Tell on which sides of a group light starts, if it is a closed shell."""
        return enclosure(self._scene, np.flatnonzero(self._group == shell), self._shape, self._starts.place)

    def paths(self) -> list[_Points]:
        """Return points that light starts from, and with them those that it comes to."""
        starts = [self._starts]
        if self._scene.lamps:
            nodes = np.unique(self._surface.node)
            points = self._surface.draw(nodes, max(1, 2 * PATHS // max(1, len(nodes))), self._rng)
            points = points[self._shone(points)]
            # No island shines alone where a lamp does.
            starts.append(_Points(points.place, points.normal, points.node, np.zeros(len(points.node), dtype=bool)))
        start = points = _joined(starts)
        lit = [start]
        for _ in range(BOUNCES):
            points = self._bounced(points)
            lit.append(points)
        return [part for part in (start, _joined(lit)) if len(part.node)]

    def look(self, nodes: IntArray, lit: list[_Points], times: int = 1) -> tuple[BoolArray, BoolArray]:
        """Return which sides, of all, light comes to from elsewhere, and which from their own island alone."""
        reached = np.zeros(2 * int(np.max(self._group) + 1), dtype=np.bool_)
        alone = reached.copy()
        points = self._surface.draw(nodes, self._each(nodes, times), self._rng)
        for bounce in range(LOOK_BOUNCES):
            reached[points.node[self._shone(points)]] = True
            for source in lit:
                which, seen = self._connected(points, source)
                node = points.node[which]
                own = points.alone[which] & source.alone[seen] & (source.node[seen] // 2 == node // 2)
                reached[node[~own]] = True
                alone[node[own]] = True
            points = points[~reached[points.node]]
            if bounce < LOOK_BOUNCES - 1:
                points = self._bounced(points)
        return reached, alone

    def caught(self, nodes: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the share of rays from each side, of all, that meet anything, and that meet their own island."""
        points = self._surface.draw(nodes, self._each(nodes), self._rng)
        face, count = self._met(points)[1], 2 * int(np.max(self._group) + 1)
        met = face >= 0
        own = met & (self._group[face] == points.node // 2)
        rays = np.maximum(np.bincount(points.node, minlength=count), 1)
        return np.bincount(points.node, met, count) / rays, np.bincount(points.node, own, count) / rays

    def _each(self, nodes: IntArray, times: int = 1) -> int:
        """Return how many points each side gets."""
        return int(np.clip(times * LOOKS // max(1, len(nodes)), FEWEST, times * MOST))

    def _shone(self, points: _Points) -> BoolArray:
        """Return which points see one of the lamps, picked for each at random by the light that it would bring."""
        lamps, count = self._scene.lamps, len(points.node)
        found = np.zeros(count, dtype=np.bool_)
        if not lamps or count == 0:
            return found
        light = np.stack([lamp.unshadowed(points.place, points.normal).sum(axis=1) for lamp in lamps])
        below = np.cumsum(light, axis=0)
        pick = (below < self._rng.random(count) * below[-1]).sum(axis=0)
        u, v = self._rng.random((2, count))
        for index, lamp in enumerate(lamps):
            which = np.flatnonzero((pick == index) & (below[-1] > 0))
            place, normal = points.place[which], points.normal[which]
            way, length, gain = lamp.sample(place, normal, u[which], v[which])
            end = place + np.minimum(length, self._reach)[:, None] * way
            blockers = sky_occluders(self._occluders) if isinstance(lamp, SkyLamp) else self._occluders
            clear = ~blockers.blocked(place, end)
            # Light that nothing blocks is in every solid; there it is not looked for.
            clear |= (points.node[which] % 2 == 0) & (not lamp.shadows)
            found[which] = clear & (gain > 0 if gain.ndim == 1 else gain.any(axis=1))
        return found

    def _connected(self, points: _Points, source: _Points) -> tuple[IntArray, IntArray]:
        """Return the points that see one of the source's, and which: the one of a few that they face best."""
        index = self._rng.integers(len(source.node), size=(len(points.node), _CANDIDATES))
        to = source.place[index] - points.place[:, None]
        to /= np.maximum(np.linalg.norm(to, axis=2, keepdims=True), 1e-300)
        leaving = -(to * source.normal[index]).sum(axis=2)
        arriving = (to * points.normal[:, None]).sum(axis=2)
        facing = np.minimum(leaving, arriving)
        best = facing.argmax(axis=1)
        which = np.flatnonzero(facing.max(axis=1, initial=-1.0) > _GRAZING)
        seen = index[which, best[which]]
        clear = ~self._occluders.blocked(points.place[which], source.place[seen])
        return which[clear], seen[clear]

    def _met(self, points: _Points) -> tuple[FloatArray, IntArray, FloatArray, BoolArray]:
        """Return a direction from each point, the face that it meets or -1, how far away, and whether at its front."""
        # Lambert's cosine: a point on the unit sphere round the tip of the normal.
        z, turn = 2.0 * self._rng.random(len(points.node)) - 1.0, 2.0 * np.pi * self._rng.random(len(points.node))
        ring = np.sqrt(1.0 - z**2)
        way = points.normal + (1.0 - _GRAZING) * np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        return way, *self._occluders.nearest(points.place, way)

    def _bounced(self, points: _Points) -> _Points:
        """Return where rays from points meet a side that may have light; the others are left out."""
        scene = self._scene
        way, face, distance, front = self._met(points)
        allowed = (scene.sides[face] == AUTO) | (scene.sides[face] & np.where(front, FRONT, BACK) > 0)
        hit = np.flatnonzero((face >= 0) & allowed)
        face, node = face[hit], points.node[hit]
        return _Points(
            points.place[hit] + ((1.0 - _SHORT) * distance[hit])[:, None] * way[hit],
            scene.face_normal[face] * np.where(front[hit], 1.0, -1.0)[:, None],
            node,
            points.alone[hit] & (self._group[face] == node // 2),
        )


def _joined(parts: list[_Points]) -> _Points:
    """Return points one after the other."""
    return _Points(*(np.concatenate([getattr(part, name) for part in parts]) for name in _NAMES))


class _Surface:
    """Sides of patches that may have light, to draw points from.

    Attributes
    ----------
    node : ndarray of shape (s,)
        Of each side, as in `_Points`; sorted.
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

    def draw(self, nodes: IntArray, each: int, rng: Generator) -> _Points:
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
        return _Points(place, self._normal[slot], np.repeat(nodes, each), np.ones(len(slot), dtype=bool))
