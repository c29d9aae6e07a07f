# SPDX-License-Identifier: GPL-3.0-or-later
"""The final gather: irradiance at the corners of the mesh itself, so that shadows stay sharp and no blocks show."""

from collections.abc import Callable, Generator
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..meshing import Patches
from ..progress import Progress, scaled
from ..scene import Scene
from .bends import find_bends
from .elements import Elements
from .exposed import Shown
from .filter import ROUNDS, mesh_edges, smoothed
from .first_look import typical_irradiance
from .glances import COVERED, STAGE, Corners, glances
from .meetings import exchange, find_meetings
from .outlook import find_outlook
from .probes import points_among_dark
from .quality import Quality
from .receivers import SPARSE_SIZE, DirectLight
from .rows import BRIGHT
from .same_places import at_edges
from .scenery import relit
from .sights import GAP, NOTHING, beside, light_from
from .slopes import find_slopes
from .solve import Lit
from .sparse_glances import from_sky, sparse_glances
from .straddling import past_walls, with_light_outside
from .tree import Float
from .vantages import LAST_RESORT, cut_off

__all__ = ["COVERED", "Corners", "final_gather"]

# Where it is dark, errors count as many times more, at most.
_MOST_NEED = 6.0
# Receivers with less than this share of the light round them may be inside of something.
_DIM = 0.5
# So many times as many corners as may look all look: with those that look for themselves samples were hardly fewer.
_HARDLY_MORE = 1.5
# Share of the final gather that is done after the glances, and after the lamps.
_GLANCES, _LAMPS = 0.6, 0.9
# Corners that lamps are asked for at a time.
_BLOCK = 1 << 16
# Rounds of the filter where most corners only learn what arrives at others, and for the sky: few rays tell each of it.
_MANY_ROUNDS = 10
_SKY_SAME = 0.12  # see `smoothed`: one ray more or less of a far window is as much


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
    bends = find_bends(scene, corners.normal, corners.group) if few else None
    if few:
        steps = glances(corners, lit, sent, need, quality, workers, bends=bends)
    else:
        rim = at_edges(scene, corners)
        steps = sparse_glances(
            corners, lit, sent, need, quality, workers, rim, edges, typical, sky, find_outlook(scene, lit, sent)
        )
    glance = yield from scaled(steps, 0, _GLANCES)
    above = from_sky(corners, np.arange(len(corners.point)), sky if few else None, bends)
    covered = glance.covered | cut_off(scene, corners, glance.alone & ~glance.covered, lit.scenery.occluders)
    lamps = glance.bright + (yield from scaled(_from_lamps(corners, direct, dense=not few), _GLANCES, _LAMPS))
    arriving = (lamps + glance.others + above)[:, :3]
    around, known = _around(corners, elements, np.column_stack((irradiance, shown.first)), shown.exposed, patches)
    dim = known & ~covered & (arriving.sum(axis=1) < _DIM * around[:, :3].sum(axis=1))
    covered[dim] = points_among_dark(corners.point[dim], corners.normal[dim], lit.sides, lit.scenery.occluders)
    outside = past_walls(corners, edges, arriving, lit.sides, lit.scenery.occluders)
    covered[outside[0]] = True
    edge = beside(glance.sights, corners.point, elements)
    lamp = lit.scenery.sources.tree.at_elements(lit.scenery.brightness > BRIGHT)
    near = light_from(glance.sights.pick(edge & few & ~lamp[glance.sights.element]), radiosity, len(arriving))
    blended = partial(smoothed, light=arriving, edges=edges, covered=covered, typical=typical)
    light = lamps + blended(glance.others, rounds=ROUNDS if few else _MANY_ROUNDS, near=near.mean(axis=1))
    if sky and above.any():
        light += _smoothed_sky(above, sky(corners.point, corners.normal, shadowed=False), blended)
    light = with_light_outside(np.where((covered & known)[:, None], around, light), outside)
    close = beside(glance.sights, corners.point, elements, GAP)
    # Most corners of a fine mesh have their neighbours' light: what is beside a few of them does not show.
    most = len(corners.point) if few else quality.corners // 4
    meetings = find_meetings(glance.sights.pick(close), scene, corners, elements, patches, most)
    links, rays, seen, aside = glance.links, glance.rays, NOTHING, np.zeros((0, 3))
    if len(meetings.owner):
        even = np.ones(len(meetings.owner))
        more = yield from scaled(glances(meetings.aside, lit, sent, even, quality, workers, SPARSE_SIZE), _LAMPS, 1)
        aside = more.bright + more.others + (yield from scaled(_from_lamps(meetings.aside, direct, sky), 1, 1))
        aside = aside[:, :3]
        links, rays, seen = links + more.links, rays + more.rays, more.sights
    slopes = find_slopes(glance.sights.pick(~close), scene, corners, elements, patches)
    # What comes through from the other side is there whatever else shines at a place.
    glowing = elements
    if lit.through is not None:
        glowing = replace(elements, emission=elements.emission + lit.through.leaving(irradiance))
    light[:, :3] = exchange(light[:, :3], meetings, slopes, aside, seen, glowing, radiosity)
    return light[:, :3], light[:, 3:], links, rays


def _from_lamps(corners: Corners, *lamps: DirectLight | None, dense: bool = False) -> Generator[Progress, None, Float]:
    """Ask for the light of lamps at all corners, shape (q, 6): twice, as all light and as what is emitted [W/m^2]."""
    light = np.zeros((len(corners.point), 3))
    for first in range(0, len(light), _BLOCK):
        yield Progress(STAGE, first / len(light))
        part = slice(first, first + _BLOCK)
        for lamp in lamps:
            if lamp is not None:
                light[part] += lamp(corners.point[part], corners.normal[part], dense=dense)
    return np.tile(light, 2)


def _smoothed_sky(above: Float, bare: Float, blended: Callable[..., Float]) -> Float:
    """Blend the light of the sky, shape (q, 6): neighbours see about the same share of it, whichever way they look.

    Where nothing is in the way, `bare` arrives [W/m^2].
    """
    share = np.divide(above[:, :3], bare, out=np.zeros_like(bare), where=bare > 0)
    scale = bare.mean(axis=0)
    part = blended(share * scale, rounds=_MANY_ROUNDS, same=_SKY_SAME)
    return np.tile(np.divide(part, scale, out=part, where=scale > 0) * bare, 2)


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
    weight = elements.area * np.where(exposed, 1.0, LAST_RESORT)
    of_patch = [np.bincount(elements.patch, weight * part, len(patches.area)) for part in (1.0, *irradiance.T)]
    at, count = corners.group[patches.touch_corner], len(corners.point)
    total, *sums = (np.bincount(at, part[patches.touch_patch], count) for part in of_patch)
    return np.stack(sums, axis=1) / np.maximum(total, 1e-300)[:, None], total > 0
