# SPDX-License-Identifier: GPL-3.0-or-later
"""Form factors between whole polygons, to a tolerance and with partial visibility (T3).

A view factor, as heat transfer calls it, is the mean of the point's form factor over a polygon. Polygons are split into
convex parts; pairs with nothing between them are integrated along their contours, the others over the parts of them
that see each other. Half of the matrix is computed, the other half follows from reciprocity A_i F_ij = A_j F_ji.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import FloatArray
from ..errors import RadiosityError
from .convex_parts import ConvexPart, area_vector, checked_polygons, convex_parts
from .part_views import contact_areas, views
from .visible_exchange import visible_exchange_areas

# The sum of the cubature's disagreements is not a bound of its error: this share of the tolerance is aimed at.
AIM = 0.4
# Row sums of a set of polygons that is meant to be closed may be this far from 1.
OPEN = 0.1
# What the errors of a whole row may add up to.
NOISE = 1e-3
# Row sums are enforced to this.
CLOSED = 1e-12
MOST_SWEEPS = 10_000


def form_factor_matrix(polygons: Sequence[ArrayLike], *, tolerance: float = 1e-4, closed: bool = False) -> FloatArray:
    """Return the form factors between polygons that also block each other.

    Parameters
    ----------
    polygons : sequence of array_like of shape (k, 3)
        n planar polygons [m], convex or concave, counter-clockwise seen from their radiating side. They radiate and
        receive on that side only and block light from both.
    tolerance : float
        Largest error of any form factor.
    closed : bool
        The polygons enclose a space: scale the factors so that every row sums to 1 and reciprocity is kept.

    Returns
    -------
    ndarray of shape (n, n)
        F[i, j] is the fraction of the light leaving polygon i that reaches polygon j.

    Raises
    ------
    RadiosityError
        If a polygon has fewer than 3 corners, no area, a coordinate that is not finite, or is not planar; if the
        polygons should be closed and are not; if the tolerance is out of reach.
    """
    if not 0 < tolerance < 1:
        raise RadiosityError(f"The tolerance is {tolerance:g}; it must be between 0 and 1.")
    outlines = checked_polygons(polygons)
    areas = np.array([np.linalg.norm(area_vector(outline)) for outline in outlines])
    parts = [part for index, outline in enumerate(outlines) for part in convex_parts(index, outline)]
    exchange = _exchange(parts, areas, tolerance)
    if closed:
        exchange = _closed(_with_contacts(exchange, contact_areas(parts, len(areas)), areas), areas)
    return np.asarray(exchange / areas[:, None])


def _exchange(parts: list[ConvexPart], areas: FloatArray, tolerance: float) -> FloatArray:
    """Return the symmetric matrix of A_i F_ij [m^2]."""
    exchange = np.zeros((len(areas), len(areas)))
    seen = list(views(parts)) if parts else []
    if not seen:
        return exchange
    i, j = np.array([view.polygons for view in seen]).T
    # The smaller polygon's factor is the one that is wrong first; views of parts of the same polygons share its error.
    sharing = np.zeros(exchange.shape, dtype=np.int64)
    np.add.at(sharing, (i, j), [len(view.blockers) > 0 for view in seen])
    allowed = AIM * tolerance * np.minimum(areas[i], areas[j]) / np.maximum(sharing[i, j], 1)
    np.add.at(exchange, (i, j), visible_exchange_areas(seen, allowed))
    return exchange + exchange.T


def _with_contacts(exchange: FloatArray, contacts: FloatArray, areas: FloatArray) -> FloatArray:
    """Return the exchange areas with those of polygons that lie on each other, face to face.

    Polygons of opposite normals in one plane may just as well be back to back, two sides of a sheet. In a closed set
    the light that is missing tells: what rests on a floor has nothing but the floor to exchange light with.
    """
    missing = areas - exchange.sum(axis=1) + NOISE * areas
    return exchange + np.where(contacts <= np.minimum(missing, missing[:, None]), contacts, 0)


def _closed(exchange: FloatArray, areas: FloatArray) -> FloatArray:
    """Return the exchange areas scaled, row and column alike, until every row sums to its polygon's area.

    R. Sinkhorn, P. Knopp, Concerning nonnegative matrices and doubly stochastic matrices, Pacific Journal of
    Mathematics 21, 1967; damped so that the matrix stays symmetric.
    """
    sums = exchange.sum(axis=1) / areas
    worst = int(np.argmax(np.abs(sums - 1)))
    if abs(sums[worst] - 1) > OPEN:
        raise RadiosityError(
            f"The polygons do not enclose a space: the form factors of polygon {worst} sum to {sums[worst]:.3f}. "
            "Check that none is missing or turned inside out, or do without closed."
        )
    scale = np.ones(len(areas))
    for _ in range(MOST_SWEEPS):
        sums = scale * (exchange @ scale) / areas
        if np.abs(sums - 1).max() < CLOSED:
            return exchange * np.outer(scale, scale)
        scale /= np.sqrt(sums)
    raise RadiosityError(
        "Row sums of 1 and reciprocity contradict each other for these polygons: they do not enclose a space. "
        "Check that none is missing, or do without closed."
    )
