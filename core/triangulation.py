# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces as triangles and convex quads, the pieces that can be meshed and intersected.

Concave quads and n-gons are cut by ear clipping in the plane of the face, then improved by edge flips until they are
Delaunay, since long thin triangles make bad patches. All faces with the same number of corners are cut at once.
Sources: Meisters 1975 (ears); Lawson 1977 (flips).
"""

from dataclasses import dataclass

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .polygons import FLAT
from .scene import Scene

# Twice the area, in faces scaled to an extent of 1, up to which a triangle is a line: even patches a thousandth as high
# as what is left stand out from rounding, so that each has a normal.
SLIVER = 1e-11
# Sine by which opposite angles must exceed a half turn before an edge is flipped: keeps round shapes from cycling.
FLIP = 1e-9
# Marks a corner at the place of its neighbour, or between two at one place: without it the outline is the same.
DOUBLE = 2.0


@dataclass(frozen=True, eq=False)
class Pieces:
    """The convex parts of a scene's faces, in the order of the faces.

    Attributes
    ----------
    corner : ndarray of shape (q, 4)
        Face corners (indices into `Scene.corner_vertex`), counter-clockwise; a triangle repeats its last one.
    face : ndarray of shape (q,)
        The face that each piece is a part of.
    """

    corner: IntArray
    face: IntArray

    @property
    def triangle(self) -> BoolArray:
        """Return which pieces are triangles, shape (q,)."""
        return np.asarray(self.corner[:, 2] == self.corner[:, 3])

    def points(self, scene: Scene) -> FloatArray:
        """Return the corners' positions, shape (q, 4, 3) [m]."""
        return np.asarray(scene.vertices[scene.corner_vertex[self.corner]])


def pieces(scene: Scene) -> Pieces:
    """Cut every live face into convex quads and triangles.

    Triangles and strictly convex quads, planar or not, stay whole. Faces without area give nothing.

    Parameters
    ----------
    scene : Scene
        The polygons.

    Returns
    -------
    Pieces
        Between one and k - 2 pieces for a face with k corners.
    """
    sizes = np.diff(scene.face_start)
    corners: list[IntArray] = [np.zeros((0, 4), dtype=np.int64)]
    owners: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    for size in np.unique(sizes[scene.live]):
        faces = np.flatnonzero(scene.live & (sizes == size))
        loops = scene.face_start[faces, None] + np.arange(size)
        whole = np.full(len(faces), size == 3)
        if size > 3:
            plane = _in_plane(scene, faces, loops)
        if size == 4:
            whole = np.min(_cross(plane - np.roll(plane, 1, axis=1), np.roll(plane, -1, axis=1) - plane), axis=1) > FLAT
        corners.append(loops[whole][:, [0, 1, 2, min(size, 4) - 1]])
        owners.append(faces[whole])
        if not np.all(whole):
            triangles, row = triangulate(plane[~whole])
            cut = loops[~whole][row[:, None], triangles]
            corners.append(cut[:, [0, 1, 2, 2]])
            owners.append(faces[~whole][row])
    face = np.concatenate(owners)
    order = np.argsort(face, kind="stable")
    return Pieces(np.concatenate(corners)[order], face[order])


def triangulate(polygons: FloatArray) -> tuple[IntArray, IntArray]:
    """Cut simple polygons of one size, concave ones too, into Delaunay triangles.

    Parameters
    ----------
    polygons : ndarray of shape (m, k, 2)
        Corners, counter-clockwise, scaled to an extent of about 1. Neighbouring corners may coincide.

    Returns
    -------
    triangles : ndarray of shape (t, 3)
        Corners of each triangle, 0 to k - 1, counter-clockwise; triangles without area are left out.
    polygon : ndarray of shape (t,)
        The polygon of each triangle, ascending.
    """
    m, k, _ = polygons.shape
    points = polygons.reshape(m * k, 2)
    offset = np.arange(m)[:, None, None] * k
    # An edge that is flipped away never comes back, and k points have fewer edges than this.
    triangles = _flipped(points, (_ears(polygons) + offset).reshape(-1, 3), most=k * k)
    solid = _twice_area(points, triangles) > SLIVER
    polygon = triangles[:, 0] // k
    return triangles[solid] % k, polygon[solid]


def _in_plane(scene: Scene, faces: IntArray, loops: IntArray) -> FloatArray:
    """Return the corners of faces of one size in the planes of the faces, scaled to an extent of 1, shape (m, k, 2)."""
    position = scene.vertices[scene.corner_vertex[loops]]
    arm = (position - position[:, :1]) / scene.face_extent[faces, None, None]
    normal = scene.face_normal[faces]
    # The axis that is farthest from the normal cannot be parallel to it.
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = np.cross(axis, normal)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normal, first)
    return np.stack([np.einsum("mkx,mx->mk", arm, first), np.einsum("mkx,mx->mk", arm, second)], axis=2)


def _ears(polygons: FloatArray) -> IntArray:
    """Clip the best-shaped ear of every polygon until triangles are left, shape (m, k - 2, 3)."""
    m, k, _ = polygons.shape
    every = np.arange(m)
    alive = np.ones((m, k), dtype=bool)
    before = np.tile(np.roll(np.arange(k), 1), (m, 1))
    after = np.tile(np.roll(np.arange(k), -1), (m, 1))
    quality = np.stack([_quality(polygons, every, before[:, i], np.full(m, i), after[:, i]) for i in range(k)], axis=1)
    # A corner inside an ear forbids the ear until that corner itself has been clipped.
    blocker = np.full((m, k), -1)
    triangles = np.zeros((m, k - 2, 3), dtype=np.int64)
    for clipped in range(k - 2):
        tip = np.zeros(m, dtype=np.int64)
        waiting = every
        while len(waiting):
            score = np.where(alive[waiting] & (blocker[waiting] < 0), quality[waiting], -np.inf)
            tip[waiting] = np.argmax(score, axis=1)
            best = np.max(score, axis=1)
            stuck = best <= 0
            # Only an outline that crosses or touches itself has no ear: what has no area goes, or else the roundest.
            last = np.where(quality[waiting] == 0, DOUBLE, quality[waiting])
            tip[waiting[stuck]] = np.argmax(np.where(alive[waiting], last, -np.inf), axis=1)[stuck]
            ears = np.stack([before[waiting, tip[waiting]], tip[waiting], after[waiting, tip[waiting]]], axis=1)
            inside = _inside(polygons[waiting], ears, alive[waiting]) & (~stuck & (best < DOUBLE))[:, None]
            blocked = np.any(inside, axis=1)
            blocker[waiting[blocked], tip[waiting[blocked]]] = np.argmax(inside[blocked], axis=1)
            waiting = waiting[blocked]
        a, c = before[every, tip], after[every, tip]
        triangles[:, clipped] = np.stack([a, tip, c], axis=1)
        alive[every, tip] = False
        after[every, a], before[every, c] = c, a
        blocker[blocker == tip[:, None]] = -1
        for end in (a, c):
            quality[every, end] = _quality(polygons, every, before[every, end], end, after[every, end])
            blocker[every, end] = -1
    return triangles


def _quality(polygons: FloatArray, rows: IntArray, a: IntArray, b: IntArray, c: IntArray) -> FloatArray:
    """Return 1 for equilateral triangles, 0 for lines, less for those that turn right, 2 for doubled corners."""
    p, q, r = polygons[rows, a], polygons[rows, b], polygons[rows, c]
    double = np.any([np.all(one == other, axis=1) for one, other in ((p, q), (q, r), (r, p))], axis=0)
    twice = _cross(q - p, r - p)
    squares = sum(np.sum(side * side, axis=1) for side in (q - p, r - q, p - r))
    shape = np.where(np.abs(twice) > SLIVER, 2.0 * np.sqrt(3.0) * twice / np.maximum(squares, SLIVER), 0.0)
    return np.where(double, DOUBLE, shape)


def _inside(polygons: FloatArray, ears: IntArray, alive: BoolArray) -> BoolArray:
    """Return which living corners lie in or on an ear without being one of its own corners, shape (m, k)."""
    rows = np.arange(len(polygons))[:, None]
    tips = polygons[rows, ears]
    inside = alive.copy()
    for i in range(3):
        start, end = tips[:, i, None], tips[:, (i + 1) % 3, None]
        inside &= _cross(end - start, polygons - start) > -SLIVER
        # Outlines that touch themselves have other corners at the same place.
        inside &= np.any(polygons != start, axis=2)
    return inside


def _flipped(points: FloatArray, triangles: IntArray, most: int) -> IntArray:
    """Flip edges between triangles until no circle around a triangle holds a neighbour's corner, shape (t, 3).

    In every round each polygon that has something to flip flips at least one edge; there are `most` at most.
    """
    triangles = triangles.copy()
    for _ in range(most):
        first, second = _neighbours(triangles, len(points))
        # The two triangles a, b, p and b, a, q on either side of every inner edge.
        a, b, p = (triangles[first // 3, (first + i) % 3] for i in range(3))
        q = triangles[second // 3, (second + 2) % 3]
        flip = np.flatnonzero(_opposed(points, a, b, p, q))
        # A triangle can take part in one flip at a time: the first one that claims both of its triangles.
        owner = np.full(len(triangles), len(first))
        for side in (first, second):
            np.minimum.at(owner, side[flip] // 3, flip)
        flip = flip[(owner[first[flip] // 3] == flip) & (owner[second[flip] // 3] == flip)]
        if len(flip) == 0:
            break
        triangles[first[flip] // 3] = np.stack([p[flip], a[flip], q[flip]], axis=1)
        triangles[second[flip] // 3] = np.stack([q[flip], b[flip], p[flip]], axis=1)
    order = np.argsort(np.min(triangles, axis=1), kind="stable")
    return triangles[order]


def _neighbours(triangles: IntArray, n_points: int) -> tuple[IntArray, IntArray]:
    """Return the two half edges (3 * triangle + first corner) of every edge that two triangles share."""
    tail, head = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    key = np.minimum(tail, head) * n_points + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    shared = np.flatnonzero(key[order][1:] == key[order][:-1])
    return order[shared], order[shared + 1]


def _opposed(points: FloatArray, a: IntArray, b: IntArray, p: IntArray, q: IntArray) -> BoolArray:
    """Return where the angles over the edge a b at p and q sum to more than a half turn and p q may replace a b."""
    pa, pb, qa, qb = points[a] - points[p], points[b] - points[p], points[a] - points[q], points[b] - points[q]
    sine_p, cosine_p = _cross(pa, pb), np.sum(pa * pb, axis=1)
    sine_q, cosine_q = _cross(qb, qa), np.sum(qa * qb, axis=1)
    scale = np.sqrt(np.prod([np.sum(side * side, axis=1) for side in (pa, pb, qa, qb)], axis=0))
    convex = (_cross(pa, points[q] - points[p]) > SLIVER) & (_cross(points[q] - points[p], pb) > SLIVER)
    return np.asarray(convex & (sine_p * cosine_q + cosine_p * sine_q < -FLIP * scale))


def _twice_area(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Return twice the signed area of triangles."""
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    return _cross(b - a, c - a)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product of plane vectors."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
