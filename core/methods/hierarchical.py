# SPDX-License-Identifier: GPL-3.0-or-later
"""From patches to light through the hierarchy of sources."""

import os
from collections.abc import Generator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from ..hierarchy.corners import COVERED, Corners, final_gather
from ..hierarchy.exposed import exposed_corners, shown_light
from ..hierarchy.foresight import refuse_too_many
from ..hierarchy.glances import STAGE
from ..hierarchy.notches import at_corners
from ..hierarchy.quality import QUALITIES
from ..hierarchy.solve import Lit, patch_solution, solve
from ..hierarchy.vantages import corner_receivers
from ..lighting.lamps import SkyLamp, direct_light
from ..meshing import Patches
from ..progress import Progress
from ..report import Energy, energy_balance
from ..scene import Scene
from ..screens import screens
from ..settings import Settings
from ..shading import smooth_groups
from ..translucence import LightBehind, behind
from ..visibility import Surroundings, panes_of
from .clock import Clock
from .solved import Solved

Gathering = Generator[Progress, None, tuple[FloatArray, FloatArray, int, int]]


def hierarchical(
    scene: Scene, patches: Patches, settings: Settings, occluders: Surroundings, executor: Executor | None
) -> Generator[Progress, None, Solved]:
    """Solve through a hierarchy of sources and gather once more at the corners.

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

    Raises
    ------
    RadiosityError
        When it would not fit into memory.
    """
    refuse_too_many(len(patches.area))
    panes = panes_of(occluders)
    patches = patches if panes is None else screens(patches, panes.solid)
    quality, clock = QUALITIES[settings.quality], Clock()
    with ExitStack() as stack:
        workers = executor or stack.enter_context(ThreadPoolExecutor(os.cpu_count()))
        lamps = partial(direct_light, scene, settings=settings, occluders=occluders, workers=workers)
        # The sky changes less from place to place than the light of other lamps.
        near = [lamp for lamp in scene.lamps if not isinstance(lamp, SkyLamp)]
        far = [lamp for lamp in scene.lamps if isinstance(lamp, SkyLamp)]
        direct, sky = (partial(lamps, lamps=some) if some else None for some in (near, far))
        roughly, up = (partial(light, rough=True) if light else None for light in (direct, sky))
        most, least = settings.iterations, settings.tolerance
        steps = solve(
            patches,
            occluders,
            quality,
            workers,
            sides=scene.sides,
            occludes=scene.occludes,
            direct=roughly,
            sky=up,
            lamps=near,
            iterations=most,
            tolerance=least,
        )
        lit = yield from clock.watch(steps)

        yield Progress(STAGE, 0.0)
        group = smooth_groups(scene)
        shown = shown_light(lit, patches, group)
        exposed = exposed_corners(shown, lit.elements, patches, group)
        corners = corner_receivers(scene, exposed)
        lights = partial(final_gather, lit=lit, shown=shown, quality=quality, direct=direct, sky=sky)

        def gather(scene: Scene, corners: Corners, patches: Patches) -> Gathering:
            return clock.watch(lights(scene, corners, patches=patches, workers=workers))

        H, first, links, rays = yield from gather(scene, corners, patches)
        back, beyond = behind(scene, patches), None
        if back is not None:
            others = corner_receivers(back.scene)
            there, straight, more_links, more_rays = yield from gather(back.scene, others, back.patches)
            beyond = LightBehind(back.corner, *(at_corners(back.scene, others, light) for light in (there, straight)))
            links, rays = links + more_links, rays + more_rays
    return Solved(
        solution=patch_solution(lit, patches),
        corner_irradiance=at_corners(scene, corners, H),
        corner_direct=at_corners(scene, corners, first),
        row_sums=_row_sums(lit, patches, shown.exposed),
        energy=_energy(lit),
        reciprocity=None,
        links=lit.transport.links + links,
        rays=lit.rays + rays,
        seconds=_seconds(clock),
        behind=beyond,
    )


def _row_sums(lit: Lit, patches: Patches, exposed: NDArray[np.bool_]) -> FloatArray:
    """Return the means over the elements of each patch, shape (p,)."""
    elements, sums = lit.elements, lit.transport.row_sums()
    # Elements that something stands on see next to nothing: their rows tell nothing about the others.
    sums = np.where(exposed & (sums > COVERED), sums, np.nan)
    share = elements.area / patches.area[elements.patch]
    return np.bincount(elements.patch, share * sums, len(patches.area))


def _seconds(clock: Clock) -> dict[str, float]:
    """Return the times of the stages that all methods have, and of those within the first."""
    spent, parts = clock.seconds, ("elements", "first look", "links")
    return {
        "form_factors": spent["elements"] + spent["first look"] + spent["links"],
        "solve": spent["gathering light"],
        "shade": spent["final gather"],
        **{name: spent[name] for name in parts},
    }


def _energy(lit: Lit) -> Energy:
    """Add up where the light of a hierarchical solution went; what arrives from lamps counts as emitted."""
    elements, solution, A = lit.elements, lit.solution, lit.elements.area[:, None]
    source = elements.emission - lit.lamp + lit.direct + lit.straight
    others = replace(solution, radiosity=solution.radiosity - lit.lamp)
    albedo = elements.reflectance if lit.through is None else lit.through.albedo(elements.reflectance)
    energy = energy_balance(elements.area, source, albedo, others, lit.transport.sent())
    # What lamps send and nothing receives.
    lost = float((A * (lit.lamp - lit.straight)).sum())
    emitted = energy.emitted + lost
    error = energy.error * energy.emitted / emitted if emitted else 0.0
    return Energy(emitted, energy.absorbed, energy.escaped + lost, error)
