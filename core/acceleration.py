# SPDX-License-Identifier: GPL-3.0-or-later
"""Fewer sweeps to the same light: each begins with the mixture of the last ones that lacks least (Anderson's).

What a sweep changes tells how far its light is from a solution. Where light bounces often, one sweep's change is much
like the one before, a little smaller; so a few of them foretell what all further ones would add.

References
----------
D. G. Anderson, Iterative procedures for nonlinear integral equations, Journal of the ACM 12 (4), 1965.
H. F. Walker, P. Ni, Anderson acceleration for fixed-point iterations, SIAM J. Numer. Anal. 49 (4), 2011.
"""

from collections import deque

import numpy as np

from .arrays import FloatArray

# Sweeps that are mixed.
_DEPTH = 5
# Patches that tell how, about, where there are more.
_TELLING = 20_000
# What is left out of the small systems, as a share of their largest value: sweeps that tell nothing new.
_RANK = 1e-12


class Mixture:
    """The last sweeps of a solver, to begin the next with.

    Parameters
    ----------
    weight : ndarray of shape (n,)
        How much each patch counts: its area [m^2].
    """

    def __init__(self, weight: FloatArray) -> None:
        self._some = slice(None, None, max(1, len(weight) // _TELLING))
        self._weight = weight[self._some]
        self._swept: deque[FloatArray] = deque(maxlen=_DEPTH + 1)
        self._change: deque[FloatArray] = deque(maxlen=_DEPTH + 1)

    def next(self, before: FloatArray, swept: FloatArray) -> FloatArray:
        """Return what to begin the next sweep with, each channel for itself.

        Parameters
        ----------
        before, swept : ndarray of shape (n, 3)
            What the last sweep began with and what it made of that, which is kept [W/m^2].

        Returns
        -------
        ndarray of shape (n, 3)
        """
        self._swept.append(swept)
        self._change.append((swept[self._some] - before[self._some]).T)
        if len(self._swept) == 1:
            return swept
        # Channel by channel, sweep by sweep, patch by patch.
        change = np.stack(self._change, axis=1)
        missing = np.diff(change, axis=1)
        weighted = (self._weight * missing).swapaxes(1, 2)
        least = np.linalg.pinv(missing @ weighted, rcond=_RANK, hermitian=True)
        share = (change[:, -1:] @ weighted @ least)[:, 0].T
        # Steps from sweep to sweep, taken back, leave so much of each sweep.
        parts = np.diff(np.concatenate((np.zeros((1, share.shape[1])), share, np.ones((1, share.shape[1])))), axis=0)
        return sum((part * sweep for part, sweep in zip(parts, self._swept, strict=True)), np.zeros_like(swept))
