# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchical method from patches to light: elements, a first look, links, bounces, and a final gather."""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from ..gathering import gathering
from ..meshing import Patches
from ..progress import Progress
from ..solution import Solution
from ..visibility import Occluders
from .elements import Elements, split_patches
from .quality import Quality
from .receivers import DirectLight, group_receivers
from .rows import Scenery, gather, stream_rows
from .transport import HierarchicalTransport, build_scenery, hierarchical_transport, node_means, relit
from .tree import Float, Int

# Reflectance that the ambient light of the first look is estimated with, at most.
_MOST_AMBIENT = 0.9
# Share of its surroundings that an element in a closed room has to see for not being hidden itself.
EXPOSED = 0.3
# The last sweeps go on to this part of the tolerance: in a bright room a sweep changes little of what is missing.
_CLOSER = 0.05


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
        The part of their irradiance that comes from lamps and not from elements [W/m^2].
    scenery : Scenery
        Lit by the solution, for a final gather.
    rays : int
        Cast up to here.
    """

    elements: Elements
    transport: HierarchicalTransport
    solution: Solution
    direct: Float
    scenery: Scenery
    rays: int


def solve(
    patches: Patches,
    occluders: Occluders,
    quality: Quality,
    workers: Executor,
    *,
    direct: DirectLight | None = None,
    iterations: int = 200,
    tolerance: float = 1e-4,
) -> Generator[Progress, None, Lit]:
    """Light patches through a hierarchy of sources.

    Parameters
    ----------
    patches : Patches
    occluders : Occluders
    quality : Quality
    workers : concurrent.futures.Executor
        Who computes; the result does not depend on it, bit for bit.
    direct : callable, optional
        Light of lamps that are no elements.
    iterations, tolerance
        Stop rules, see `gathering`.

    Yields
    ------
    Progress

    Returns
    -------
    Lit
    """
    elements = split_patches(patches, occluders, tolerance=quality.split, size=quality.size)
    yield Progress("Elements", 1.0)
    E, rho = elements.emission.copy(), elements.reflectance
    H0 = direct(elements.centre, elements.normal) if direct else np.zeros_like(E)
    guess, typical, rays = yield from _first_look(elements, E, rho, H0, occluders, quality, workers)
    E += rho * H0
    scenery = build_scenery(elements, guess, typical, occluders)
    yield Progress("Links", 0.0)
    transport = yield from hierarchical_transport(elements, scenery, quality.solve, workers)
    # Where the light is decides how much of it goes amiss: once by the guess, once by the solution.
    transport = transport.balanced(guess)
    solution = yield from gathering(transport, E, rho, iterations=iterations, tolerance=tolerance)
    if iterations > 1:
        transport = transport.balanced(solution.radiosity)
        again = yield from gathering(
            transport, E, rho, iterations=iterations, tolerance=_CLOSER * tolerance, start=solution.radiosity
        )
        converged = solution.converged and again.residual <= tolerance
        solution = replace(again, iterations=solution.iterations + again.iterations, converged=converged)
    solution = replace(solution, irradiance=solution.irradiance + H0)
    typical = typical_irradiance(elements, solution.irradiance) or typical
    scenery = relit(scenery, elements, solution.radiosity, typical)
    return Lit(elements, transport, solution, H0, scenery, rays + transport.rays)


def typical_irradiance(elements: Elements, irradiance: Float) -> float:
    """Return the irradiance that errors are judged by: the mean over all area and channels [W/m^2]."""
    return float(elements.area @ irradiance.mean(axis=1) / elements.area.sum())


def exposed_irradiance(lit: Lit, patches: Patches, group: Int, irradiance: Float) -> Float:
    """Return the irradiance that elements show, shape (n, 3) [W/m^2].

    An element whose middle is under something else may still reach out from below: what shows of it is lit as the rest
    of its patch is, or as the patches beside that are.

    Parameters
    ----------
    lit : Lit
    patches : Patches
    group : ndarray of shape (c,)
        Smooth group of each mesh corner: what is beside what.
    irradiance : ndarray of shape (n, 3)
        What arrives at the elements, all of it or a part [W/m^2].
    """
    elements, H = lit.elements, irradiance
    exposed = lit.transport.row_sums() > EXPOSED
    shown = _sums(elements.patch, np.where(exposed, elements.area, 0), H, len(patches.area))
    at = group[patches.touch_corner]
    around = _sums(at, np.ones(len(at)), shown[patches.touch_patch], int(np.max(group, initial=-1)) + 1)
    beside = _sums(patches.touch_patch, np.ones(len(at)), around[at], len(patches.area))
    light = np.where(shown[:, 3:] > 0, shown, beside)
    mean = light[:, :3] / np.maximum(light[:, 3:], 1e-300)
    hidden = ~exposed & (light[elements.patch, 3] > 0)
    return np.where(hidden[:, None], mean[elements.patch], H)


def _sums(at: Int, weight: Float, values: Float, count: int) -> Float:
    """Add up weighted values with three columns, and in a fourth the weights, or those that the values come with."""
    last = values[:, 3] if values.shape[1] > 3 else np.ones(len(values))
    columns = (*values[:, :3].T, last)
    return np.stack([np.bincount(at, weight * column, count) for column in columns], axis=1)


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


def _first_look(
    elements: Elements,
    emission: Float,
    reflectance: Float,
    direct: Float,
    occluders: Occluders,
    quality: Quality,
    workers: Executor,
) -> Generator[Progress, None, tuple[Float, float, int]]:
    """Estimate who is bright from direct light and an ambient share of the rest, as shooting displays it."""
    A = elements.area[:, None]
    grey = min(float((A * reflectance).mean() / A.mean()), _MOST_AMBIENT)
    everywhere = float((A * (emission + direct)).sum(axis=0).mean() / A.sum() / (1 - grey))
    H, rays = direct.copy(), 0
    shining = np.flatnonzero(emission.any(axis=1))
    if len(shining):
        emitters = elements.pick(shining)
        scenery = build_scenery(emitters, emission[shining], everywhere, occluders)
        single = node_means(scenery.sources, emitters.area, emission[shining]).astype(np.float32)
        receivers = group_receivers(elements.centre, elements.normal)
        parts = []
        for rows in stream_rows(receivers, scenery, quality.pilot, workers):
            parts.append(gather(rows, receivers, single))
            rays += rows.rays
            yield Progress("First look", (int(rows.group[-1]) + 1) / len(receivers))
        H[receivers.index] += np.concatenate(parts)
    ambient = (A * reflectance * H).sum(axis=0) / A.sum() / (1 - grey)
    typical = typical_irradiance(elements, H + ambient)
    return emission + reflectance * (H + ambient), typical or everywhere or 1.0, rays
