# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a polygon is hidden from points by convex blockers, exactly.

Seen from a point, a convex blocker hides what lies in a cone: the half-spaces of the planes through the point and the
blocker's edges. In the source polygon's own plane these are half-planes, so the hidden part is a convex polygon, cut
out by clipping; what remains of the source falls into convex pieces for the next blocker to cut. The form factor of
each hidden piece is Lambert's sum. Very many points are worked on at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray, IntArray
from .convex_parts import plane_axes, unit_normal
from .part_views import View
from .piece_clipping import Pieces, boxed, cut, together

# Blockers' edges, over all points, that are worked on at a time.
CHUNK = 200_000
# Distance that counts as none when clipping, relative to the view's margin.
CLIP = 1e-3
# Blockers this much lower than the point, relative to its height, have bounded shadows.
LEVEL = 1e-6
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Sights:
    """s sources and their b blockers as arrays, in frames whose third axis is the source's normal.

    Attributes
    ----------
    origin, axes : ndarray of shape (s, 3), (s, 3, 3)
        The frames, axes in rows.
    corners : ndarray of shape (v, s, 3)
        The sources, their last corners repeated [m].
    size : ndarray of shape (s,)
        Their numbers of corners.
    normal : ndarray of shape (s, 3)
        Unit normals of the receivers.
    blocker : ndarray of shape (s + 1,)
        First row of each source's blockers in the arrays of these.
    blocker_corners : ndarray of shape (w, b, 3)
        Blockers, their last corners repeated [m].
    blocker_normal : ndarray of shape (b, 3)
        On the side from which the corners run counter-clockwise.
    clearance : ndarray of shape (s,)
        Distance that counts as none [m].
    """

    origin: FloatArray
    axes: FloatArray
    corners: FloatArray
    size: IntArray
    normal: FloatArray
    blocker: IntArray
    blocker_corners: FloatArray
    blocker_normal: FloatArray
    clearance: FloatArray


def sights(views: Sequence[View]) -> Sights:
    """Return views, seen from their first polygons to their second ones, as arrays."""
    axes = np.stack([np.vstack((plane_axes(view.normals[1]), view.normals[1])) for view in views])
    origin = np.stack([view.second[0] for view in views])
    framed = list(zip(views, origin, axes, strict=True))
    # Large ones first: they leave the least to be cut by others.
    blockers = [(b - o) @ a.T for view, o, a in framed for b in sorted(view.blockers, key=_extent, reverse=True)]
    return Sights(
        origin=origin,
        axes=axes,
        corners=_padded([(view.second - o) @ a.T for view, o, a in framed]),
        size=np.array([len(view.second) for view in views]),
        normal=np.stack([a @ view.normals[0] for view, _, a in framed]),
        blocker=np.concatenate([[0], np.cumsum([len(view.blockers) for view in views])]),
        blocker_corners=_padded(blockers),
        blocker_normal=np.stack([unit_normal(blocker) for blocker in blockers]),
        clearance=CLIP * np.array([view.margin for view in views]),
    )


def _extent(corners: FloatArray) -> float:
    return float(np.linalg.norm(np.ptp(corners, axis=0)))


def _padded(polygons: Sequence[FloatArray]) -> FloatArray:
    """Return polygons as one array of shape (v, n, 3), their last corners repeated."""
    most = max(len(polygon) for polygon in polygons)
    return np.stack([polygon[np.minimum(np.arange(most), len(polygon) - 1)] for polygon in polygons], axis=1)


def whole_and_hidden(points: FloatArray, view: IntArray, table: Sights) -> tuple[FloatArray, FloatArray]:
    """Return the form factors from points to their sources, and to the parts of these that blockers hide.

    Parameters
    ----------
    points : ndarray of shape (m, 3)
        Points on the receivers, in front of sources and blockers [m].
    view : ndarray of shape (m,)
        Row of `table` for each point.
    table : Sights

    Returns
    -------
    whole, hidden : ndarray of shape (m,)
        Dimensionless; the visible factor is their difference.
    """
    whole, hidden = np.zeros(len(points)), np.zeros(len(points))
    edges = np.cumsum(np.diff(table.blocker)[view]) * len(table.blocker_corners)
    # As many points at a time as have so many edges to look past.
    for rows in np.split(np.arange(len(points)), np.searchsorted(edges, np.arange(CHUNK, edges[-1], CHUNK))):
        if len(rows):
            x = np.einsum("mx,max->am", points[rows] - table.origin[view[rows]], table.axes[view[rows]])
            corners = table.corners[:, view[rows]]
            sources = boxed(np.arange(len(rows)), table.size[view[rows]], corners[:, :, 0], corners[:, :, 1])
            whole[rows] = _piece_factors(x, view[rows], sources, table)
            hidden[rows] = _hidden_factors(x, view[rows], sources, table)
    return whole, hidden


def _hidden_factors(x: FloatArray, view: IntArray, pieces: Pieces, table: Sights) -> FloatArray:
    """Return the factors of what is hidden from points x, shape (3, m); the pieces are the whole sources."""
    hidden = np.zeros(len(view))
    point, planes, box = _cones(x, view, pieces.box, table)
    # Rows of each point in the table of cones.
    first = np.searchsorted(point, np.arange(len(view) + 1))
    for rank in range(int(np.diff(first).max())):
        pieces = pieces.of(np.flatnonzero(np.diff(first)[pieces.owner] > rank))
        row = first[pieces.owner] + rank
        # Where the boxes are apart, the shadow misses the piece.
        near = np.flatnonzero((pieces.box + box[:, row] < 0).all(axis=0))
        row = row[near]
        parts = pieces.of(near)
        unfinished = row + 1 < first[parts.owner + 1]
        inside, touched, outside = cut(parts, planes[:, :, row], table.clearance[view[parts.owner]], unfinished)
        hidden += np.bincount(inside.owner, _piece_factors(x, view, inside, table), minlength=len(view))
        left = np.ones(len(pieces.owner), dtype=bool)
        left[near[touched]] = False
        pieces = together([pieces.of(np.flatnonzero(left)), *outside])
    return hidden


def _cones(
    x: FloatArray, view: IntArray, source_box: FloatArray, table: Sights
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return what blockers, seen from points x, hide in the sources' planes.

    Returns
    -------
    point : ndarray of shape (c,)
        The point of each cone, ascending; cones that miss the whole source are left out.
    planes : ndarray of shape (e, 3, c)
        a, b, c of the distance a u + b v + c from the plane through the point and an edge, positive inside [m].
    box : ndarray of shape (4, c)
        Around the shadow: negated largest u, negated largest v, least u, least v [m]. The sum with a piece's box is
        negative where the two meet.
    """
    count = np.diff(table.blocker)[view]
    point = np.repeat(np.arange(len(view)), count)
    blocker = np.arange(len(point)) + np.repeat(table.blocker[view] - np.cumsum(count) + count, count)
    arms = [table.blocker_corners[:, blocker, k] - x[k, point] for k in range(3)]
    box = _shadow_boxes(arms, x[:, point])
    near = np.flatnonzero((source_box[:, point] + box < 0).all(axis=0))
    point, blocker, box = point[near], blocker[near], box[:, near]
    ax, ay, az = (arm[:, near] for arm in arms)
    bx, by, bz = (np.roll(a, -1, axis=0) for a in (ax, ay, az))
    sx, sy, sz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    # From behind, the edges run clockwise.
    nx, ny, nz = table.blocker_normal[blocker].T
    side = np.sign(nx * ax[0] + ny * ay[0] + nz * az[0])
    length = np.sqrt(sx * sx + sy * sy + sz * sz)
    scale = side / np.maximum(length, TINY)
    px, py, pz = x[:, point]
    planes = np.stack((sx * scale, sy * scale, -(sx * px + sy * py + sz * pz) * scale), axis=1)
    # Between repeated corners there is no edge.
    planes[:, 2][length == 0] = 1
    reached = side != 0
    corners = table.corners[:, view[point]]
    for a, b, c in planes:
        highest = (a * corners[:, :, 0] + b * corners[:, :, 1] + c).max(axis=0)
        reached &= highest > table.clearance[view[point]]
    kept = np.flatnonzero(reached)
    return point[kept], planes.take(kept, axis=2), box[:, kept]


def _shadow_boxes(arms: list[FloatArray], x: FloatArray) -> FloatArray:
    """Return boxes around the blockers' shadows, see `_cones`; unbounded where a corner is no lower than the point."""
    lower = arms[2] < -LEVEL * x[2]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        u, v = (x[k] - arms[k] / arms[2] * x[2] for k in (0, 1))
        box = np.stack((-u.max(axis=0), -v.max(axis=0), u.min(axis=0), v.min(axis=0)))
    box[:, ~lower.all(axis=0)] = -np.inf
    return box


def _piece_factors(x: FloatArray, view: IntArray, pieces: Pieces, table: Sights) -> FloatArray:
    """Return the form factors of pieces from their points, Lambert's sum over all edges."""
    px, py, pz = x[:, pieces.owner]
    nx, ny, nz = table.normal[view[pieces.owner]].T
    ax, ay, az = pieces.u - px, pieces.v - py, -pz
    bx, by = np.roll(ax, -1, axis=0), np.roll(ay, -1, axis=0)
    # Both ends of an edge are as far below the point.
    sx, sy, sz = az * (by - ay), az * (ax - bx), bx * ay - by * ax
    sine = np.sqrt(sx * sx + sy * sy + sz * sz)
    angle = np.arctan2(sine, ax * bx + ay * by + az * az)
    terms = (nx * sx + ny * sy + nz * sz) * angle / np.maximum(sine, TINY)
    return np.asarray(terms.sum(axis=0) / (2 * np.pi))
