# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands on pieces of patches or hangs over them, and ends within them."""

import numpy as np
from numpy.typing import NDArray

from ..visibility import Occluders
from .pieces import centres, flat_measures, quarters
from .tree import Float

# How high above a piece what stands on it is looked for, as a share of its size.
_LIFT = 0.02
# How high and from where what hangs over it is looked for, as shares of its size and of the way from the corners.
_HEIGHT, _INWARDS = 2.0, 0.1
# What hangs no higher than this leaves little light of what is under it to be seen from elsewhere.
_LOW = 0.4


def stood_on(corners: Float, occluders: Occluders) -> NDArray[np.bool_]:
    """Return on which elements something stands between the middle and a quarter's middle, shape (n,)."""
    middle = centres(corners)
    around = centres(quarters(corners))
    normal, area = flat_measures(corners)
    lift = _LIFT * np.sqrt(area)[:, None] * normal
    between = occluders.blocked(np.repeat(middle + lift, 4, axis=0), around + np.repeat(lift, 4, axis=0))
    stood: NDArray[np.bool_] = between.reshape(-1, 4).any(axis=1)
    return stood


def hung_over(corners: Float, occluders: Occluders, height: float = _HEIGHT) -> NDArray[np.bool_]:
    """Return over which elements something hangs that ends within them, and not high, shape (n,)."""
    around = (corners + _INWARDS * (centres(corners)[:, None] - corners)).reshape(-1, 3)
    normal, area = flat_measures(corners)
    up = np.repeat(np.sqrt(area)[:, None] * normal, 4, axis=0)
    under = occluders.blocked(around + _LIFT * up, around + height * up).reshape(-1, 4)
    hung: NDArray[np.bool_] = under.any(axis=1) & ~under.all(axis=1)
    return hung


def shown_middles(corners: Float, occluders: Occluders) -> Float:
    """Return where pieces are asked for their light, shape (n, 3) [m]: in the middle of what shows of them.

    Of a ceiling that ends behind a lamp close to it, the room sees what is beside the lamp.
    """
    middle = centres(corners)
    normal, area = flat_measures(corners)
    part = np.flatnonzero(hung_over(corners, occluders, _LOW))
    if not len(part):
        return middle
    around = centres(quarters(quarters(corners[part]))).reshape(len(part), -1, 3)
    up = np.broadcast_to((np.sqrt(area)[:, None] * normal)[part, None], around.shape).reshape(-1, 3)
    spot = around.reshape(-1, 3)
    free = ~occluders.blocked(spot + _LIFT * up, spot + _LOW * up).reshape(around.shape[:2])
    count = free.sum(axis=1)
    shows = (around * free[:, :, None]).sum(axis=1) / np.maximum(count, 1)[:, None]
    # Not in a hole of what shows, such as under the foot that it lies round.
    apart = np.where(free, ((around - shows[:, None]) ** 2).sum(axis=2), np.inf)
    some = (count > 0) & (count < around.shape[1])
    middle[part[some]] = around[np.arange(len(part)), apart.argmin(axis=1)][some]
    return middle
