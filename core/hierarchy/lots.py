# SPDX-License-Identifier: GPL-3.0-or-later
"""Lots: of many links that carry next to nothing each, a few carry what all of them do.

Where there is much to see, such as in a furnished house, a receiver has a thousand links that it could do without one
by one, but not all together. Each stays by the chance that it carries something, and those that stay make up for the
others: on the mean nothing is lost (Russian roulette: Arvo, Kirk 1990).
"""

import numpy as np

from ..sequences import GOLDEN, PLASTIC
from .kernels import Single
from .tree import Int

# Multiples that spread the lots of receivers and nodes evenly.
_RECEIVER, _NODE = PLASTIC[0], GOLDEN


def draw_lots(chance: Single, receiver: Int, node: Int) -> Single:
    """Return what pairs count for: nothing, once, or for others that count for nothing.

    Parameters
    ----------
    chance : ndarray of shape (k,)
        That each pair stays; one or more is sure to.
    receiver, node : ndarray of shape (k,)
        Lots of pairs differ, and are the same every time.

    Returns
    -------
    ndarray of shape (k,)
        One on the mean.
    """
    count = np.ones(len(chance), np.float32)
    drawn = np.flatnonzero(chance < 1)
    lot = receiver[drawn] * _RECEIVER + node[drawn] * _NODE
    stays = lot - np.floor(lot) < chance[drawn]
    count[drawn] = np.where(stays, 1 / np.where(stays, chance[drawn], 1), 0)
    return count
