# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sides of the surfaces have light, for the faces whose sides a scene leaves open.

Surfaces in Blender reflect and emit on both sides, but most of them are lit on one side only, and a second side costs
as much as the first. So every island of faces has the side, or the sides, that light can reach; faces that are turned
against their neighbours have theirs the other way round.

A colour attribute has one value for a corner. A surface that is lit on both sides shows its front there: what Cycles
bakes, and what viewers show that leave out backs.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, IntArray
from ..meshing import Patches
from ..places import places
from ..scene import AUTO, BACK, BOTH, FRONT, Scene
from ..visibility import Surroundings
from .islands import islands
from .light_search import LightSearch
from .lit_sides import lit_sides
from .orientation import Orientation, orientation

# More islands than this are taken together, object by object.
MOST_ISLANDS = 500
# ... and then open islands are looked at one by one if they are no more than so many; so many times as many points look
# a second time from sides that seem to be dark where the others have light.
_MOST_PARTS, _AGAIN = 4000, 4
# A side whose every point has a surface this close before it, as a share of the island's size, shines into a gap: of
# its light at most some four times that share gets out.
_GAP = 0.004


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
        for each object tells how many of its islands are BACK, and how many faces are turned against their neighbours.
    """
    undecided = scene.sides == AUTO
    if not undecided.any():
        return scene
    part, rng = islands(scene), np.random.default_rng(seed)
    shape = orientation(scene)
    group, single = part, np.zeros(0, dtype=np.int64)
    if np.max(part) >= MOST_ISLANDS:
        group, single = scene.face_object, np.unique(part[undecided & scene.live & ~shape.sealed])
    if len(single) > _MOST_PARTS:
        # Where loose faces meet, they are turned alike, for want of a look at each.
        shape, single = orientation(scene, places(scene.vertices)[scene.corner_vertex]), single[:0]
    found = lit_sides(scene, patches, group, shape, occluders, rng)[group]
    if len(single):
        found = _of_parts(scene, patches, found, part, 2 * single, shape, occluders, rng)
    # The front of what is turned is where the others have their back.
    own = np.where(shape.turned & (found != BOTH), FRONT + BACK - found, found)
    # Light on one side is on the other, too, and the front shows.
    own = np.where(scene.transmittance.any(axis=1), BOTH, own)
    sides = np.where(undecided, own, scene.sides)
    alike = undecided & ~np.isin(group, group[shape.turned])
    sides = _without_gaps(scene, sides, alike, group, patches, occluders)
    behind = undecided & (sides == BACK) & ~shape.turned
    lines = _flipped(scene, part, behind) + _turned(scene, undecided & shape.turned)
    return replace(scene, sides=sides, warnings=scene.warnings + lines)


def _of_parts(
    scene: Scene,
    patches: Patches,
    found: NDArray[np.uint8],
    part: IntArray,
    nodes: IntArray,
    shape: Orientation,
    occluders: Surroundings,
    rng: np.random.Generator,
) -> NDArray[np.uint8]:
    """Return the sides of faces with some islands, whose fronts are given, looked at one by one.

    An object of loose faces that are turned anyhow, as a level of a game, is lit inside only: on the fronts of some of
    its faces and on the backs of others, which would show the dark.
    """
    search = LightSearch(scene, patches, part, shape, occluders, rng)
    lit = search.paths()
    reached, alone = search.look(np.sort(np.concatenate([nodes, nodes + 1])), lit)
    bright = reached | alone
    # A side that is missed would be dark in the result: look once more.
    front, back = bright[nodes], bright[nodes + 1]
    doubted = np.sort(np.concatenate([nodes[back & ~front], nodes[front & ~back] + 1]))
    for more in search.look(doubted, lit, _AGAIN):
        bright |= more
    front, back = bright[::2][part], bright[1::2][part]
    looked = np.isin(part, nodes // 2)
    found = np.where(looked & back & ~front, BACK, found)
    return np.where(looked & front & ~back & (found == BACK), FRONT, found).astype(np.uint8)


def _without_gaps(
    scene: Scene,
    sides: NDArray[np.uint8],
    undecided: BoolArray,
    group: IntArray,
    patches: Patches,
    occluders: Surroundings,
) -> NDArray[np.uint8]:
    """Return the sides without those of emitters that lie close to another surface, as a lamp on a ceiling does."""
    sides = sides.copy()
    both = undecided & (sides == BOTH) & scene.emission.any(axis=1)
    for island in np.unique(group[both]):
        members = group == island
        own = np.flatnonzero(members[patches.face])
        size = np.sqrt(patches.area[own].sum())
        normal = scene.face_normal[patches.face[own]]
        for side, way in ((BACK, -normal), (FRONT, normal)):
            _, distance, _ = occluders.nearest(patches.centre[own], way)
            if np.max(distance, initial=0.0) < _GAP * size and (sides[members] != side).all():
                sides[members] &= ~np.uint8(side)
    return sides


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


def _turned(scene: Scene, turned: BoolArray) -> tuple[str, ...]:
    """Return a line for each object with faces that are turned against their neighbours."""
    counts = np.bincount(scene.face_object[turned], minlength=len(scene.object_names))
    lines = []
    for index in np.flatnonzero(counts):
        what = "1 face is" if counts[index] == 1 else f"{counts[index]} faces are"
        lines.append(
            f"Object '{scene.object_names[index]}': {what} turned against the neighbors; each shows the light of "
            "its own lit side (recalculate the normals)"
        )
    return tuple(lines)
