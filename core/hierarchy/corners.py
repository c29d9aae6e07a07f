# SPDX-License-Identifier: GPL-3.0-or-later
"""The final gather: irradiance at the corners of the mesh itself, so that shadows stay sharp and no blocks show."""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..meshing import Patches
from ..progress import Progress
from ..scene import BOTH, Scene
from ..shading import shown_face_normals, shown_normals, smooth_groups
from ..visibility import Occluders
from .bends import find_bends
from .elements import Elements
from .exposed import Shown
from .filter import ROUNDS, mesh_edges, smoothed
from .first_look import typical_irradiance
from .glances import COVERED, STAGE, Corners, Glance, glances
from .meetings import at_edges, exchange, find_meetings
from .probes import points_among_dark
from .quality import Quality
from .receivers import SPARSE_SIZE, DirectLight
from .scenery import relit
from .sights import NOTHING, beside
from .slopes import find_slopes
from .solve import Lit
from .sparse_glances import from_sky, sparse_glances
from .straddling import past_walls, with_light_outside
from .tree import Float, Int

__all__ = ["COVERED", "Corners", "corner_receivers", "final_gather"]

# How far a corner's receiver moves into its faces, as a share of the way to their middle: off the edge, where the faces
# next door would be seen edge on.
_INSET = 0.02
# Receivers are raised above their own faces by so many times what it takes, reckoned with at least this cosine between
# the normals.
_CLEAR, _SLANTING = 1.05, 0.2
# Where it is dark, errors count as many times more, at most.
_MOST_NEED = 6.0
# Receivers with less than this share of the light round them may be inside of something.
_DIM = 0.5
# Weight of hidden elements beside that of exposed ones.
_LAST_RESORT = 1e-9
# So many times as many corners as may look all look: with those that look for themselves samples were hardly fewer.
_HARDLY_MORE = 1.5
# Rounds of the filter where most corners only learn what arrives at others, and for the sky: few rays tell each of it.
_MANY_ROUNDS = 10
_SKY_SAME = 0.12  # see `smoothed`: one ray more or less of a far window is as much


def corner_receivers(scene: Scene, exposed: Float | None = None) -> Corners:
    """Return one receiver for each vertex and smooth group of a scene.

    Parameters
    ----------
    scene : Scene
    exposed : ndarray of shape (c,), optional
        Share that shows of what is at each of its corners: receivers move there. Everything when not given.

    Returns
    -------
    Corners
    """
    face = scene.corner_face
    group = smooth_groups(scene)
    position = scene.vertices[scene.corner_vertex]
    inwards = _middles(scene)[face] - position
    weight = np.ones(len(group)) if exposed is None else exposed + _LAST_RESORT
    total = np.bincount(group, weight)
    into = np.stack([np.bincount(group, weight * axis) for axis in inwards.T], axis=1) / total[:, None]
    leader = np.full(len(total), -1)
    leader[group[::-1]] = np.arange(len(group))[::-1]
    normal = shown_normals(scene)[leader]
    # Faces without area have no normal of their own; whatever light is there will do.
    normal[~normal.any(axis=1)] = (0, 0, 1)
    # Along the surface, not below it: the middles of the faces round a convex corner lie inside.
    into -= (into * normal).sum(axis=1, keepdims=True) * normal
    point = position[leader] + _INSET * into
    return Corners(point + _lift(scene, point, normal, group)[:, None] * normal, normal, group)


def _middles(scene: Scene) -> Float:
    """Return the mean of each face's corners, shape (f, 3) [m]."""
    if not len(scene.face_normal):
        return np.zeros((0, 3))
    position = scene.vertices[scene.corner_vertex]
    sums: Float = np.add.reduceat(position, scene.face_start[:-1], axis=0)
    return sums / np.maximum(np.diff(scene.face_start), 1)[:, None]


def _lift(scene: Scene, point: Float, normal: Float, group: Int) -> Float:
    """Return how far to raise receivers along their normals to stand above all of their own faces, shape (q,) [m].

    Where a smooth surface is hollow and its faces differ in size, the plane across the normal runs behind some of them.
    Some corners of a bent face are behind it: where its back has light, too, they would look at that from inside.
    """
    face = scene.corner_face
    own = shown_face_normals(scene)[face]
    behind = -((point[group] - scene.vertices[scene.corner_vertex]) * own).sum(axis=1)
    inside = -((point[group] - _middles(scene)[face]) * own).sum(axis=1)
    behind = np.where(scene.sides[face] == BOTH, np.maximum(behind, inside), behind)
    needed = behind / np.maximum((normal[group] * own).sum(axis=1), _SLANTING)
    order = np.argsort(group, kind="stable")
    begin = np.searchsorted(group[order], np.arange(len(point)))
    return np.asarray(_CLEAR * np.maximum(np.maximum.reduceat(needed[order], begin), 0))


def final_gather(
    scene: Scene,
    corners: Corners,
    lit: Lit,
    shown: Shown,
    patches: Patches,
    quality: Quality,
    workers: Executor,
    *,
    direct: DirectLight | None = None,
    sky: DirectLight | None = None,
) -> Generator[Progress, None, tuple[Float, Float, int, int]]:
    """Gather the light of a solution at the corners.

    Parameters
    ----------
    scene : Scene
        All faces, or some of them.
    corners : Corners
        Its corners.
    lit : Lit
        What was solved.
    shown : Shown
        What the elements show of that.
    patches : Patches
    quality : Quality
    workers : concurrent.futures.Executor
    direct, sky : callable, optional
        Light of lamps that are no elements, and of the sky.

    Yields
    ------
    Progress

    Returns
    -------
    irradiance, first : ndarray of shape (q, 3)
        At the receivers of `corners`: all of it, and that part [W/m^2].
    links, rays : int
    """
    elements, radiosity, irradiance = lit.elements, shown.radiosity, shown.irradiance
    # What shows of elements that something stands on is as bright as what is around them.
    typical = typical_irradiance(elements, irradiance, lit.transport.row_sums())
    if typical > 0:
        lit = replace(lit, scenery=relit(lit.scenery, elements, radiosity, typical))
    # Beside the radiosity what is emitted.
    sent = np.column_stack((radiosity, elements.emission))
    need = _need(corners, patches, elements, irradiance, typical)
    few = len(corners.point) <= _HARDLY_MORE * quality.corners
    edges = mesh_edges(scene, corners.group)
    if few:
        bends = find_bends(scene, corners.normal, corners.group)
        glance = yield from glances(corners, lit, sent, need, quality, workers, bends=bends)
    else:
        rim = at_edges(scene, corners)
        glance = yield from sparse_glances(corners, lit, sent, need, quality, workers, rim, edges, sky)
    above = from_sky(corners, np.arange(len(corners.point)), sky if few else None)
    covered = glance.covered | _cut_off(scene, corners, glance.alone & ~glance.covered, lit.scenery.occluders)
    yield Progress(STAGE, 1.0)
    lamps = _straight(glance, corners, direct)
    yield Progress(STAGE, 1.0)
    arriving = (lamps + glance.others + above)[:, :3]
    around, known = _around(corners, elements, np.column_stack((irradiance, shown.first)), shown.exposed, patches)
    dim = known & ~covered & (arriving.sum(axis=1) < _DIM * around[:, :3].sum(axis=1))
    covered[dim] = points_among_dark(corners.point[dim], corners.normal[dim], lit.sides, lit.scenery.occluders)
    outside = past_walls(corners, edges, arriving, lit.sides, lit.scenery.occluders)
    covered[outside[0]] = True
    blended = partial(smoothed, light=arriving, edges=edges, covered=covered, typical=typical)
    light = lamps + blended(glance.others, rounds=ROUNDS if few else _MANY_ROUNDS)
    if above.any():
        light += blended(above, rounds=_MANY_ROUNDS, same=_SKY_SAME)
    light = with_light_outside(np.where((covered & known)[:, None], around, light), outside)
    close = beside(glance.sights, corners.point, elements)
    # Most corners of a fine mesh have their neighbours' light: what is beside a few of them does not show.
    most = len(corners.point) if few else quality.corners // 4
    meetings = find_meetings(glance.sights.pick(close), scene, corners, elements, patches, most)
    links, rays, seen, aside = glance.links, glance.rays, NOTHING, np.zeros((0, 3))
    if len(meetings.owner):
        even = np.ones(len(meetings.owner))
        more = yield from glances(meetings.aside, lit, sent, even, quality, workers, SPARSE_SIZE)
        aside = (_straight(more, meetings.aside, direct, sky) + more.others)[:, :3]
        links, rays, seen = links + more.links, rays + more.rays, more.sights
    slopes = find_slopes(glance.sights.pick(~close), scene, corners, elements, patches)
    # What comes through from the other side is there whatever else shines at a place.
    glowing = elements
    if lit.through is not None:
        glowing = replace(elements, emission=elements.emission + lit.through.leaving(irradiance))
    light[:, :3] = exchange(light[:, :3], meetings, slopes, aside, seen, glowing, radiosity)
    return light[:, :3], light[:, 3:], links, rays


def _cut_off(scene: Scene, corners: Corners, alone: NDArray[np.bool_], occluders: Occluders) -> NDArray[np.bool_]:
    """Return which of some receivers other geometry parts from a face of theirs, shape (q,).

    A corner that reaches out of a room through its floor sees nothing out there; what shows of its face is inside.
    """
    cut = np.zeros(len(alone), dtype=np.bool_)
    corner = np.flatnonzero(alone[corners.group])
    face, group = scene.corner_face[corner], corners.group[corner]
    # As high over the face there as the receiver is.
    shown, end = shown_face_normals(scene)[face], _middles(scene)[face]
    end = end + ((corners.point[group] - end) * shown).sum(axis=1)[:, None] * shown
    cut[group[occluders.blocked(corners.point[group], end)]] = True
    return cut


def _straight(glance: Glance, corners: Corners, *lamps: DirectLight | None) -> Float:
    """Return the light that comes from bright clusters and from lamps, shape (q, 6) [W/m^2]."""
    light = glance.bright
    for lamp in lamps:
        if lamp is not None:
            light = light + np.tile(lamp(corners.point, corners.normal), 2)
    return light


def _need(corners: Corners, patches: Patches, elements: Elements, irradiance: Float, typical: float) -> Float:
    """Return how many times as much an error counts at each corner as where light is typical: more where it is dark."""
    A, H = elements.area, irradiance.mean(axis=1)
    of_patch = np.bincount(elements.patch, A * H, len(patches.area)) / np.bincount(elements.patch, A, len(patches.area))
    at = corners.group[patches.touch_corner]
    count = np.bincount(at, minlength=len(corners.point))
    here = np.bincount(at, of_patch[patches.touch_patch], len(count)) / np.maximum(count, 1)
    # Never divided by so little that it overflows.
    return np.asarray(np.clip(typical / np.maximum(np.maximum(here, typical / _MOST_NEED), 1e-300), 1, _MOST_NEED))


def _around(
    corners: Corners, elements: Elements, irradiance: Float, exposed: NDArray[np.bool_], patches: Patches
) -> tuple[Float, NDArray[np.bool_]]:
    """Return what is exposed of the patches round each receiver receives, shape (q, 6), and where there are any."""
    # Where nothing of them is exposed, that of what is beside them, which hidden elements were given.
    weight = elements.area * np.where(exposed, 1.0, _LAST_RESORT)
    of_patch = [np.bincount(elements.patch, weight * part, len(patches.area)) for part in (1.0, *irradiance.T)]
    at, count = corners.group[patches.touch_corner], len(corners.point)
    total, *sums = (np.bincount(at, part[patches.touch_patch], count) for part in of_patch)
    return np.stack(sums, axis=1) / np.maximum(total, 1e-300)[:, None], total > 0
