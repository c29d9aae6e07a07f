# SPDX-License-Identifier: GPL-3.0-or-later
"""The rays that look for light: paths from what shines, and points on islands of faces that look for those."""

from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..lighting.lamps import SkyLamp, scene_reach
from ..meshing import Patches
from ..scene import AUTO, BACK, FRONT, Scene
from ..visibility import Surroundings, sky_occluders
from .enclosures import Enclosure, enclosure, keeps_dark
from .orientation import Orientation
from .side_points import PatchSides, SidePoints, joined
from .walls import are_walls, flattest_share

# Paths from light, and how often they are followed from surface to surface.
PATHS = 512
BOUNCES = 5
# Points on islands that look for light, and how often they look farther; the least and the most on one side.
LOOKS = 1024
LOOK_BOUNCES = 3
FEWEST, MOST = 4, 48
# Share of the rays from within a body with slits that meet it, at least, among the few that are cast first, and then,
# for fewer and fewer bodies, with the rays that tell it. What has more of its area than so in one direction may be a
# room, whose inside matters.
SHUT_FEW, SHUT, FLOOR = 0.9, ((256, 0.96), (4096, 0.99)), 0.1
# What is closer behind a group, as a share of its size, is no room.
SLAB = 0.05
# Lit points among which the one that faces a point best is asked for.
_CANDIDATES = 48
# A path turns this share of its way before the surface it hits: where it has been, it is in no other surface.
_SHORT = 1e-3
# Share of the paths that come to a translucent surface and go on behind it.
_THROUGH = 0.5
# Cosine below which a point does not see along its surface.
_GRAZING = 1e-3


@dataclass(frozen=True, eq=False)
class Caught:
    """What rays from sides meet.

    Attributes
    ----------
    node : ndarray of shape (r,)
        The side that each comes from.
    group : ndarray of shape (r,)
        The group that it meets; -1 for none.
    sides : int
        How many sides there are.
    """

    node: IntArray
    group: IntArray
    sides: int

    def share(self, chosen: BoolArray) -> FloatArray:
        """Return which share of each side's rays meets one of the chosen groups, shape (s,)."""
        return self._share((self.group >= 0) & chosen[self.group])

    def at_home(self, owner: IntArray) -> FloatArray:
        """Return which share of each side's rays meets its own object, shape (s,), by the object of each group."""
        return self._share((self.group >= 0) & (owner[self.group] == owner[self.node // 2]))

    def _share(self, met: BoolArray) -> FloatArray:
        rays = np.maximum(np.bincount(self.node, minlength=self.sides), 1)
        return np.asarray(np.bincount(self.node, met, self.sides) / rays)


class LightSearch:
    """Rays by which light and the sides of islands find each other; takes the parameters of `lit_sides`."""

    def __init__(
        self,
        scene: Scene,
        patches: Patches,
        group: IntArray,
        shape: Orientation,
        occluders: Surroundings,
        rng: np.random.Generator,
    ) -> None:
        self._scene, self._group, self._shape, self._occluders, self._rng = scene, group, shape, occluders, rng
        self._sides = PatchSides(scene, patches, group, shape, np.ones(len(patches.face), dtype=bool))
        self._emitters = PatchSides(scene, patches, group, shape, patches.emission.any(axis=1))
        self._reach = scene_reach(scene)
        self._translucent = scene.transmittance.any(axis=1)
        nodes = np.unique(self._emitters.node)
        self._starts = self._emitters.draw(nodes, max(1, PATHS // max(1, len(nodes))), rng)

    def enclosure(self, shell: int) -> Enclosure | None:
        """Tell on which sides of a group light starts, if it is a closed shell."""
        return enclosure(self._scene, np.flatnonzero(self._group == shell), self._shape, self._starts.place)

    def paths(self) -> list[SidePoints]:
        """Return points that light starts from, and with them those that it comes to."""
        starts = [self._starts]
        if self._scene.lamps:
            nodes = np.unique(self._sides.node)
            points = self._sides.draw(nodes, max(1, 2 * PATHS // max(1, len(nodes))), self._rng)
            points = points[self._shone(points)]
            # No island shines alone where a lamp does.
            starts.append(SidePoints(points.place, points.normal, points.node, np.zeros(len(points.node), dtype=bool)))
        start = points = joined(starts)
        lit = [start]
        for _ in range(BOUNCES):
            points = self._bounced(points)
            lit.append(points)
        return [part for part in (start, joined(lit)) if len(part.node)]

    def look(self, nodes: IntArray, lit: list[SidePoints], times: int = 1) -> tuple[BoolArray, BoolArray]:
        """Return which sides, of all, light comes to from elsewhere, and which from their own island alone."""
        reached = np.zeros(2 * int(np.max(self._group) + 1), dtype=np.bool_)
        alone = reached.copy()
        points = self._sides.draw(nodes, self._each(nodes, times), self._rng)
        for bounce in range(LOOK_BOUNCES):
            reached[points.node[self._shone(points)]] = True
            for source in lit:
                which, seen = self._connected(points, source)
                node = points.node[which]
                at_home = source.node[seen] // 2 == node // 2
                own = points.alone[which] & source.alone[seen] & at_home
                reached[node[~own]] = True
                # What lights other islands counts, though it may hardly ever meet them: a dome round a house.
                reached[source.node[seen[~at_home]]] = True
                alone[node[own]] = True
            points = points[~reached[points.node]]
            if bounce < LOOK_BOUNCES - 1:
                points = self._bounced(points)
        return reached, alone

    def dark_hollows(self, caught: Caught) -> BoolArray:
        """Return which sides, of all, see hardly anything but their own rounded object, in which no light starts.

        So are the insides of a head with slits round its eyes, whichever way its faces are turned.
        """
        scene, owner = self._scene, np.zeros(caught.sides // 2, dtype=np.int64)
        owner[self._group] = scene.face_object
        within = caught.at_home(owner) >= SHUT_FEW
        for index in np.unique(owner[np.flatnonzero(within) // 2]):
            faces = np.flatnonzero(scene.face_object == index)
            if flattest_share(scene, faces) > FLOOR or not keeps_dark(scene, faces, self._shape, self._starts.place):
                within[(owner == index).repeat(2)] = False
        for rays, least in SHUT:
            within &= self.caught(np.flatnonzero(within), rays).at_home(owner) >= least
        # A shell has two sides: what sees itself from both is a heap of leaves.
        within &= ~within.reshape(-1, 2).all(axis=1).repeat(2)
        return within

    def rooms(self, groups: BoolArray) -> BoolArray:
        """Return which of some groups may be rooms, or walls of one: flat and wide, or with light that starts inside.

        What has no light of its own is a cup, a hat or a part of a head where it is rounded, and a sign or a slab where
        there is but a gap behind it: their outside matters.
        """
        found = np.zeros_like(groups)
        for index in np.flatnonzero(groups):
            faces = np.flatnonzero(self._group == index)
            wide = are_walls(self._scene, faces) and self._depth(int(index)) > SLAB
            found[index] = wide or not keeps_dark(self._scene, faces, self._shape, self._starts.place)
        return found

    def _depth(self, group: int) -> float:
        """Return how far it is from backs to what is behind them, mostly, over the size of their group."""
        points = self._sides.draw(np.array([2 * group + 1]), MOST, self._rng)
        distance = self._occluders.nearest(points.place, points.normal)[1]
        return float(np.median(distance) / np.sqrt(self._scene.face_area[self._group == group].sum()))

    def caught(self, nodes: IntArray, each: int = 0) -> Caught:
        """Send rays from sides, so many from each or as many as are due, and tell what they meet."""
        points = self._sides.draw(nodes, each or self._each(nodes), self._rng)
        face = self._met(points)[1]
        return Caught(points.node, np.where(face >= 0, self._group[face], -1), 2 * int(np.max(self._group) + 1))

    def _each(self, nodes: IntArray, times: int = 1) -> int:
        """Return how many points each side gets."""
        return int(np.clip(times * LOOKS // max(1, len(nodes)), FEWEST, times * MOST))

    def _shone(self, points: SidePoints) -> BoolArray:
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

    def _connected(self, points: SidePoints, source: SidePoints) -> tuple[IntArray, IntArray]:
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

    def _met(self, points: SidePoints) -> tuple[FloatArray, IntArray, FloatArray, BoolArray]:
        """Return a direction from each point, the face that it meets or -1, how far away, and whether at its front."""
        # Lambert's cosine: a point on the unit sphere round the tip of the normal.
        z, turn = 2.0 * self._rng.random(len(points.node)) - 1.0, 2.0 * np.pi * self._rng.random(len(points.node))
        ring = np.sqrt(1.0 - z**2)
        way = points.normal + (1.0 - _GRAZING) * np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        return way, *self._occluders.nearest(points.place, way)

    def _bounced(self, points: SidePoints) -> SidePoints:
        """Return where rays from points meet a side that may have light; the others are left out."""
        scene = self._scene
        way, face, distance, front = self._met(points)
        allowed = (scene.sides[face] == AUTO) | (scene.sides[face] & np.where(front, FRONT, BACK) > 0)
        hit = np.flatnonzero((face >= 0) & allowed)
        face, node = face[hit], points.node[hit]
        # Half of what meets a translucent face goes on behind it.
        through = self._translucent[face]
        through[through] = self._rng.random(int(through.sum())) < _THROUGH
        far = np.where(through, 1.0 + _SHORT, 1.0 - _SHORT)
        return SidePoints(
            points.place[hit] + (far * distance[hit])[:, None] * way[hit],
            scene.face_normal[face] * np.where(front[hit] ^ through, 1.0, -1.0)[:, None],
            node,
            points.alone[hit] & (self._group[face] == node // 2),
        )
