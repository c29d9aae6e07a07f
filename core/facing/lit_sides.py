# SPDX-License-Identifier: GPL-3.0-or-later
"""Where light can reach, by a few thousand rays.

Paths from the emitters, and from where lamps and the sky shine, leave points that light comes to. Then points on both
sides of every island of faces look for one of those, or for a lamp: at once, or after some bounces of their own. That
is bidirectional path tracing (Lafortune, Willems 1993; Veach, Guibas 1995), asked only whether, not how much.

What is wanted is the geometry of the light, so every surface passes light on, whatever its reflectance. Two kinds of
lit sides do not count when the other side has light as well: a back that shines only on its own island, like the inside
of a bulb, and a side that sees nothing but the sky: a back always, a front where the back is the inside of a room.
Neither does the inside of a closed island in which no light starts, nor its outside where all light starts in it, nor
the inside of an object with mere slits.

"Front" and "back" are those of most faces of an island: what is turned against its neighbours has its own the other
way round.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, IntArray
from ..meshing import Patches
from ..scene import AUTO, BACK, BOTH, FRONT, Scene
from ..visibility import Surroundings
from .light_search import Caught, LightSearch
from .orientation import Orientation

# Times as many points look a second time from fronts, where only the back has light so far.
_AGAIN = 4
# Shares of the rays from the inside of a room that are caught, and that its walls catch, at least.
_CAUGHT, _CAUGHT_BY_WALLS = 0.7, 0.3


def lit_sides(
    scene: Scene,
    patches: Patches,
    group: IntArray,
    shape: Orientation,
    occluders: Surroundings,
    rng: np.random.Generator,
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
    search = LightSearch(scene, patches, group, shape, occluders, rng)
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
    caught = search.caught(np.sort(np.concatenate([torn, torn + 1])))
    sees = caught.share(np.ones(len(front), dtype=np.bool_))
    # What gets through the slits of a shell that is nearly closed is not worth a side, even if its normals look there.
    dark = front & back & search.dark_hollows(caught).reshape(-1, 2).T & (sees.reshape(-1, 2)[:, ::-1].T > 0)
    front, back = front & ~dark[0], back & ~dark[1]
    back &= ~(front & (sees[1::2] == 0))
    hull = search.rooms(front & back & (sees[::2] == 0) & (sees[1::2] > _CAUGHT))
    front &= ~_hulls(hull, caught)
    return np.where(front & back, BOTH, np.where(back, BACK, FRONT)).astype(np.uint8)


def _hulls(hull: BoolArray, caught: Caught) -> BoolArray:
    """Return which of some groups are the walls of rooms: behind them are others, or more of their own.

    A room may be one island, or a sheet for each wall. A table in the sun is none, though the ground lies behind it:
    the ground has no room behind itself.
    """
    while True:
        walls = hull & (caught.share(hull)[1::2] > _CAUGHT_BY_WALLS)
        if (walls == hull).all():
            return walls
        hull = walls
