# SPDX-License-Identifier: GPL-3.0-or-later
"""From patches to light by the thesis's two methods: with the whole matrix of form factors, or a column at a time."""

import time
from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from ..arrays import FloatArray
from ..dense.columns import column_transport
from ..dense.matrix import dense_transport
from ..gathering import gathering
from ..lighting.lamps import direct_light
from ..meshing import Patches
from ..occlusion.surfaces import occluder_polygons
from ..progress import Progress
from ..report import energy_balance
from ..scene import Scene
from ..settings import Settings
from ..shading import corner_irradiance
from ..shooting import shooting
from ..solution import Solution
from ..translucence import LightBehind, behind, patch_translucence, scattered
from ..transport import MOST_SENT, reciprocity_error
from ..visibility import Surroundings
from .clock import Clock
from .solved import Solved


def by_gathering(
    scene: Scene, patches: Patches, settings: Settings, occluders: Surroundings, executor: Executor | None
) -> Generator[Progress, None, Solved]:
    """Solve with the whole matrix (T5, T13).

    Parameters
    ----------
    scene : Scene
        Without sides that are left open.
    patches : Patches
        How it is meshed.
    settings : Settings
    occluders : Surroundings
        What blocks.
    executor : concurrent.futures.Executor or None
        Who computes; a thread for each processor when None.

    Yields
    ------
    Progress

    Returns
    -------
    Solved
    """
    clock = Clock()
    surfaces = occluder_polygons(scene, patches)
    steps = dense_transport(patches, occluders, kernel=settings.form_factors, surfaces=surfaces, executor=executor)
    transport = yield from clock.watch(steps)
    reciprocity = reciprocity_error(transport)
    H0 = direct_light(scene, patches.centre, patches.normal, settings, occluders)
    rho, through = patches.reflectance, patch_translucence(patches)
    E = patches.emission + scattered(rho, H0, through)
    most, least = settings.iterations, settings.tolerance
    solver = gathering(transport, E, rho, iterations=most, tolerance=least, through=through)
    solution = yield from clock.watch(solver)
    solution = replace(solution, direct=transport.gather(patches.emission))
    sums = transport.row_sums()
    return _interpolated(scene, patches, H0, solution, sums, reciprocity, transport.links, transport.rays, clock)


def by_shooting(
    scene: Scene, patches: Patches, settings: Settings, occluders: Surroundings, executor: Executor | None
) -> Generator[Progress, None, Solved]:
    """Solve with columns on demand (T8).

    Parameters
    ----------
    scene : Scene
        Without sides that are left open.
    patches : Patches
        How it is meshed.
    settings : Settings
    occluders : Surroundings
        What blocks.
    executor : concurrent.futures.Executor or None
        Who computes; not asked, for columns come one after the other.

    Yields
    ------
    Progress

    Returns
    -------
    Solved
    """
    clock = Clock()
    surfaces = occluder_polygons(scene, patches)
    transport = column_transport(patches, occluders, kernel=settings.form_factors, surfaces=surfaces)
    # As many shots as that many sweeps have patches.
    most = settings.iterations * len(patches.area)
    H0 = direct_light(scene, patches.centre, patches.normal, settings, occluders)
    rho, through = patches.reflectance, patch_translucence(patches)
    E, least = patches.emission + scattered(rho, H0, through), settings.tolerance
    steps = shooting(transport, E, rho, iterations=most, tolerance=least, own=patches.emission, through=through)
    solution = yield from clock.watch(steps)
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
    clock: Clock,
) -> Solved:
    """Take the light at the corners from the patches that meet there (T16); `direct` light came from no patch."""
    begun = time.perf_counter()
    first = direct if solution.direct is None else solution.direct + direct
    solution = replace(solution, irradiance=solution.irradiance + direct, direct=first)
    lights = solution.irradiance, first
    H, first = (corner_irradiance(scene, patches, light) for light in lights)
    back = behind(scene, patches)
    beyond = None
    if back is not None:
        beyond = LightBehind(back.corner, *(corner_irradiance(back.scene, back.patches, light) for light in lights))
    spent = clock.seconds
    seconds = {
        "form_factors": spent["form factors"],
        "solve": spent["gathering light"] + spent["shooting light"],
        "shade": time.perf_counter() - begun,
    }
    # What arrives from lamps counts as emitted.
    through = patch_translucence(patches)
    albedo = patches.reflectance if through is None else through.albedo(patches.reflectance)
    energy = energy_balance(patches.area, patches.emission + direct, albedo, solution, np.minimum(sums, MOST_SENT))
    return Solved(solution, H, first, sums, energy, reciprocity, links, rays, seconds, beyond)
