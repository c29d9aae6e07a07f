# SPDX-License-Identifier: GPL-3.0-or-later
"""Exchange between polygons that see each other in part: adaptive cubature over the receiver.

The hidden part of the form factor is known exactly at every point (`hidden_sources`). As a function of the point it is
continuous except where a blocker touches the receiver, and bends along the borders of shadows. So the receiver is cut
along the lines of contact into triangles, and those are halved where two rules of different degree disagree, worst
first, until the sum of all disagreements is below the tolerance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..errors import RadiosityError
from .contour_integral import exchange_areas
from .convex_parts import area_vector
from .hidden_sources import Sights, sights, whole_and_hidden
from .part_views import View
from .receiver_cells import halved, receiver_cells, triangle_areas

# Share of a triangle's error that each of its halves may still have.
INHERITED = 0.25
# Halvings of one view's triangles after which the tolerance is given up.
MOST_ROUNDS = 60


def _radon_rule() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return nodes (7, 3) in barycentric coordinates and weights of degree 5, and weights of degree 2 on four of them.

    J. Radon, Zur mechanischen Kubatur, Monatshefte fuer Mathematik 52, 1948.
    """
    nodes, weights = [(1 / 3, 1 / 3, 1 / 3)], [9 / 40]
    for sign in (-1, 1):
        a = (6 + sign * 15**0.5) / 21
        nodes += [(1 - 2 * a, a, a), (a, 1 - 2 * a, a), (a, a, 1 - 2 * a)]
        weights += 3 * [(155 + sign * 15**0.5) / 1200]
    # The mean of a squared coordinate over a triangle is 1/6; the points of the first ring and the centre have it.
    ring = sum(c * c for c in nodes[1])
    share = (1 / 6 - 1 / 9) / (ring - 1 / 3)
    return np.array(nodes), np.array(weights), np.array([1 - 3 * share, share, share, share, 0, 0, 0])


NODES, WEIGHTS, COARSE_WEIGHTS = _radon_rule()


def visible_exchange_areas(views: Sequence[View], tolerances: FloatArray) -> FloatArray:
    """Return A_i F_ij = A_j F_ji of views with regard to their blockers.

    Parameters
    ----------
    views : sequence of View
        Pairs of convex polygons.
    tolerances : ndarray of shape (len(views),)
        Allowed errors of the exchange areas [m^2].

    Returns
    -------
    ndarray of shape (len(views),)
        Exchange areas [m^2].

    Raises
    ------
    RadiosityError
        If a tolerance would take too many subdivisions.
    """
    whole = exchange_areas([view.first for view in views], [view.second for view in views])
    obstructed = np.flatnonzero([bool(view.blockers) for view in views])
    if len(obstructed):
        turned = [_from_better_side(view) for view in views if view.blockers]
        whole[obstructed] = _integrated(turned, whole[obstructed], tolerances[obstructed])
    return whole


def _from_better_side(view: View) -> View:
    """Return a view whose first polygon, to be integrated over, is the one further from the blockers for its size.

    Shadows are the softer, the further the blocker is from where they fall.
    """
    corners = np.concatenate(view.blockers)
    first, second = (
        np.mean((corners - polygon[0]) @ normal) / np.sqrt(np.linalg.norm(area_vector(polygon)))
        for polygon, normal in zip((view.first, view.second), view.normals, strict=True)
    )
    if first < second:
        return replace(view, first=view.second, second=view.first, normals=view.normals[::-1])
    return view


@dataclass(frozen=True, eq=False)
class _Cells:
    """Triangles on receivers.

    Attributes
    ----------
    view : ndarray of shape (c,)
    corners : ndarray of shape (c, 3, 3)
        World space [m].
    sums : ndarray of shape (c, 2)
        Integrals of the hidden and of the visible factor [m^2].
    errors : ndarray of shape (c, 2)
        What they may be off by [m^2].
    """

    view: IntArray
    corners: FloatArray
    sums: FloatArray
    errors: FloatArray

    def of(self, rows: BoolArray) -> "_Cells":
        """Return some of the triangles."""
        return _Cells(self.view[rows], self.corners[rows], self.sums[rows], self.errors[rows])


def _integrated(views: Sequence[View], whole: FloatArray, tolerances: FloatArray) -> FloatArray:
    """Return the exchange areas of obstructed views, given what they would be without blockers."""
    table = sights(views)
    triangles = [receiver_cells(view, tolerance) for view, tolerance in zip(views, tolerances, strict=True)]
    owner = np.repeat(np.arange(len(views)), [len(t) for t in triangles])
    cells = _halves(_evaluated(owner, np.concatenate(triangles), table), table)
    # What is smaller is integrated, the hidden or the visible part: the whole is known.
    totals = _totals(cells, len(views))
    smaller = (totals[:, 1] < totals[:, 0]).astype(np.int64)
    for _ in range(MOST_ROUNDS):
        split = _worst(cells.view, cells.errors[np.arange(len(cells.view)), smaller[cells.view]], tolerances)
        if not split.any():
            totals = _totals(cells, len(views))
            return np.clip(np.where(smaller == 0, whole - totals[:, 0], totals[:, 1]), 0, whole)
        cells = _together(cells.of(~split), _halves(cells.of(split), table))
    raise RadiosityError("The form factors do not reach the tolerance; allow a larger one.")


def _evaluated(view: IntArray, corners: FloatArray, table: Sights) -> _Cells:
    """Return triangles with their integrals."""
    points = np.einsum("qk,ckx->cqx", NODES, corners).reshape(-1, 3)
    whole, hidden = whole_and_hidden(points, np.repeat(view, len(NODES)), table)
    factors = np.stack((hidden, whole - hidden), axis=1).reshape(len(view), len(NODES), 2)
    areas = triangle_areas(corners)[:, None]
    sums = np.einsum("q,cqk->ck", WEIGHTS, factors) * areas
    return _Cells(view, corners, sums, np.abs(np.einsum("q,cqk->ck", COARSE_WEIGHTS, factors) * areas - sums))


def _halves(cells: _Cells, table: Sights) -> _Cells:
    """Return cells cut in halves.

    Two rules may agree by accident where the factor bends; then whole and halves, also, hardly agree.
    """
    halves = _evaluated(np.tile(cells.view, 2), halved(cells.corners), table)
    first, second = np.split(halves.sums, 2)
    change = INHERITED * np.abs(cells.sums - first - second)
    return replace(halves, errors=np.maximum(halves.errors, np.tile(change, (2, 1))))


def _worst(view: IntArray, errors: FloatArray, tolerances: FloatArray) -> BoolArray:
    """Return the fewest triangles without which each view's errors add up to less than half its tolerance.

    Views whose errors already add up to less than the tolerance are left alone.
    """
    order = np.lexsort((errors, view))
    running = np.cumsum(errors[order])
    totals = np.bincount(view, errors, minlength=len(tolerances))
    before = np.concatenate(([0.0], np.cumsum(totals)[:-1]))
    worst = np.zeros(len(view), dtype=bool)
    worst[order] = running - before[view[order]] > tolerances[view[order]] / 2
    return worst & (totals > tolerances)[view]


def _totals(cells: _Cells, n_views: int) -> FloatArray:
    """Return the sums over each view's triangles, shape (n_views, 2)."""
    return np.stack([np.bincount(cells.view, cells.sums[:, k], minlength=n_views) for k in (0, 1)], axis=1)


def _together(first: _Cells, second: _Cells) -> _Cells:
    """Return all triangles of both."""
    return _Cells(
        np.concatenate((first.view, second.view)),
        np.concatenate((first.corners, second.corners)),
        np.concatenate((first.sums, second.sums)),
        np.concatenate((first.errors, second.errors)),
    )
