# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole street from a scene to the colours of its corners: mesh, see, solve, shade, report."""

import time
from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import asdict, dataclass

import numpy as np

from .arrays import FloatArray
from .errors import RadiosityError
from .facing.doubles import without_doubles
from .facing.sides import choose_sides, island_counts
from .hierarchy.foresight import refuse_too_many
from .memory import peak_memory
from .meshing import Patches, mesh
from .methods import METHODS, Solved
from .origin import middle, moved_patches, moved_scene
from .progress import Progress
from .report import Report, object_counts, row_sum_range, scene_counts
from .scene import AUTO, Scene
from .settings import Settings
from .shading import corner_colours
from .solution import Solution
from .unshown import differing_sides, light_between_corners
from .visibility import Surroundings, scene_occluders

# Row sums above this are worth a warning; in corners the centre kernel reaches 1.24 whatever the meshing.
ROW_SUM_LIMIT = 1.5
# Share of the light that may arrive beyond what is sent before it is told: two faces in one plane both receive it.
SURPLUS_LIMIT = 0.05


@dataclass(frozen=True, eq=False)
class Bake:
    """What a bake ends with.

    Attributes
    ----------
    corner_radiance : ndarray of shape (c, 3)
        Radiance at each of the scene's c face corners that `Settings.light` asks for, linear and unclamped
        [W/(m^2 sr)].
    corner_irradiance, corner_direct : ndarray of shape (c, 3)
        What arrives there, and the part that comes straight from what emits, from lamps and from the sky [W/m^2].
    patches : Patches
        What the surfaces were split into.
    solution : Solution
        Light on every patch.
    report : Report
        Figures of the bake.
    """

    corner_radiance: FloatArray
    corner_irradiance: FloatArray
    corner_direct: FloatArray
    patches: Patches
    solution: Solution
    report: Report


def bake(
    scene: Scene, settings: Settings, *, occluders: Surroundings | None = None, executor: Executor | None = None
) -> Generator[Progress, None, Bake]:
    """Light a scene.

    Parameters
    ----------
    scene : Scene
        Surfaces in world space [m].
    settings : Settings
        How to light it.
    occluders : Surroundings, optional
        Who answers what blocks what, and what rays meet first; made from the scene when not given.
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
    if settings.method == "hierarchical":
        # Before minutes are spent on looking for lit sides: a face is a patch at least.
        refuse_too_many(int(np.count_nonzero(scene.live)))
    began = time.perf_counter()
    yield Progress("Patches", 0.0)
    way = middle(scene) if occluders is None else np.zeros(3)
    if way.any():
        scene = moved_scene(scene, -way)
    patches = mesh(scene, max_edge=settings.max_edge, subdivide=settings.subdivide)
    yield Progress("Surfaces", 0.0)
    occluders = occluders or scene_occluders(scene, patches)
    yield Progress("Surfaces", 0.4)
    if (scene.sides == AUTO).any():
        scene = without_doubles(choose_sides(scene, patches, occluders, settings.sides, seed=settings.seed))
        yield Progress("Surfaces", 0.9)
        patches = mesh(scene, max_edge=settings.max_edge, subdivide=settings.subdivide)
    meshed = time.perf_counter()
    solved = yield from METHODS[settings.method](scene, patches, settings, occluders, executor)
    seconds = {"mesh": meshed - began} | solved.seconds | {"total": time.perf_counter() - began}
    unshown = differing_sides(scene, patches, solved.solution.radiosity, solved.row_sums, occluders)
    if solved.solution.converged:
        # Corners are ahead of the patches where light is still on its way.
        unshown += light_between_corners(scene, patches, solved.solution.irradiance, solved.corner_irradiance)
    report = _report(scene, patches, settings, solved, seconds, unshown)
    colours = corner_colours(scene, solved.corner_irradiance, solved.corner_direct, settings.light, solved.behind)
    if way.any():
        patches = moved_patches(patches, way)
    return Bake(colours, solved.corner_irradiance, solved.corner_direct, patches, solved.solution, report)


def _require_light(scene: Scene) -> None:
    """Refuse scenes that would only be black."""
    if not scene.live.any():
        raise RadiosityError("There is nothing to light: add a mesh object with faces")
    if not scene.lamps and not scene.emission[scene.live & scene.emits].any():
        raise RadiosityError("There is no light: give a material emission, or add a lamp or a world that is not black")


def _report(
    scene: Scene, patches: Patches, settings: Settings, solved: Solved, seconds: dict[str, float], unshown: list[str]
) -> Report:
    """Put the figures together."""
    solution = solved.solution
    rows = row_sum_range(solved.row_sums, patches.area)
    warnings = []
    # First, as it is about all that is shown.
    if not solution.converged:
        warnings.append(
            f"Not converged after {solution.iterations} iterations: the residual is {solution.residual:.2g}, the "
            f"tolerance {settings.tolerance:g}, and {solved.energy.error:.1%} of the light is missing; allow more "
            "iterations, or darken what is nearly white"
        )
    warnings += [*scene.warnings, *unshown]
    if rows.max > ROW_SUM_LIMIT:
        warnings.append(
            f"Form factors add up to {rows.max:.2f} where 1 is the most: surfaces are close to each other for the size "
            "of their patches; take smaller patches or exact form factors"
        )
    surplus = -solved.energy.escaped / max(solved.energy.emitted, 1e-300)
    # The matrix has its own line, above.
    if settings.method == "hierarchical" and solution.converged and surplus > SURPLUS_LIMIT:
        warnings.append(
            f"Surfaces receive {surplus:.0%} more light than is sent: faces lie in one plane with others, or "
            "gaps before what emits are narrow for the size of patches; part or subdivide such faces"
        )
    return Report(
        scene=scene_counts(scene),
        islands=island_counts(scene),
        patches=len(patches.area),
        links=solved.links,
        rays=solved.rays,
        iterations=solution.iterations,
        converged=solution.converged,
        residual=solution.residual,
        row_sum=rows,
        reciprocity=solved.reciprocity,
        energy=solved.energy,
        seconds=seconds,
        peak_memory_mb=peak_memory() / 2**20,
        objects=object_counts(scene),
        warnings=warnings,
        settings=asdict(settings),
    )
