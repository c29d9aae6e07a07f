# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces cut as fine as light needs them, where nobody has chosen a size of patches: evenly first, then by a first look.

The first look is a bake of its own, at the quality for that. It is left out where faces are so many that it would take
as long as the bake itself, and at that quality.
"""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from .bake import bake
from .hierarchy.quality import QUALITIES
from .patch_sizes import changing_edges, even_edges
from .progress import Progress, within
from .refined_scene import refined_scene
from .refinement import Refinement, refine
from .refinement_of_two import composed
from .scene import Scene
from .settings import Settings

_FIRST_LOOK = "preview"
# Faces above which it is left out, times those that a quality lets look for themselves.
_FEW = 2
# How often it is done, as long as so large a share of the faces that there may be is left.
_LOOKS, _WORTH = 2, 1 / 4


def graded(
    scene: Scene, settings: Settings, *, executor: Executor | None = None
) -> Generator[Progress, None, Refinement | None]:
    """Cut large faces finer.

    Parameters
    ----------
    scene : Scene
    settings : Settings
        Of the bake; the sizes in it are not looked at.
    executor : concurrent.futures.Executor, optional
        See `bake`.

    Yields
    ------
    Progress

    Returns
    -------
    Refinement or None
        Of the scene; None where no face is large, or has a length of its own.

    Raises
    ------
    RadiosityError
        When there would be too many faces, or no light.
    """
    quality = QUALITIES[settings.quality]
    most, white = max(quality.corners, len(scene.face_area)), settings.light == "lighting"
    edges = even_edges(scene, quality.size, most // 2, white=white)
    own, large = np.isfinite(scene.max_edge), np.isfinite(edges)
    if not (large | own).any():
        return None
    fine = refine(replace(scene, max_edge=np.where(own, scene.max_edge, edges)))
    if settings.quality == _FIRST_LOOK or len(fine.face) > _FEW * quality.corners:
        return fine
    look = replace(settings, quality=_FIRST_LOOK, method="hierarchical", max_edge=None, subdivide=1)
    rho = np.ones(len(edges)) if white else scene.reflectance.mean(axis=1)
    for _ in range(_LOOKS):
        room = most - int(large[fine.face].sum())
        if room < _WORTH * most:
            break
        finer = refined_scene(scene, fine)
        baked = yield from within("First look at the light", bake(finer, look, executor=executor))
        light = baked.solution.irradiance, baked.corner_irradiance
        wanted = changing_edges(finer, rho[fine.face], baked.patches, light, room)
        wanted[~large[fine.face]] = np.nan
        if np.isnan(wanted).all():
            break
        fine = composed(fine, refine(replace(finer, max_edge=wanted)))
    return fine
