# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons cut into patches of constant radiosity: n x n (T12), or until no patch edge is longer than asked for.

Quads are cut along their own bilinear surface, triangles into n^2 similar triangles, everything else into these two
first. Long triangles are cut in rows across instead, which takes far fewer patches for the same length of edge.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import RadiosityError
from .scene import BACK, FRONT, BoolArray, FloatArray, IntArray, Scene
from .triangulation import Pieces, pieces

# More patches than this are a slip of the keyboard: they would take gigabytes before the first ray is shot.
PATCH_LIMIT = 5_000_000


@dataclass(frozen=True, eq=False)
class Patches:
    """Small convex surfaces of constant radiosity, in the order of the faces, front before back.

    Attributes
    ----------
    corners : ndarray of shape (p, 4, 3)
        Corners [m], counter-clockwise seen from the radiating side; a triangle repeats its last corner.
    centre : ndarray of shape (p, 3)
        A point on the patch, in its middle [m].
    normal : ndarray of shape (p, 3)
        Unit normals towards the radiating side.
    area : ndarray of shape (p,)
        Areas [m^2]; of a non-planar patch, as seen along its normal.
    face : ndarray of shape (p,)
        The face of the scene that each patch is a part of.
    side : ndarray of shape (p,)
        1 on the front of the face, -1 on its back.
    reflectance, emission : ndarray of shape (p, 3)
        Of the face: rho, and exitance E [W/m^2].
    touch_corner, touch_patch : ndarray of shape (k,)
        Pairs of a mesh corner (index into `Scene.corner_vertex`) and a patch that has it as a corner of its own, on the
        front of the face unless only the back radiates. Sorted by corner; no corner of a live face is left out.
    """

    corners: FloatArray
    centre: FloatArray
    normal: FloatArray
    area: FloatArray
    face: IntArray
    side: NDArray[np.int8]
    reflectance: FloatArray
    emission: FloatArray
    touch_corner: IntArray
    touch_patch: IntArray


@dataclass(frozen=True, eq=False)
class _Grid:
    """How each piece is cut: the corners to interpolate between, rows and columns, and whether it is a triangle."""

    corner: IntArray  # (q, 4)
    face: IntArray  # (q,)
    rows: IntArray  # (q,)
    columns: IntArray  # (q,)
    triangle: BoolArray  # (q,) into rows^2 triangles; everything else into rows * columns quads
    fan: BoolArray  # (q,) quads whose first row comes to a point


def mesh(scene: Scene, *, max_edge: float | None = None, subdivide: int = 1) -> Patches:
    """Cut the faces of a scene into patches.

    Parameters
    ----------
    scene : Scene
        The polygons; each is cut into at least `divisions` * `subdivide` parts a side (T12).
    max_edge : float, optional
        No edge of a patch may be longer [m].
    subdivide : int
        Factor on the scene's own divisions.

    Returns
    -------
    Patches
        Patches and the maps back to faces and mesh corners.

    Raises
    ------
    RadiosityError
        When a setting makes no sense or the patches would be too many; before they are allocated.
    """
    if max_edge is not None and not (math.isfinite(max_edge) and max_edge > 0):
        raise RadiosityError(f"The largest patch edge must be a length above zero, not {max_edge:g} m")
    if subdivide < 1 or subdivide != int(subdivide):
        raise RadiosityError(f"The subdivision must be a whole number from 1 up, not {subdivide}")
    whole = pieces(scene)
    _check_count(scene, whole, max_edge, int(subdivide))
    return _patches(scene, _grid(scene, whole, max_edge, int(subdivide)))


def _splits(scene: Scene, whole: Pieces, max_edge: float | None, subdivide: int) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return rows and columns of every piece as floats that cannot overflow, and where a fan's tip is or -1."""
    least = scene.divisions[whole.face] * float(subdivide)
    if max_edge is None:
        return least, least, np.full(len(least), -1)
    points = whole.points(scene)
    length = np.asarray(np.linalg.norm(np.roll(points, -1, axis=1) - points, axis=2), dtype=np.float64)
    # An edge that is an exact multiple must not gain a patch by rounding.
    parts = np.maximum(np.ceil(length / max_edge * (1 - 1e-9)), least[:, None])
    rows, columns = np.maximum(parts[:, 0], parts[:, 2]), np.maximum(parts[:, 1], parts[:, 3])
    # Triangles: edges 0, 1 and 3 are real, edge 2 joins the last corner with itself.
    triangle = whole.triangle
    real = length[:, [0, 1, 3]]
    shortest = np.argmin(real, axis=1)
    base = parts[np.arange(len(parts)), np.array([0, 1, 3])[shortest]]
    longest = np.max(parts[:, [0, 1, 3]], axis=1, initial=0.0)
    fan = triangle & (2 * base <= longest)
    rows = np.where(triangle, longest, rows)
    columns = np.where(triangle, np.where(fan, base, longest), columns)
    # The tip lies opposite the shortest edge.
    return rows, columns, np.where(fan, (shortest + 2) % 3, -1)


def _grid(scene: Scene, whole: Pieces, max_edge: float | None, subdivide: int) -> _Grid:
    """Decide how every piece is cut."""
    rows, columns, tip = _splits(scene, whole, max_edge, subdivide)
    fan = tip >= 0
    corner = whole.corner.copy()
    # A fan is a quad whose fourth corner is its first: rows run from the tip to the edge opposite.
    turn = (tip[fan, None] + np.array([0, 1, 2, 0])) % 3
    corner[fan] = np.take_along_axis(whole.corner[fan], turn, axis=1)
    return _Grid(corner, whole.face, rows.astype(np.int64), columns.astype(np.int64), whole.triangle & ~fan, fan)


def _count(scene: Scene, whole: Pieces, max_edge: float | None, subdivide: int) -> FloatArray:
    """Return the number of patches of every object, as floats that cannot overflow."""
    rows, columns, _ = _splits(scene, whole, max_edge, subdivide)
    shown = 1 + (scene.sides[whole.face] == (FRONT | BACK))
    return np.bincount(scene.face_object[whole.face], rows * columns * shown, minlength=len(scene.object_names))


def _check_count(scene: Scene, whole: Pieces, max_edge: float | None, subdivide: int) -> None:
    """Refuse to make more patches than `PATCH_LIMIT`, and say what would fit."""
    counts = _count(scene, whole, max_edge, subdivide)
    total = float(np.sum(counts))
    if total <= PATCH_LIMIT:
        return
    most = int(np.argmax(counts))
    start = f"Object '{scene.object_names[most]}' alone would be cut into {counts[most]:,.0f} patches, the scene into "
    start += f"{total:,.0f}; {PATCH_LIMIT:,} is the limit: "
    if max_edge is None or np.sum(_count(scene, whole, None, subdivide)) > PATCH_LIMIT:
        raise RadiosityError(f"{start}take fewer divisions or a smaller subdivision than {subdivide}")
    edge = max_edge
    while np.sum(_count(scene, whole, edge, subdivide)) > PATCH_LIMIT:
        edge *= 1.1
    digits = 10.0 ** (math.floor(math.log10(edge)) - 1)
    raise RadiosityError(f"{start}take a largest edge of {math.ceil(edge / digits) * digits:g} m or more")


def _patches(scene: Scene, grid: _Grid) -> Patches:
    """Make the patches of the fronts, then arrange fronts and backs as the faces ask for."""
    counts = grid.rows * np.where(grid.triangle, grid.rows, grid.columns)
    piece = np.repeat(np.arange(len(counts)), counts)
    corners, touch_corner, touch_patch = _cut(scene, grid, piece, counts)
    front_face = grid.face[piece]

    # Fronts and backs of a face follow each other, the faces in their own order.
    shown = scene.sides[front_face]
    source = np.concatenate([np.flatnonzero(shown & FRONT), np.flatnonzero(shown & BACK)])
    side = np.ones(len(source), dtype=np.int8)
    side[np.count_nonzero(shown & FRONT) :] = -1
    order = np.lexsort((source, -side, front_face[source]))
    source, side = source[order], side[order]

    # Seen from the back the corners run the other way round.
    back = side < 0
    result = corners[source]
    triangle = np.all(result[:, 2] == result[:, 3], axis=1)
    result[back] = result[back][:, ::-1]
    result[back & triangle] = result[back & triangle][:, [1, 2, 3, 3]]
    face = front_face[source]
    normal, area, centre = _measures(result, triangle, side[:, None] * scene.face_normal[face])

    # Corners are lit by the side that is shown: the front, or the back where the front is dark.
    place = np.full(len(front_face), -1)
    lit = (side > 0) | (scene.sides[face] == BACK)
    place[source[lit]] = np.flatnonzero(lit)
    touch_patch = place[touch_patch]
    order = np.lexsort((touch_patch, touch_corner))
    return Patches(
        corners=result,
        centre=centre,
        normal=normal,
        area=area,
        face=face,
        side=side,
        reflectance=scene.reflectance[face],
        emission=scene.emission[face],
        touch_corner=touch_corner[order],
        touch_patch=touch_patch[order],
    )


def _cut(scene: Scene, grid: _Grid, piece: IntArray, counts: IntArray) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the corners (p, 4, 3) of all front patches, and the pairs of mesh corner and patch."""
    local = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)
    i, j = _lattice(grid, piece, local)
    points = scene.vertices[scene.corner_vertex[grid.corner]]
    rows, columns, triangle = grid.rows[piece], grid.columns[piece], grid.triangle[piece]
    # Edges from the first corner: a face far from the origin keeps its digits.
    arms = points[:, 1:] - points[:, :1]
    corners = np.empty((len(piece), 4, 3))
    touch_corner, touch_patch = [], []
    for slot in range(4):
        u, v = i[slot] / rows, j[slot] / columns
        weights = np.stack([np.where(triangle, u, u * (1 - v)), np.where(triangle, v, u * v), (1 - u) * v], axis=1)
        weights[triangle, 2] = 0.0
        corners[:, slot] = points[piece, 0] + np.einsum("pa,pax->px", weights, arms[piece])
        # Corners of the mesh are met exactly; a fan meets its tip with every patch of the first row.
        tip = grid.fan[piece] & (i[slot] == 0)
        met = np.argmax(weights == 1.0, axis=1) + 1
        met[np.all(weights == 0.0, axis=1) | tip] = 0
        hit = np.flatnonzero(np.any(weights == 1.0, axis=1) | (met == 0))
        corners[hit, slot] = points[piece[hit], met[hit]]
        touch_corner.append(grid.corner[piece[hit], met[hit]])
        touch_patch.append(hit)
    # A fan's first row and all triangles repeat their last corner.
    tips = np.flatnonzero(grid.fan[piece] & (local < columns))
    corners[tips, 3] = corners[tips, 2]
    pairs = np.unique(np.stack([np.concatenate(touch_corner), np.concatenate(touch_patch)], axis=1), axis=0)
    return corners, pairs[:, 0], pairs[:, 1]


def _lattice(grid: _Grid, piece: IntArray, local: IntArray) -> tuple[list[IntArray], list[IntArray]]:
    """Return the grid coordinates of the four corners of every patch, towards the second and the last corner."""
    columns, triangle = grid.columns[piece], grid.triangle[piece]
    i, j = local // columns, local % columns
    quad_i, quad_j = [i, i + 1, i + 1, i], [j, j, j + 1, j + 1]
    # Row r of a triangle holds 2 r + 1 triangles, pointing towards the first corner and away from it in turn.
    r = np.sqrt(local.astype(np.float64)).astype(np.int64)
    k, away = np.divmod(local - r * r, 2)
    a, b = [r - k, r + 1 - k - away, r - k - away], [k, k + away, k + 1]
    return (
        [np.where(triangle, t, q) for t, q in zip([*a, a[2]], quad_i, strict=True)],
        [np.where(triangle, t, q) for t, q in zip([*b, b[2]], quad_j, strict=True)],
    )


def _measures(corners: FloatArray, triangle: BoolArray, face_normal: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit normal, area and centre of every patch."""
    arm = corners - corners[:, :1]
    vector = 0.5 * np.cross(arm[:, 2], arm[:, 3] - arm[:, 1])
    area = np.linalg.norm(vector, axis=1)
    # Too small to have a normal of its own.
    solid = area > 0
    normal = np.where(solid[:, None], vector / np.where(solid, area, 1.0)[:, None], face_normal)
    # The mean of four corners lies on their bilinear surface, their centroid need not.
    mean = np.where(triangle[:, None], (arm[:, 1] + arm[:, 2]) / 3, (arm[:, 1] + arm[:, 2] + arm[:, 3]) / 4)
    return normal, np.asarray(area), corners[:, 0] + mean
