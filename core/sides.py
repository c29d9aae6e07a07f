# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sides of the surfaces light can reach, for the faces whose sides a scene leaves open.

Surfaces in Blender reflect and emit on both sides, but most of them are seen from one side only, and a second side
costs as much as the first. So a few thousand rays find out. Paths from the emitters leave points that light comes to.
Then points on both sides of every island of faces look for one of those: at once, or after some bounces of their own.
That is bidirectional path tracing (Lafortune, Willems 1993; Veach, Guibas 1995), asked only whether, not how much.

What is wanted is the geometry of the light, so every surface passes light on, whatever its reflectance. An island that
shines only on itself, like the inside of a bulb, does not count as lit there, unless nothing else would be left of it.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .islands import islands
from .meshing import Patches
from .scene import AUTO, BACK, BOTH, FRONT, BoolArray, FloatArray, IntArray, Scene
from .visibility import Occluders

Generator = np.random.Generator

# Paths from emitters, and how often they are followed from surface to surface.
PATHS = 512
BOUNCES = 5
# Points on islands that look for light, and how often they look farther; the least and the most on one side.
LOOKS = 1024
LOOK_BOUNCES = 3
FEWEST, MOST = 4, 48
# More islands than this are taken together, object by object.
MOST_ISLANDS = 500
# Lit points among which the one that faces a point best is asked for.
_CANDIDATES = 48
# Share of a patch, from each edge, without points: there surfaces touch.
_EDGE = 0.02
# A path turns this share of its way before the surface it hits: where it has been, it is in no other surface.
_SHORT = 1e-3
# Cosine below which a point does not see along its surface.
_GRAZING = 1e-3
_NAMES = ("place", "normal", "node", "alone")


class Surroundings(Occluders, Protocol):
    """Occluders that also tell what a ray meets first."""

    def nearest(self, origins: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return face, distance and whether the front was hit; see `BruteForceOccluders.nearest`."""
        ...


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


def choose_sides(
    scene: Scene, patches: Patches, occluders: Surroundings, choice: str = "auto", *, seed: int = 0
) -> Scene:
    """Give sides to the faces marked AUTO.

    Parameters
    ----------
    scene : Scene
        Faces with other sides keep them.
    patches : Patches
        How the scene is meshed.
    occluders : Surroundings
        What blocks.
    choice : str
        "front", "back", or "auto": where light can reach.
    seed : int
        Start of the random numbers.

    Returns
    -------
    Scene
        Without AUTO.
    """
    if choice == "auto":
        return auto_sides(scene, patches, occluders, seed=seed)
    side = BACK if choice == "back" else FRONT
    return replace(scene, sides=np.where(scene.sides == AUTO, side, scene.sides))


def auto_sides(scene: Scene, patches: Patches, occluders: Surroundings, *, seed: int = 0) -> Scene:
    """Decide for the faces marked AUTO which sides light can reach.

    Parameters
    ----------
    scene : Scene
        Faces with other sides keep them.
    patches : Patches
        How the scene is meshed.
    occluders : Surroundings
        What blocks, for some 20 000 rays at most.
    seed : int
        Start of the random numbers.

    Returns
    -------
    Scene
        Without AUTO. Every island of faces is FRONT, BACK or BOTH; those that no light reaches are FRONT. A warning
        for each object tells how many of its islands are BACK.
    """
    undecided = scene.sides == AUTO
    if not undecided.any():
        return scene
    part = islands(scene)
    group = part if np.max(part) < MOST_ISLANDS else scene.face_object
    rng = np.random.default_rng(seed)
    found = _Search(scene, patches, group, occluders, rng).sides()[group]
    sides = np.where(undecided, found, scene.sides)
    return replace(scene, sides=sides, warnings=scene.warnings + _flipped(scene, part, undecided & (sides == BACK)))


def island_counts(scene: Scene) -> dict[str, int]:
    """Return how many islands of faces there are, and how many are lit on front, back and both sides.

    Parameters
    ----------
    scene : Scene
        An island whose faces differ counts as both; one of which nothing is decided counts as front.

    Returns
    -------
    dict
        Keys "front", "back" and "both".
    """
    part = islands(scene)
    lit = np.zeros((2, int(np.max(part, initial=-1)) + 1), dtype=np.bool_)
    lit[0, part[scene.sides != BACK]] = True
    lit[1, part[(scene.sides == BACK) | (scene.sides == BOTH)]] = True
    front, back = lit
    return {
        "front": int(np.count_nonzero(front & ~back)),
        "back": int(np.count_nonzero(back & ~front)),
        "both": int(np.count_nonzero(front & back)),
    }


def _flipped(scene: Scene, part: IntArray, back: BoolArray) -> tuple[str, ...]:
    """Return a line for each object with islands that are lit from behind only."""
    _, first = np.unique(part[back], return_index=True)
    objects, counts = np.unique(scene.face_object[back][first], return_counts=True)
    lines = []
    for index, count in zip(objects, counts, strict=True):
        what = "1 island is" if count == 1 else f"{count} islands are"
        lines.append(
            f"Object '{scene.object_names[index]}': {what} lit from the back; the colors show the light there "
            "(flip the normals, or choose Sides: Front)"
        )
    return tuple(lines)


class _Search:
    """The search for light on both sides of the islands of a scene.

    Parameters
    ----------
    scene : Scene
    patches : Patches
    group : ndarray of shape (f,)
        What is decided as one: the island of each face, or something coarser.
    occluders : Surroundings
    rng : numpy.random.Generator
    """

    def __init__(
        self, scene: Scene, patches: Patches, group: IntArray, occluders: Surroundings, rng: Generator
    ) -> None:
        self._scene, self._group, self._occluders, self._rng = scene, group, occluders, rng
        self._surface = _Surface(scene, patches, group, np.ones(len(patches.face), dtype=bool))
        self._lamps = _Surface(scene, patches, group, patches.emission.any(axis=1))

    def sides(self) -> NDArray[np.uint8]:
        """Return FRONT, BACK or BOTH for each group."""
        lit = self._lit()
        mine = 2 * np.unique(self._group[(self._scene.sides == AUTO) & self._scene.live])
        reached, alone = self._look(np.sort(np.concatenate([mine, mine + 1])), lit)
        # A front that is missed would be dark in the result: look once more where only the back has light.
        doubted = np.flatnonzero((reached | alone)[1::2] & ~(reached | alone)[::2]) * 2
        more_reached, more_alone = self._look(doubted, lit)
        front = (reached | alone | more_reached | more_alone)[::2]
        back = reached[1::2] | (alone[1::2] & ~front)
        return np.where(front & back, BOTH, np.where(back, BACK, FRONT)).astype(np.uint8)

    def _lit(self) -> list[_Points]:
        """Return points of emitters, and points that their light comes to."""
        nodes = np.unique(self._lamps.node)
        lamps = points = self._lamps.draw(nodes, max(1, PATHS // max(1, len(nodes))), self._rng)
        lit = [lamps]
        for _ in range(BOUNCES):
            points = self._bounced(points)
            lit.append(points)
        everything = _Points(*(np.concatenate([getattr(part, name) for part in lit]) for name in _NAMES))
        return [part for part in (lamps, everything) if len(part.node)]

    def _look(self, nodes: IntArray, lit: list[_Points]) -> tuple[BoolArray, BoolArray]:
        """Return which sides, of all, light comes to from elsewhere, and which from their own island alone."""
        reached = np.zeros(2 * int(np.max(self._group) + 1), dtype=np.bool_)
        alone = reached.copy()
        each = int(np.clip(LOOKS // max(1, len(nodes)), FEWEST, MOST))
        points = self._surface.draw(nodes, each, self._rng)
        for bounce in range(LOOK_BOUNCES):
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

    def _bounced(self, points: _Points) -> _Points:
        """Return where rays from points meet a side that may have light; the others are left out."""
        scene = self._scene
        # Lambert's cosine: a point on the unit sphere round the tip of the normal.
        z, turn = 2.0 * self._rng.random(len(points.node)) - 1.0, 2.0 * np.pi * self._rng.random(len(points.node))
        ring = np.sqrt(1.0 - z**2)
        way = points.normal + (1.0 - _GRAZING) * np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        face, distance, front = self._occluders.nearest(points.place, way)
        allowed = (scene.sides[face] == AUTO) | (scene.sides[face] & np.where(front, FRONT, BACK) > 0)
        hit = np.flatnonzero((face >= 0) & allowed)
        face, node = face[hit], points.node[hit]
        return _Points(
            points.place[hit] + ((1.0 - _SHORT) * distance[hit])[:, None] * way[hit],
            scene.face_normal[face] * np.where(front[hit], 1.0, -1.0)[:, None],
            node,
            points.alone[hit] & (self._group[face] == node // 2),
        )


class _Surface:
    """Sides of patches that may have light, to draw points from.

    Attributes
    ----------
    node : ndarray of shape (s,)
        Of each side, as in `_Points`; sorted.
    """

    def __init__(self, scene: Scene, patches: Patches, group: IntArray, chosen: BoolArray) -> None:
        sure = np.flatnonzero(chosen)
        undecided = sure[scene.sides[patches.face[sure]] == AUTO]
        patch = np.concatenate([sure, undecided])
        turned = np.repeat([1, -1], [len(sure), len(undecided)])
        node = 2 * group[patches.face[patch]] + (turned * patches.side[patch] < 0)
        order = np.argsort(node, kind="stable")
        patch, self.node = patch[order], node[order]
        self._corners = patches.corners[patch]
        self._normal = patches.normal[patch] * turned[order, None]
        self._below = np.append(0.0, np.cumsum(patches.area[patch]))

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
        place = np.where(triangle, a + u * (b - a) + v * (c - a), quad)
        return _Points(place, self._normal[slot], np.repeat(nodes, each), np.ones(len(slot), dtype=bool))
