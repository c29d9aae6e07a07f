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
        self._weight = weight[:, None]
        self._swept: deque[FloatArray] = deque(maxlen=_DEPTH + 1)
        self._change: deque[FloatArray] = deque(maxlen=_DEPTH + 1)

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
        self._swept.append(swept)
        self._change.append(swept - before)
        if len(self._change) < 2:
            return swept
        missing = np.diff(np.stack(self._change), axis=0)
        weighted = self._weight * missing
        products = np.einsum("inc,jnc->cij", weighted, missing)
        least = np.linalg.pinv(products, rcond=_RANK, hermitian=True)
        share = np.einsum("cij,cj->ic", least, np.einsum("inc,nc->ci", weighted, self._change[-1]))
        further = np.diff(np.stack(self._swept), axis=0)
        mixed: FloatArray = swept - np.einsum("ic,inc->nc", share, further)
        return mixed
