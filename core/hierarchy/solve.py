# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchical method from patches to light: elements, light straight from emitters, links, and bounces.

Light that comes straight from lamps (elements that shine much brighter than what they light) is looked for at every
element; all other light changes less from place to place and is solved for at samples.
"""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from ..facing.lit_sides import Surroundings
from ..gathering import gathering
from ..meshing import Patches
from ..progress import Progress
from ..solution import Solution
from .elements import Elements, split_patches
from .quality import Quality
from .receivers import DirectLight, Receivers, group_receivers
from .rows import Rows, Scenery, gather, received, stream_rows
from .samples import choose_samples
from .transport import (
    BALANCE,
    MOST_LAMPS,
    HierarchicalTransport,
    build_scenery,
    check_memory,
    hierarchical_transport,
    node_means,
    of_leaves,
    relit,
)
from .tree import Float, Int

# Reflectance that the ambient light of the first look is estimated with, at most.
_MOST_AMBIENT = 0.9
# Share of its surroundings that an element in a closed room has to see for not being hidden itself.
EXPOSED = 0.3
# An element is a lamp when it emits this many times what arrives at a typical one.
_LAMP = 3.0
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
        The part of their irradiance that comes from no element [W/m^2].
    lamp : ndarray of shape (n, 3)
        What elements that are lamps emit [W/m^2].
    straight : ndarray of shape (n, 3)
        The irradiance that comes straight from those [W/m^2].
    scenery : Scenery
        Lit by the solution, for a final gather.
    lamps : Scenery or None
        The lamps alone.
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
    rays: int


def solve(
    patches: Patches,
    occluders: Surroundings,
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
    occluders : Surroundings
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
    E, rho, A = elements.emission, elements.reflectance, elements.area[:, None]
    H0 = direct(elements.centre, elements.normal) if direct else np.zeros_like(E)
    look = yield from _first_look(elements, H0, occluders, quality, workers)
    first = H0 + look.irradiance()
    # A guess at what is bright: direct light, and an even share of the rest, as shooting displays it.
    grey = min(float((A * rho).mean() / A.mean()), _MOST_AMBIENT)
    ambient = (A * rho * first).sum(axis=0) / A.sum() / (1 - grey)
    ambient += (A * (E - look.emission)).sum(axis=0) / A.sum() / (1 - grey)
    guess = E + rho * (first + ambient)
    typical = typical_irradiance(elements, first + ambient) or look.typical
    scenery = build_scenery(elements, guess, typical, occluders)
    yield Progress("Links", 0.0)
    samples = choose_samples(elements, occluders, quality.samples)
    transport = yield from hierarchical_transport(elements, samples, scenery, quality.solve, workers)
    straight = look.irradiance(transport.sums)
    # All but the lamps' own light: B' = B - E of the lamps = E' + rho (H straight + G B').
    dim = E - look.emission
    source = dim + rho * (H0 + straight)
    transport, solution = yield from _bounces(
        transport, source, dim, guess - look.emission, rho, iterations, tolerance
    )
    solution = replace(
        solution,
        radiosity=look.emission + solution.radiosity,
        irradiance=H0 + straight + solution.irradiance,
        direct=H0 + straight + transport.gather(dim),
    )
    typical = typical_irradiance(elements, solution.irradiance) or typical
    scenery = relit(scenery, elements, solution.radiosity, typical)
    rays = look.rays + transport.rays
    return Lit(elements, transport, solution, H0, look.emission, straight, scenery, look.scenery, rays)


def _bounces(
    transport: HierarchicalTransport,
    source: Float,
    start: Float,
    guess: Float,
    rho: Float,
    iterations: int,
    tolerance: float,
) -> Generator[Progress, None, tuple[HierarchicalTransport, Solution]]:
    """Let light bounce, with the energy in balance; the first sweep, of what is emitted, is direct light (T6)."""
    # Where the light is decides how much of it goes amiss: once by the guess, once by the solution.
    transport = transport.balanced(guess)
    solution = yield from gathering(
        transport, source, rho, iterations=iterations, tolerance=tolerance, start=start
    )
    if iterations == 1:
        return transport, solution
    transport = transport.balanced(solution.radiosity)
    again = yield from gathering(
        transport, source, rho, iterations=iterations, tolerance=_CLOSER * tolerance, start=solution.radiosity
    )
    converged = solution.converged and again.residual <= tolerance
    return transport, replace(again, iterations=solution.iterations + again.iterations, converged=converged)


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


@dataclass(frozen=True, eq=False)
class _Look:
    """Links of all elements to the lamps alone."""

    elements: Elements
    shining: Int
    emission: Float
    scenery: Scenery | None
    receivers: Receivers | None
    rows: list[Rows]
    typical: float

    @property
    def rays(self) -> int:
        """How many rays were cast."""
        return sum(rows.rays for rows in self.rows)

    def irradiance(self, sums: Float | None = None) -> Float:
        """Return the light straight from the lamps, shape (n, 3) [W/m^2].

        Parameters
        ----------
        sums : ndarray of shape (n,), optional
            Share of each element's light that meets another: what does not arrive in sum is put right.
        """
        E, A = self.elements.emission[self.shining], self.elements.area
        H = np.zeros((len(A), 3))
        if self.scenery is None or self.receivers is None:
            return H
        sources, order = self.scenery.sources, self.receivers.index
        if sums is not None and len(self.shining) <= MOST_LAMPS:
            received_by = [received(part, self.receivers, A[order], len(sources.area)) for part in self.rows]
            arrives = of_leaves(sources, np.sum(received_by, axis=0))
            share = sums[self.shining] / np.where(arrives > 0, arrives, 1)
            E = E * np.where(arrives > 0, np.clip(share, 1 / BALANCE, BALANCE), 1)[:, None]
        means = node_means(sources, A[self.shining], E).astype(np.float32)
        H[order] = np.concatenate([gather(part, self.receivers, means) for part in self.rows])
        return H


def _first_look(
    elements: Elements, direct: Float, occluders: Surroundings, quality: Quality, workers: Executor
) -> Generator[Progress, None, _Look]:
    """Link all elements to those that are lamps."""
    E, A = elements.emission, elements.area[:, None]
    grey = min(float((A * elements.reflectance).mean() / A.mean()), _MOST_AMBIENT)
    everywhere = float((A * (E + direct)).sum(axis=0).mean() / A.sum() / (1 - grey)) or 1.0
    bright = E.mean(axis=1) > _LAMP * everywhere
    shining, emission = np.flatnonzero(bright), np.where(bright[:, None], E, 0)
    if not len(shining):
        return _Look(elements, shining, emission, None, None, [], everywhere)
    scenery = build_scenery(elements.pick(shining), E[shining], everywhere, occluders)
    receivers = group_receivers(elements.centre, elements.normal)
    rows: list[Rows] = []
    done = 0
    for part in stream_rows(receivers, scenery, quality.direct, workers):
        rows.append(part)
        done += len(part.group)
        check_memory(rows, done / len(receivers))
        yield Progress("First look", done / len(receivers))
    return _Look(elements, shining, emission, scenery, receivers, rows, everywhere)
