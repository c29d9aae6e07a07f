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
        self._weight = weight
        self._last: tuple[FloatArray, FloatArray] | None = None
        self._further: deque[FloatArray] = deque(maxlen=_DEPTH)
        self._missing: deque[FloatArray] = deque(maxlen=_DEPTH)

    def next(self, before: FloatArray, swept: FloatArray) -> FloatArray:
        """Return what to begin the next sweep with, each channel for itself.

        Parameters
        ----------
        before, swept : ndarray of shape (n, 3)
            What the last sweep began with and what it made of that [W/m^2].

        Returns
        -------
        ndarray of shape (n, 3)
        """
        change = (swept - before).T
        last, self._last = self._last, (swept.T, change)
        if last is None:
            return swept
        self._further.append(swept.T - last[0])
        self._missing.append(change - last[1])
        # Channel by channel, sweep by sweep, patch by patch.
        further, missing = np.stack(self._further, axis=1), np.stack(self._missing, axis=1)
        weighted = (self._weight * missing).swapaxes(1, 2)
        least = np.linalg.pinv(missing @ weighted, rcond=_RANK, hermitian=True)
        share = change[:, None] @ weighted @ least
        mixed: FloatArray = swept - (share @ further)[:, 0].T
        return mixed
