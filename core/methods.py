# SPDX-License-Identifier: GPL-3.0-or-later
"""The ways from patches to light: the hierarchy that users run, and the thesis's two as they stand."""

import os
import time
from collections import defaultdict
from collections.abc import Callable, Generator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .arrays import FloatArray
from .dense.columns import column_transport
from .dense.matrix import dense_transport
from .gathering import gathering
from .hierarchy.corners import COVERED, corner_receivers, final_gather
from .hierarchy.quality import QUALITIES
from .hierarchy.solve import Lit, exposed_elements, exposed_irradiance, patch_solution, solve
from .lighting.lamps import SkyLamp, direct_light
from .meshing import Patches
from .occlusion.surfaces import occluder_polygons
from .progress import Progress, T
from .report import Energy, energy_balance
from .scene import Scene
from .settings import Settings
from .shading import corner_irradiance
from .shooting import shooting
from .solution import Solution
from .transport import MOST_SENT, reciprocity_error
from .visibility import Surroundings


@dataclass(frozen=True, eq=False)
class Solved:
    """What a method hands back.

    Attributes
    ----------
    solution : Solution
        On the n patches.
    corner_irradiance, corner_direct : ndarray of shape (c, 3)
        What arrives at the scene's c corners, and the part of it that is direct light [W/m^2].
    row_sums : ndarray of shape (n,)
        Share of each patch's light that meets a patch, as the form factors say; NaN where not known.
    energy : Energy
    reciprocity : float or None
        How far the form factors are from A_i F_ij = A_j F_ji, relative to their sum; None where not known.
    links, rays : int
        Pairs that exchange light, and segments tested for visibility.
    seconds : dict
        Time of each stage: form_factors, solve, shade, and what they are made of.
    """

    solution: Solution
    corner_irradiance: FloatArray
    corner_direct: FloatArray
    row_sums: FloatArray
    energy: Energy
    reciprocity: float | None
    links: int
    rays: int
    seconds: dict[str, float]


class _Clock:
    """Tells how long each stage of some generators of progress takes, by what they yield."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)

    def watch(self, steps: Generator[Progress, None, T]) -> Generator[Progress, None, T]:
        """Pass on what `steps` yields, and return what it returns; closing this closes `steps`."""
        stage, begun = "", time.perf_counter()
        try:
            while True:
                try:
                    progress = next(steps)
                except StopIteration as end:
                    result: T = end.value
                    return result
                finally:
                    now = time.perf_counter()
                    elapsed, begun = now - begun, now
                    self.seconds[stage] += elapsed
                # A stage is named by the first progress within it, which comes after some work.
                if progress.stage.lower() != stage:
                    self.seconds[stage] -= elapsed
                    stage = progress.stage.lower()
                    self.seconds[stage] += elapsed
                yield progress
        finally:
            steps.close()


Method = Callable[
    [Scene, Patches, Settings, Surroundings, Executor | None],
    Generator[Progress, None, Solved],
]


def _hierarchical(
    scene: Scene, patches: Patches, settings: Settings, occluders: Surroundings, executor: Executor | None
) -> Generator[Progress, None, Solved]:
    """Solve through a hierarchy of sources and gather once more at the corners."""
    quality = QUALITIES[settings.quality]
    clock = _Clock()
    with ExitStack() as stack:
        workers = executor or stack.enter_context(ThreadPoolExecutor(os.cpu_count()))
        lamps = partial(direct_light, scene, settings=settings, occluders=occluders, workers=workers)
        near = [lamp for lamp in scene.lamps if not isinstance(lamp, SkyLamp)]
        far = [lamp for lamp in scene.lamps if isinstance(lamp, SkyLamp)]
        direct = partial(lamps, lamps=near) if near else None
        sky = partial(lamps, lamps=far) if far else None
        lit = yield from clock.watch(
            solve(
                patches,
                occluders,
                quality,
                workers,
                direct=partial(lamps, rough=True) if scene.lamps else None,
                iterations=settings.iterations,
                tolerance=settings.tolerance,
            )
        )
        corners = corner_receivers(scene)
        elements, solution = lit.elements, lit.solution
        exposed = exposed_elements(lit)
        H = exposed_irradiance(lit, patches, corners.group, solution.irradiance, exposed)
        straight = solution.irradiance if solution.direct is None else solution.direct
        first = exposed_irradiance(lit, patches, corners.group, straight, exposed)
        B = elements.emission + elements.reflectance * H
        H, first, links, rays = yield from clock.watch(
            final_gather(
                scene,
                corners,
                lit,
                B,
                H,
                first,
                exposed,
                patches,
                quality,
                workers,
                direct=direct,
                sky=sky,
            )
        )
    # Elements that something stands on see nothing: their rows tell nothing about the others.
    sums = lit.transport.row_sums()
    sums = np.where(sums > COVERED, sums, np.nan)
    share = elements.area / patches.area[elements.patch]
    spent = clock.seconds
    seconds = {
        "form_factors": spent["elements"] + spent["first look"] + spent["links"],
        "solve": spent["gathering light"],
        "shade": spent["final gather"],
    }
    return Solved(
        patch_solution(lit, patches),
        H[corners.group],
        first[corners.group],
        np.bincount(elements.patch, share * sums, len(patches.area)),
        _energy(lit),
        None,
        lit.transport.links + links,
        lit.rays + rays,
        seconds | {name: spent[name] for name in ("elements", "first look", "links")},
    )


def _energy(lit: Lit) -> Energy:
    """Add up where the light of a hierarchical solution went; what arrives from lamps counts as emitted."""
    elements, solution, A = lit.elements, lit.solution, lit.elements.area[:, None]
    source = elements.emission - lit.lamp + lit.direct + lit.straight
    others = replace(solution, radiosity=solution.radiosity - lit.lamp)
    energy = energy_balance(elements.area, source, elements.reflectance, others, lit.transport.sent())
    # What lamps send and nothing receives.
    lost = float((A * (lit.lamp - lit.straight)).sum())
    emitted = energy.emitted + lost
    error = energy.error * energy.emitted / emitted if emitted else 0.0
    return Energy(emitted, energy.absorbed, energy.escaped + lost, error)


def _gathering(
    scene: Scene, patches: Patches, settings: Settings, occluders: Surroundings, executor: Executor | None
) -> Generator[Progress, None, Solved]:
    """Solve with the whole matrix (T5, T13)."""
    clock = _Clock()
    surfaces = occluder_polygons(scene, patches)
    steps = dense_transport(patches, occluders, kernel=settings.form_factors, surfaces=surfaces, executor=executor)
    transport = yield from clock.watch(steps)
    reciprocity = reciprocity_error(transport)
    H0 = direct_light(scene, patches.centre, patches.normal, settings, occluders)
    solution = yield from clock.watch(
        gathering(
            transport,
            patches.emission + patches.reflectance * H0,
            patches.reflectance,
            iterations=settings.iterations,
            tolerance=settings.tolerance,
        )
    )
    solution = replace(solution, direct=transport.gather(patches.emission))
    return _interpolated(
        scene, patches, H0, solution, transport.row_sums(), reciprocity, transport.links, transport.rays, clock
    )


def _shooting(
    scene: Scene, patches: Patches, settings: Settings, occluders: Surroundings, executor: Executor | None
) -> Generator[Progress, None, Solved]:
    """Solve with columns on demand (T8)."""
    clock = _Clock()
    surfaces = occluder_polygons(scene, patches)
    transport = column_transport(patches, occluders, kernel=settings.form_factors, surfaces=surfaces)
    # As many shots as that many sweeps have patches.
    most = settings.iterations * len(patches.area)
    H0 = direct_light(scene, patches.centre, patches.normal, settings, occluders)
    E, rho = patches.emission + patches.reflectance * H0, patches.reflectance
    solution = yield from clock.watch(
        shooting(transport, E, rho, iterations=most, tolerance=settings.tolerance, own=patches.emission)
    )
    sums = transport.row_sums()
    return _interpolated(scene, patches, H0, solution, sums, None, transport.links, transport.rays, clock)


def _interpolated(
    scene: Scene,
    patches: Patches,
    direct: FloatArray,
    solution: Solution,
    sums: FloatArray,
    reciprocity: float | None,
    links: int,
    rays: int,
    clock: _Clock,
) -> Solved:
    """Take the light at the corners from the patches that meet there (T16); `direct` light came from no patch."""
    begun = time.perf_counter()
    first = direct if solution.direct is None else solution.direct + direct
    solution = replace(solution, irradiance=solution.irradiance + direct, direct=first)
    H, first = (corner_irradiance(scene, patches, light) for light in (solution.irradiance, first))
    spent = clock.seconds
    seconds = {
        "form_factors": spent["form factors"],
        "solve": spent["gathering light"] + spent["shooting light"],
        "shade": time.perf_counter() - begun,
    }
    # What arrives from lamps counts as emitted.
    E, rho = patches.emission + direct, patches.reflectance
    energy = energy_balance(patches.area, E, rho, solution, np.minimum(sums, MOST_SENT))
    return Solved(solution, H, first, sums, energy, reciprocity, links, rays, seconds)


METHODS: dict[str, Method] = {"hierarchical": _hierarchical, "gathering": _gathering, "shooting": _shooting}
