# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchical method from patches to light: elements, light straight from emitters, links, and bounces.

Light that comes straight from lamps (elements that shine much brighter than what they light) is looked for at every
element, or where they are very many at several times as many samples as all other light, which changes less from place
to place.
"""

from collections.abc import Generator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lighting.kinds import Lamp
from ..meshing import Patches
from ..occlusion.blender_tree import in_blender
from ..occlusion.shared_out import SharedOut
from ..progress import Progress, renamed
from ..solution import Solution
from ..translucence import Translucence, piece_translucence
from ..visibility import Surroundings
from .bounces import bounces
from .clustering import choose_samples
from .element_hits import ElementHits
from .elements import Elements, split_patches
from .first_look import STAGE as FIRST_LOOK
from .first_look import Look, ambient_guess, first_look, typical_irradiance
from .linking import STAGE as LINKS
from .neighbourhoods import find_neighbourhoods
from .quality import Detail, Quality
from .receivers import DirectLight
from .samples import Samples
from .scenery import Scenery, build_scenery, relit
from .transport import HierarchicalTransport
from .tree import Float

# How few samples tell roughly where the light is, how finely they are linked, and solved for.
_FEW, _COARSELY = 500, 1e-3
_COARSE = Detail(1.5, 0.2, 0.2, 1)
# Elements that look for lamps, at most, as a multiple of those that receive indirect light.
_STRAIGHT = 8
# ... and that look at the sky.
_UP = 2


@dataclass(frozen=True, eq=False)
class Lit:
    """Light on all elements, and what it travelled through.

    Attributes
    ----------
    elements : Elements
    transport : HierarchicalTransport
    solution : Solution
        On the elements.
    direct : ndarray of shape (n, 3)
        The part of their irradiance that comes from no element [W/m^2].
    lamp : ndarray of shape (n, 3)
        What elements that are lamps emit [W/m^2].
    straight : ndarray of shape (n, 3)
        The irradiance that comes straight from those [W/m^2].
    scenery : Scenery
        Lit by the solution, for a final gather.
    lamps : Scenery or None
        The lamps alone.
    through : Translucence or None
        Which elements have light from their other side.
    sides : ndarray of shape (f,) or None
        Which sides of all faces that block have light; the fronts when None.
    rays : int
        Cast up to here.
    """

    elements: Elements
    transport: HierarchicalTransport
    solution: Solution
    direct: Float
    lamp: Float
    straight: Float
    scenery: Scenery
    lamps: Scenery | None
    through: Translucence | None
    sides: NDArray[np.uint8] | None
    rays: int


def solve(
    patches: Patches,
    occluders: Surroundings,
    quality: Quality,
    workers: Executor,
    *,
    sides: NDArray[np.uint8] | None = None,
    occludes: NDArray[np.bool_] | None = None,
    direct: DirectLight | None = None,
    sky: DirectLight | None = None,
    lamps: Sequence[Lamp] = (),
    iterations: int = 400,
    tolerance: float = 1e-4,
) -> Generator[Progress, None, Lit]:
    """Light patches through a hierarchy of sources.

    Parameters
    ----------
    patches : Patches
    occluders : Surroundings
    quality : Quality
    workers : concurrent.futures.Executor
        Who computes; the result does not depend on it, bit for bit.
    sides : ndarray of shape (f,), optional
        Which sides of all faces that block have light, see `Scene`; their fronts when not given.
    occludes : ndarray of shape (f,), optional
        Which faces block; all when not given.
    direct, sky : callable, optional
        Light of lamps that are no elements, and of the sky.
    lamps : sequence of Lamp, optional
        Which lamps those are: patches near them are split.
    iterations, tolerance
        Stop rules, see `gathering`.

    Yields
    ------
    Progress

    Returns
    -------
    Lit
    """
    yield Progress("Elements", 0.0)
    asked = SharedOut(occluders, workers)
    elements = split_patches(patches, asked, tolerance=quality.split, size=quality.size, lamps=lamps)
    through = piece_translucence(elements.corners, elements.patch, patches)
    yield Progress("Elements", 0.6)
    around = find_neighbourhoods(elements, asked, sides, workers) if len(elements) > _FEW else None
    yield Progress("Elements", 1.0)
    # That light is only to be passed on: of very many elements some look for those around them.
    many = choose_samples(elements, asked, _STRAIGHT * quality.samples, around)
    H0 = np.zeros_like(elements.emission)
    yield Progress(FIRST_LOOK, 0.0)
    if direct:
        H0 += many.spread(direct(elements.centre[many.element], elements.normal[many.element]))
        yield Progress(FIRST_LOOK, 0.0)
    # The sky changes less from place to place: fewer look at it.
    fewer = choose_samples(elements, asked, _UP * quality.samples, around, finer=many)
    if sky:
        H0 += fewer.spread(sky(elements.centre[fewer.element], elements.normal[fewer.element]))
        yield Progress(FIRST_LOOK, 0.0)
    look = yield from first_look(elements, many, H0, occluders, quality, workers)
    yield Progress(FIRST_LOOK, 1.0)
    samples = choose_samples(elements, asked, quality.samples, around, finer=fewer)
    few = choose_samples(elements, asked, _FEW, around, finer=samples)
    # A few samples tell where the light is, and the links are made for that.
    hits = _element_hits(elements, patches, occludes) if in_blender() else None
    radiosity, typical = yield from _rough_light(few, look, H0, through, occluders, hits, workers, iterations)
    scenery = build_scenery(elements, radiosity, typical, occluders, workers=workers, hits=hits)
    yield Progress(LINKS, 0.0)
    transport, solution = yield from bounces(
        samples, scenery, look, H0, through, radiosity, quality.solve, workers, iterations, tolerance
    )
    typical = typical_irradiance(elements, solution.irradiance, transport.row_sums()) or typical
    scenery = relit(scenery, elements, solution.radiosity, typical)
    straight = look.irradiance(transport.sums)
    rays = look.rays + transport.rays
    return Lit(elements, transport, solution, H0, look.emission, straight, scenery, look.scenery, through, sides, rays)


def _element_hits(elements: Elements, patches: Patches, occludes: NDArray[np.bool_] | None) -> ElementHits:
    """Return what tells which elements rays meet."""
    face, side = patches.face[elements.patch], patches.side[elements.patch]
    return ElementHits(elements.corners, face, side, None if occludes is None else occludes[face])


def _rough_light(
    samples: Samples,
    look: Look,
    direct: Float,
    through: Translucence | None,
    occluders: Surroundings,
    hits: ElementHits | None,
    workers: Executor,
    iterations: int,
) -> Generator[Progress, None, tuple[Float, float]]:
    """Solve for a few samples, and keep nothing but the radiosity of all elements and a typical irradiance [W/m^2]."""
    elements = look.elements
    guess, known, typical = ambient_guess(elements, direct, look, through)
    scenery = build_scenery(elements, guess, typical, occluders, known, workers, hits)
    steps = bounces(samples, scenery, look, direct, through, guess, _COARSE, workers, iterations, _COARSELY)
    transport, solution = yield from renamed(steps, FIRST_LOOK)
    typical = typical_irradiance(elements, solution.irradiance, transport.row_sums()) or typical
    return solution.radiosity, typical


def patch_solution(lit: Lit, patches: Patches) -> Solution:
    """Return the solution on whole patches: the means over their elements."""
    elements, solution = lit.elements, lit.solution
    A = np.bincount(elements.patch, elements.area, len(patches.area))

    def mean(values: Float) -> Float:
        sums = [np.bincount(elements.patch, elements.area * values[:, k], len(A)) for k in range(values.shape[1])]
        return np.stack(sums, axis=1) / A[:, None]

    return Solution(
        mean(solution.radiosity),
        mean(solution.irradiance),
        solution.iterations,
        solution.converged,
        solution.residual,
    )
