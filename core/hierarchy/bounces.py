# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounces: samples are linked to all that they see, and light goes to and fro until nothing changes any more."""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

from ..gathering import gathering
from ..progress import Progress
from ..solution import Solution
from ..translucence import Translucence, scattered
from .first_look import Look
from .linking import hierarchical_transport
from .quality import Detail
from .samples import Samples
from .scenery import Scenery
from .transport import HierarchicalTransport
from .tree import Float

# The last sweeps go on to this part of the tolerance: in a bright room a sweep changes little of what is missing.
_CLOSER = 0.05
# Changes that single precision tells, relative to all.
_FINEST = 1e-6
# Sweeps that tell well enough where the light is, so that energy can be put in balance for the others. Who asks for
# fewer asks for so many bounces.
_FIRST = 64


def bounces(
    samples: Samples,
    scenery: Scenery,
    look: Look,
    direct: Float,
    through: Translucence | None,
    guess: Float,
    detail: Detail,
    workers: Executor,
    iterations: int,
    tolerance: float,
) -> Generator[Progress, None, tuple[HierarchicalTransport, Solution]]:
    """Link samples and let light bounce, with the energy in balance.

    Lamps' own light has been looked at closely: B' = B - E of the lamps = E' + rho (H straight + G B').
    """
    elements = look.elements
    transport = yield from hierarchical_transport(elements, samples, scenery, detail, workers)
    straight, rho = direct + look.irradiance(transport.sums), elements.reflectance
    dim = elements.emission - look.emission
    source = dim + scattered(rho, straight, through)
    # Where the light is decides how much of it goes amiss: once by the guess, once by the solution. The first sweep, of
    # what is emitted, is direct light (T6).
    transport = transport.balanced(guess - look.emission)
    swept = partial(gathering, emission=source, reflectance=rho, through=through)
    swept = partial(swept, sweep="accelerated" if iterations >= _FIRST else "jacobi")
    first = yield from swept(transport, iterations=min(iterations, _FIRST), tolerance=tolerance, start=dim)
    solution = first
    if iterations > 1:
        transport = transport.balanced(first.radiosity)
        # Where no sweeps are left to go on with, all of them are made again: as many bounces as were asked for.
        done = first.iterations if first.iterations < iterations else 0
        solution = yield from swept(
            transport,
            iterations=iterations - done,
            tolerance=max(_CLOSER * tolerance, min(tolerance, _FINEST)),
            start=first.radiosity if done else dim,
        )
        converged = solution.residual <= tolerance
        solution = replace(solution, iterations=done + solution.iterations, converged=converged)
    return transport, replace(
        solution,
        radiosity=look.emission + solution.radiosity,
        irradiance=straight + solution.irradiance,
        direct=straight + transport.gather(dim),
    )
