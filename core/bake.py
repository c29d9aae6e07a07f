# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole street from a scene to the colours of its corners: mesh, see, solve, shade, report."""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .meshing import Patches
from .progress import Progress
from .report import Report
from .scene import Scene
from .settings import Settings
from .solution import Solution
from .visibility import Occluders


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

    corner_radiance: NDArray[np.float64]
    patches: Patches
    solution: Solution
    report: Report


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
    yield Progress("Patches", 0.0)
    raise NotImplementedError("the street is being built")
