# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners that do not see the sample that looks for them: light runs on to them from their neighbours on the mesh.

Where sheets lie above each other, as in upholstery, a sample within says nothing of the outside. But most corners round
it see theirs, and along a smooth stretch light changes slowly: between those it is spread as evenly as it can be.
"""

import numpy as np
from numpy.typing import NDArray

from .tree import Float, Int

# Rounds of spreading. One goes an edge further; these make a stretch of some ten edges even.
_ROUNDS = 60


def along_mesh(
    light: Float, stranger: NDArray[np.bool_], dark: NDArray[np.bool_], edges: tuple[Int, Int]
) -> tuple[Float, NDArray[np.bool_]]:
    """Spread what arrives at corners to those among them that nothing is known of.

    Parameters
    ----------
    light : ndarray of shape (q, k)
    stranger : ndarray of shape (q,)
        Corners that are to learn.
    dark : ndarray of shape (q,)
        Corners that nobody is to learn from.
    edges : tuple of two ndarrays of shape (e,)
        Who is a neighbour of whom.

    Returns
    -------
    light : ndarray of shape (q, k)
        That of strangers without any neighbours that know better is what it was.
    learned : ndarray of shape (q,)
        Who has other light now.
    """
    known, spread = ~(stranger | dark), light.copy()
    # Each edge twice: to a stranger, from whoever is at its other end.
    to, source = (np.concatenate(ends) for ends in (edges, edges[::-1]))
    to, source = to[stranger[to]], source[stranger[to]]
    learner, at = np.unique(to, return_inverse=True)
    at = at.reshape(-1)
    for _ in range(_ROUNDS):
        weight = known[source].astype(float)
        total = np.bincount(at, weight, len(learner))
        some = total > 0
        for column in spread.T:
            column[learner[some]] = np.bincount(at, weight * column[source], len(learner))[some] / total[some]
        known[learner[some]] = True
    return spread, known & stranger
