# SPDX-License-Identifier: GPL-3.0-or-later
"""Sources of light that are no surfaces: lamps and the sky. They light receivers directly and are met by no ray.

What they send is radiometric, as Blender means it: a point lamp of P watts has the intensity P / (4 pi), an area lamp
the radiance P / (pi A), a sun the irradiance of a surface that faces it, a sky its radiance.
"""

from collections.abc import Sequence
from concurrent.futures import Executor
from math import ceil, sqrt
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import FloatArray
from ..visibility import Occluders, panes_of, sky_occluders
from .area_lamps import AreaLamp
from .kinds import Lamp
from .round_lamps import Cone, PointLamp, SunLamp
from .sky import SkyLamp
from .soft_shadows import Horizons, visible_share

if TYPE_CHECKING:
    from ..scene import Scene
    from ..settings import Settings

__all__ = ["AreaLamp", "Cone", "Lamp", "PointLamp", "SkyLamp", "SunLamp"]
__all__ += ["direct_light", "lamp_irradiance", "scene_reach"]

# A sky is as large as the world: it takes more cells along each side than a lamp, and more rays where openings end.
_SKY_CELLS = 3
_FINER, _SKY_FINER = 3, 4
# Where receivers lie close together, each needs fewer: nobody looks at one by itself.
_FINER_AMONG_MANY = 2
# Where much of the sky is seen, and in a rough look, errors are small beside what there is.
_SKY_WELL, _SKY_ROUGH = 2, 1
# Rays for each lamp and receiver in the first look, by the quality of a bake.
_RAYS = {"preview": 4, "medium": 9, "high": 25, "production": 49}


def lamp_irradiance(
    lamps: Sequence[Lamp],
    points: FloatArray,
    normals: FloatArray,
    occluders: Occluders,
    *,
    rays: int,
    reach: float,
    rough: bool = False,
    dense: bool = False,
    shadowed: bool = True,
    horizons: Horizons | None = None,
    workers: Executor | None = None,
) -> FloatArray:
    """Return the light that lamps and sky send straight to receivers.

    Parameters
    ----------
    lamps : sequence of Lamp
    points, normals : ndarray of shape (n, 3)
        Receivers [m] and their unit normals.
    occluders : Occluders
        What blocks.
    rays : int
        For each lamp and receiver in the first look; where a lamp is seen in part it is up to nine times as many. The
        sky takes nine times, and up to sixteen times that round the edges of openings.
    reach : float
        Longest way that anything can be met on [m], see `scene_reach`.
    rough : bool
        Whether the light is only to be passed on: the errors of many receivers cancel.
    dense : bool
        Whether receivers lie much closer together than light changes.
    shadowed : bool
        Whether anything is in the way.
    horizons : Horizons, optional
        Of the faces round receivers: what they hide of the sky. Lamps are looked for: nothing hides them from a vertex.
    workers : concurrent.futures.Executor, optional
        Who computes; the result does not depend on it, bit for bit.

    Returns
    -------
    ndarray of shape (n, 3)
        Irradiance H [W/m^2].
    """
    H = np.zeros((len(points), 3))
    for lamp in lamps:
        light = lamp.unshadowed(points, normals)
        lit = np.flatnonzero(light.any(axis=1))
        if shadowed and lamp.shadows and len(lit):
            side, blockers = max(1, ceil(sqrt(rays))), occluders
            finer = well = _FINER_AMONG_MANY if dense else _FINER
            if isinstance(lamp, SkyLamp):
                side, blockers = _SKY_CELLS * side, sky_occluders(occluders)
                finer, well = (_SKY_WELL, _SKY_ROUGH) if rough else (_SKY_FINER, _SKY_WELL)
            share = visible_share(
                lamp,
                points[lit],
                normals[lit],
                blockers,
                side=side,
                finer=finer,
                reach=reach,
                well=well,
                panes=panes_of(blockers),
                horizons=horizons.pick(lit) if horizons and isinstance(lamp, SkyLamp) else None,
                workers=workers,
            )
            H[lit] += light[lit] * share
        else:
            H += light
    return H


def direct_light(
    scene: "Scene",
    points: FloatArray,
    normals: FloatArray,
    settings: "Settings",
    occluders: Occluders,
    *,
    lamps: Sequence[Lamp] | None = None,
    rough: bool = False,
    dense: bool = False,
    shadowed: bool = True,
    horizons: Horizons | None = None,
    workers: Executor | None = None,
) -> FloatArray:
    """Return the light that a scene's lamps send straight to receivers in it, as finely as the settings ask for.

    Parameters
    ----------
    scene : Scene
    points, normals : ndarray of shape (n, 3)
        Receivers [m] and their unit normals.
    settings : Settings
        Give the quality.
    occluders : Occluders
        What blocks.
    lamps : sequence of Lamp, optional
        Some of the scene's; all when not given.
    rough, dense, shadowed, horizons, workers
        See `lamp_irradiance`.

    Returns
    -------
    ndarray of shape (n, 3)
        Irradiance H [W/m^2].
    """
    rays, reach = _RAYS[settings.quality], scene_reach(scene)
    return lamp_irradiance(
        scene.lamps if lamps is None else lamps,
        points,
        normals,
        occluders,
        rays=rays,
        reach=reach,
        rough=rough,
        dense=dense,
        shadowed=shadowed,
        horizons=horizons,
        workers=workers,
    )


def scene_reach(scene: "Scene") -> float:
    """Return a way that leaves a scene from everywhere in it, the diagonal of its bounding box and some more [m]."""
    return 1.01 * scene.extent or 1.0
