# SPDX-License-Identifier: GPL-3.0-or-later
"""What elements show to the corners around them: of those that something stands on, what is left beside it.

An element whose middle is under something else may still reach out from below: what shows of it is lit as the rest of
its patch is, or as the patches beside that are.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..meshing import Patches
from ..translucence import scattered
from .elements import Elements
from .probes import groups_shut_in, points_facing_dark
from .receivers import GROUP_SIZE
from .solve import Lit
from .tree import Float, Int

# Share of its surroundings that an element in a closed room has to see for not being hidden itself.
_EXPOSED = 0.3
# Elements with less than this share of the light that is common may be inside of something.
_DIM = 0.2
# Faces that see less than the one look out of the scene, as the bottom of what stands on a single sheet: corners that
# they share with faces that see more than the other look from those.
_NOTHING, _SOMETHING = 0.03, 0.1


@dataclass(frozen=True, eq=False)
class Shown:
    """Light that n elements show.

    Attributes
    ----------
    exposed : ndarray of shape (n,)
        Which see enough of what is around them, or a way out; the others are under something or inside of it.
    radiosity, irradiance : ndarray of shape (n, 3)
        [W/m^2].
    first : ndarray of shape (n, 3)
        The part of the irradiance that comes straight from what emits, and from lamps [W/m^2].
    sees : ndarray of shape (n,)
        Share of the view that surfaces fill.
    """

    exposed: NDArray[np.bool_]
    radiosity: Float
    irradiance: Float
    first: Float
    sees: Float


def shown_light(lit: Lit, patches: Patches, group: Int) -> Shown:
    """Tell what elements show.

    Parameters
    ----------
    lit : Lit
        What was solved.
    patches : Patches
    group : ndarray of shape (c,)
        Smooth group of each mesh corner: what is beside what.

    Returns
    -------
    Shown
    """
    elements, solution = lit.elements, lit.solution
    looking_out = _looking_out(lit)
    exposed = looking_out & ~_inside(lit, looking_out)
    straight = solution.irradiance if solution.direct is None else solution.direct
    H, first = (
        _exposed_irradiance(elements, patches, group, irradiance, exposed)
        for irradiance in (solution.irradiance, straight)
    )
    # What is inside of something lights what is in there with it, as dark as it is.
    sent = np.where((looking_out & ~exposed)[:, None], solution.irradiance, H)
    radiosity = elements.emission + scattered(elements.reflectance, sent, lit.through)
    return Shown(exposed, radiosity, H, first, lit.transport.row_sums())


def exposed_corners(shown: Shown, elements: Elements, patches: Patches, group: Int) -> Float:
    """Return which share shows of the patches at each mesh corner, shape (c,).

    Parameters
    ----------
    shown : Shown
    elements : Elements
    patches : Patches
    group : ndarray of shape (c,)
        Smooth group of each.
    """
    count = len(patches.area)
    whole = np.maximum(np.bincount(elements.patch, elements.area, count), 1e-300)
    touching = np.maximum(np.bincount(patches.touch_corner, minlength=len(group)), 1)

    def at_corners(values: Float) -> Float:
        of_patch = np.bincount(elements.patch, elements.area * values, count) / whole
        return np.bincount(patches.touch_corner, of_patch[patches.touch_patch], len(group)) / touching

    sees = at_corners(shown.sees)
    most = np.zeros(int(np.max(group, initial=-1)) + 1)
    np.maximum.at(most, group, sees)
    looks_away = (sees < _NOTHING) & (most[group] > _SOMETHING)
    return np.where(looks_away, 0.0, at_corners(shown.exposed.astype(float)))


def _looking_out(lit: Lit) -> NDArray[np.bool_]:
    """Return which elements see enough of what is around them, or a way out, shape (n,)."""
    sums, elements = lit.transport.row_sums(), lit.elements
    exposed: NDArray[np.bool_] = sums > _EXPOSED
    unsure = np.flatnonzero(~exposed)
    # Those that have their light from one sample look out together, a few at a time.
    cluster = lit.transport.samples.cluster[unsure]
    order = np.argsort(cluster, kind="stable")
    unsure, cluster = unsure[order], cluster[order]
    begin = np.searchsorted(cluster, cluster)
    first = np.append(np.flatnonzero((np.arange(len(unsure)) - begin) % GROUP_SIZE == 0), len(unsure))
    point, normal = elements.centre[unsure], elements.normal[unsure]
    exposed[unsure] = ~groups_shut_in(point, normal, first, elements.corners, lit.scenery.occluders)
    return exposed


def _inside(lit: Lit, looking_out: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which elements are inside of something, and see what of others is in there with them, shape (n,)."""
    elements, H, A = lit.elements, lit.solution.irradiance.mean(axis=1), lit.elements.area
    dim = np.flatnonzero(looking_out & (H < _DIM * float((A * H).sum() / max(float(A.sum()), 1e-300))))
    inside = np.zeros(len(elements), dtype=np.bool_)
    inside[dim] = points_facing_dark(elements.centre[dim], elements.normal[dim], lit.sides, lit.scenery.occluders)
    return inside


def _exposed_irradiance(
    elements: Elements, patches: Patches, group: Int, irradiance: Float, exposed: NDArray[np.bool_]
) -> Float:
    """Give what is hidden of each patch the light of the rest of it, or of what is beside, shape (n, 3) [W/m^2]."""
    H = irradiance
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
