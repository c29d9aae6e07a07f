# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole street from a scene to the colours of its corners: mesh, see, solve, shade, report."""

import time
from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import RadiosityError
from .gathering import gathering
from .memory import peak_memory
from .meshing import Patches, mesh
from .progress import Progress
from .report import Report, energy_balance, object_counts, row_sum_range, scene_counts
from .scene import Scene
from .settings import Settings
from .shading import corner_radiance
from .shooting import shooting
from .solution import Solution
from .surfaces import occluder_polygons
from .transport import column_transport, dense_transport, reciprocity_error
from .visibility import Occluders, scene_occluders

FloatArray = NDArray[np.float64]

# Row sums above this are worth a warning; in corners the centre kernel reaches 1.24 whatever the meshing.
ROW_SUM_LIMIT = 1.5


@dataclass(frozen=True, eq=False)
class Bake:
    """What a bake ends with.

    Attributes
    ----------
    corner_radiance : ndarray of shape (c, 3)
        Radiance at each of the scene's c face corners, linear and unclamped [W/(m^2 sr)].
    patches : Patches
        What the surfaces were split into.
    solution : Solution
        Light on every patch.
    report : Report
        Figures of the bake.
    """

    corner_radiance: FloatArray
    patches: Patches
    solution: Solution
    report: Report


@dataclass(frozen=True, eq=False)
class Solved:
    """What a method hands back: the part of a bake that differs between them.

    Attributes
    ----------
    solution : Solution
    row_sums : ndarray of shape (n,)
        Share of each patch's light that meets a patch; NaN where not known.
    reciprocity : float or None
        How far the form factors are from A_i F_ij = A_j F_ji, relative to their sum; None where not known.
    links, rays : int
        Pairs that exchange light, and segments tested for visibility.
    solving_since : float
        When the form factors were done and the solving began [s]; a reading of `time.perf_counter`.
    corner_radiance : ndarray of shape (c, 3), optional
        Colours of the corners, for a method that computes them itself [W/(m^2 sr)].
    """

    solution: Solution
    row_sums: FloatArray
    reciprocity: float | None
    links: int
    rays: int
    solving_since: float
    corner_radiance: FloatArray | None = None


def bake(
    scene: Scene, settings: Settings, *, occluders: Occluders | None = None, executor: Executor | None = None
) -> Generator[Progress, None, Bake]:
    """Light a scene.

    Parameters
    ----------
    scene : Scene
        Surfaces in world space [m].
    settings : Settings
        How to light it.
    occluders : Occluders, optional
        Who answers what blocks what; made from the scene when not given.
    executor : concurrent.futures.Executor, optional
        Who runs the parallel parts; a thread pool of the machine's size when not given.

    Yields
    ------
    Progress
        Where it is, stage by stage.

    Returns
    -------
    Bake
        Colours, patches, solution and report.

    Raises
    ------
    RadiosityError
        Nothing to light, no light, or a method that does not fit into this machine's memory.
    """
    _require_light(scene)
    began = time.perf_counter()
    yield Progress("Patches", 0.0)
    patches = mesh(scene, max_edge=settings.max_edge, subdivide=settings.subdivide)
    meshed = time.perf_counter()
    occluders = occluders or scene_occluders(scene, patches)
    # The one place where the methods part.
    if settings.method == "hierarchical":
        raise RadiosityError("The method 'hierarchical' is not there yet: take 'gathering' or 'shooting'")
    if settings.method == "gathering":
        solved = yield from _gather(scene, patches, settings, occluders, executor)
    else:
        solved = yield from _shoot(scene, patches, settings, occluders)
    shading_since = time.perf_counter()
    yield Progress("Colours", 0.0, radiosity=solved.solution.radiosity)
    colours = solved.corner_radiance
    if colours is None:
        colours = corner_radiance(scene, patches, solved.solution.irradiance)
    ended = time.perf_counter()
    seconds = {
        "mesh": meshed - began,
        "form_factors": solved.solving_since - meshed,
        "solve": shading_since - solved.solving_since,
        "shade": ended - shading_since,
        "total": ended - began,
    }
    return Bake(colours, patches, solved.solution, _report(scene, patches, settings, solved, seconds))


def _require_light(scene: Scene) -> None:
    """Refuse scenes that would only be black."""
    if not scene.live.any():
        raise RadiosityError("There is nothing to light: add a mesh object with faces")
    if not scene.emission[scene.live].any():
        raise RadiosityError("There is no light: give a material emission")


def _gather(
    scene: Scene, patches: Patches, settings: Settings, occluders: Occluders, executor: Executor | None
) -> Generator[Progress, None, Solved]:
    """Solve with the whole matrix (T5, T13)."""
    surfaces = occluder_polygons(scene, patches)
    transport = yield from dense_transport(
        patches, occluders, kernel=settings.form_factors, surfaces=surfaces, executor=executor
    )
    reciprocity = reciprocity_error(transport)
    now = time.perf_counter()
    solution = yield from gathering(
        transport,
        patches.emission,
        patches.reflectance,
        iterations=settings.iterations,
        tolerance=settings.tolerance,
    )
    return Solved(solution, transport.sums, reciprocity, transport.links, transport.rays, now)


def _shoot(
    scene: Scene, patches: Patches, settings: Settings, occluders: Occluders
) -> Generator[Progress, None, Solved]:
    """Solve with columns on demand (T8)."""
    transport = column_transport(
        patches, occluders, kernel=settings.form_factors, surfaces=occluder_polygons(scene, patches)
    )
    now = time.perf_counter()
    solution = yield from shooting(
        transport,
        patches.emission,
        patches.reflectance,
        # As many shots as that many sweeps have patches.
        iterations=settings.iterations * len(patches.area),
        tolerance=settings.tolerance,
    )
    return Solved(solution, transport.row_sums(), None, transport.links, transport.rays, now)


def _report(
    scene: Scene, patches: Patches, settings: Settings, solved: Solved, seconds: dict[str, float]
) -> Report:
    """Put the figures together."""
    solution = solved.solution
    rows = row_sum_range(solved.row_sums, patches.area)
    warnings = list(scene.warnings)
    if not solution.converged:
        warnings.append(
            f"Not converged after {solution.iterations} iterations: the residual is {solution.residual:.2g}, "
            f"the tolerance {settings.tolerance:g}; allow more iterations"
        )
    if rows.max > ROW_SUM_LIMIT:
        warnings.append(
            f"Form factors add up to {rows.max:.2f} where 1 is the most: surfaces are close to each other for the size "
            "of their patches; take smaller patches or exact form factors"
        )
    return Report(
        scene=scene_counts(scene),
        patches=len(patches.area),
        links=solved.links,
        rays=solved.rays,
        iterations=solution.iterations,
        converged=solution.converged,
        residual=solution.residual,
        row_sum=rows,
        reciprocity=solved.reciprocity,
        energy=energy_balance(patches.area, patches.emission, patches.reflectance, solution, solved.row_sums),
        seconds=seconds,
        peak_memory_mb=peak_memory() / 2**20,
        objects=object_counts(scene),
        warnings=warnings,
        settings=asdict(settings),
    )
