# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches that a part of the light goes through straight on, as screens: holes, and between them all that scatters.

What such a patch reflects is what its solid part does, and as much of the view as that part fills it takes up; the rest
is filled by what is seen through it. So what is around still adds up to one, and what is sent to what arrives.
"""

from dataclasses import replace

import numpy as np

from .arrays import FloatArray
from .meshing import Patches
from .scene import REFLECTANCE_LIMIT

# No screen is less solid.
_LEAST = 0.01


def screens(patches: Patches, solid: FloatArray) -> Patches:
    """Return patches with the area, the reflectance and the transmittance of what is solid of them.

    Parameters
    ----------
    patches : Patches
    solid : ndarray of shape (f,)
        Share of each face that is solid; more where it scatters more.

    Returns
    -------
    Patches
        Whatever emits is left as it is.
    """
    scattered = (patches.reflectance + patches.transmittance).max(axis=1, initial=0.0) / REFLECTANCE_LIMIT
    share = np.clip(np.maximum(solid[patches.face], scattered), _LEAST, 1.0)
    share[patches.emission.any(axis=1)] = 1.0
    return replace(
        patches,
        area=share * patches.area,
        reflectance=patches.reflectance / share[:, None],
        transmittance=patches.transmittance / share[:, None],
        solid=share,
    )
