# SPDX-License-Identifier: GPL-3.0-or-later
"""Into how many patches the pieces of faces are cut: n x n (T12), or until no patch edge is longer than asked for.

Quads are cut in rows and columns of their own bilinear surface, triangles into n^2 similar triangles. Long triangles
are cut in rows across, like fans, which takes far fewer patches for the same length of edge; flat ones in two such fans
that meet at the foot of the height.
"""

import math
from dataclasses import dataclass, fields

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .errors import RadiosityError
from .scene import BOTH, Scene
from .triangulation import Pieces

# More patches than this are a slip of the keyboard: they would take gigabytes before the first ray is shot.
PATCH_LIMIT = 5_000_000
# Parts of one edge, so that counts of patches stay finite; far above the limit of patches.
PARTS_LIMIT = 1e9


@dataclass(frozen=True, eq=False)
class Grid:
    """The pieces of a scene, in the order of the faces, and the number of rows and columns each is cut into.

    Attributes
    ----------
    points : ndarray of shape (q, 4, 3)
        Corners to interpolate between [m]; rows run from the edge 0-3 to the edge 1-2. Triangles use the first three.
    corner : ndarray of shape (q, 4)
        The mesh corner at each of them; -1 where there is none.
    face : ndarray of shape (q,)
        The face that the piece is a part of.
    rows, columns : ndarray of shape (q,)
        Parts along the edges 0-1 and 1-2.
    similar : ndarray of shape (q,)
        Triangles cut into rows^2 similar ones; everything else gives rows * columns quads.
    fan : ndarray of shape (q,)
        Pieces whose edge 0-3 is a point, so that their first row consists of triangles.
    """

    points: FloatArray
    corner: IntArray
    face: IntArray
    rows: IntArray
    columns: IntArray
    similar: BoolArray
    fan: BoolArray

    @property
    def counts(self) -> IntArray:
        """Return the number of patches on one side of each piece, shape (q,)."""
        return self.rows * self.columns

    def take(self, index: IntArray | BoolArray) -> "Grid":
        """Return some of the pieces."""
        return Grid(*(getattr(self, field.name)[index] for field in fields(self)))


def grid(scene: Scene, whole: Pieces, max_edge: float | None, subdivide: int) -> Grid:
    """Decide how every piece is cut.

    Parameters
    ----------
    scene : Scene
        The polygons with their own divisions.
    whole : Pieces
        Their convex parts.
    max_edge : float or None
        Longest edge of a patch [m], where the face has none of its own.
    subdivide : int
        Factor on the divisions.

    Returns
    -------
    Grid
        At least divisions * subdivide parts along every edge.
    """
    least = fewest_parts(scene, subdivide)[whole.face]
    none = np.zeros(len(least), dtype=bool)
    plain = Grid(whole.points(scene), whole.corner, whole.face, least, least, whole.triangle, none)
    longest = longest_edges(scene, max_edge)[whole.face]
    if np.all(np.isinf(longest)):
        return plain
    quad, triangle = ~plain.similar, plain.similar
    parts = [_quads(plain.take(quad), longest[quad]), *_triangles(plain.take(triangle), longest[triangle])]
    joined = Grid(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Grid)))
    return joined.take(np.argsort(joined.face, kind="stable"))


def check_count(scene: Scene, whole: Pieces, max_edge: float | None, subdivide: int) -> None:
    """Refuse to make more patches than `PATCH_LIMIT`.

    Raises
    ------
    RadiosityError
        Names the object with most patches and says what would fit.
    """
    counts = _per_object(scene, grid(scene, whole, max_edge, subdivide))
    total = float(np.sum(counts))
    if total <= PATCH_LIMIT:
        return
    most = int(np.argmax(counts))
    name, limit = scene.object_names[most], PATCH_LIMIT
    start = f"Object '{name}' would be cut into {counts[most]:,.0f} patches ({total:,.0f} in all, {limit:,} at most): "
    if max_edge is None or np.sum(_per_object(scene, grid(scene, whole, None, subdivide))) > limit:
        own = ", or larger patches of its own" if np.any(np.isfinite(scene.max_edge)) else ""
        raise RadiosityError(f"{start}take fewer divisions or a smaller subdivision{own}")
    # Between the edge asked for, too short, and the longest edge there is, which leaves every piece whole.
    short, fits = max_edge, float(np.max(_edges(whole.points(scene))))
    while fits > 1.05 * short:
        middle = math.sqrt(short) * math.sqrt(fits)
        if np.sum(_per_object(scene, grid(scene, whole, middle, subdivide))) > limit:
            short = middle
        else:
            fits = middle
    digits = 10.0 ** (math.floor(math.log10(fits)) - 1)
    raise RadiosityError(f"{start}take a largest edge of {math.ceil(fits / digits) * digits:.2g} m or more")


def longest_edges(scene: Scene, max_edge: float | None) -> FloatArray:
    """Return how long the edges of each face's patches may be, shape (f,) [m]; infinite for any length."""
    return np.where(np.isnan(scene.max_edge), np.inf if max_edge is None else max_edge, scene.max_edge)


def fewest_parts(scene: Scene, subdivide: int) -> IntArray:
    """Return into how many parts the edges of each face are cut at least, shape (f,)."""
    parts: FloatArray = np.minimum(scene.divisions * float(min(subdivide, PARTS_LIMIT)), PARTS_LIMIT)
    return parts.astype(np.int64)


def edge_parts(length: FloatArray, max_edge: FloatArray, least: IntArray) -> IntArray:
    """Return into how many parts edges are cut.

    Parameters
    ----------
    length : ndarray
        Of the edges [m].
    max_edge : ndarray
        The longest that a part may be [m].
    least : ndarray
        The fewest parts.

    Returns
    -------
    ndarray
        Whole numbers.
    """
    # An edge that is an exact multiple must not gain a part by rounding.
    parts = np.ceil(np.minimum(length / max_edge * (1 - 1e-9), PARTS_LIMIT))
    return np.maximum(parts.astype(np.int64), least)


def _edges(points: FloatArray) -> FloatArray:
    """Return the lengths of the edges of polygons, shape (q, k) [m]."""
    return np.asarray(np.linalg.norm(np.roll(points, -1, axis=1) - points, axis=2), dtype=np.float64)


def _quads(quads: Grid, max_edge: FloatArray) -> Grid:
    """Return quads with rows and columns for their longer opposite edges: a neighbour's edge is mostly cut alike."""
    parts = edge_parts(_edges(quads.points), max_edge[:, None], quads.rows[:, None])
    rows, columns = np.maximum(parts[:, 0], parts[:, 2]), np.maximum(parts[:, 1], parts[:, 3])
    return Grid(quads.points, quads.corner, quads.face, rows, columns, quads.similar, quads.fan)


def _triangles(triangles: Grid, max_edge: FloatArray) -> list[Grid]:
    """Return triangles as similar ones, as fans, or as two fans, whichever takes clearly the fewest patches."""
    # Turn every triangle so that its longest edge is the first.
    longest = np.argmax(_edges(triangles.points[:, :3]), axis=1)
    turn = (longest[:, None] + np.array([0, 1, 2])) % 3
    points = np.take_along_axis(triangles.points, turn[:, :, None], axis=1)
    corner = np.take_along_axis(triangles.corner, turn, axis=1)
    least = triangles.rows
    parts = edge_parts(_edges(points), max_edge[:, None], least[:, None])
    a, b, c = points[:, 0], points[:, 1], points[:, 2]
    along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    foot = a + along * np.sum((c - a) * along, axis=1, keepdims=True)
    high = edge_parts(np.asarray(np.linalg.norm(c - foot, axis=1), dtype=np.float64), max_edge, least)

    similar = parts[:, 0].astype(np.float64) ** 2
    fan = parts[:, 0].astype(np.float64) * np.minimum(parts[:, 1], parts[:, 2])
    pair = (parts[:, 1] + parts[:, 2]).astype(np.float64) * high
    as_pair = 2 * pair <= np.minimum(similar, fan)
    as_fan = ~as_pair & (2 * fan <= similar)
    # A fan's tip lies opposite the shorter of the other two edges.
    tip_first = parts[:, 1] <= parts[:, 2]

    def fans(which: BoolArray, order: list[int], rows: IntArray, columns: IntArray) -> Grid:
        """Return some of the triangles as fans, by the order in which they run through a, b, c and the foot."""
        four = np.stack([a, b, c, foot], axis=1)[which][:, order]
        numbers = np.concatenate([corner, np.full((len(corner), 1), -1)], axis=1)[which][:, order]
        no = np.zeros(len(four), dtype=bool)
        return Grid(four, numbers, triangles.face[which], rows[which], columns[which], no, ~no)

    whole = ~as_pair & ~as_fan
    same = triangles.take(whole)
    return [
        Grid(same.points, same.corner, same.face, parts[whole, 0], parts[whole, 0], same.similar, same.fan),
        fans(as_fan & tip_first, [0, 1, 2, 0], parts[:, 0], parts[:, 1]),
        fans(as_fan & ~tip_first, [1, 2, 0, 1], parts[:, 0], parts[:, 2]),
        fans(as_pair, [0, 3, 2, 0], parts[:, 2], high),
        fans(as_pair, [1, 2, 3, 1], parts[:, 1], high),
    ]


def _per_object(scene: Scene, pieces: Grid) -> FloatArray:
    """Return the number of patches of every object, as floats that cannot overflow."""
    shown = 1.0 + (scene.sides[pieces.face] == BOTH)
    counts = pieces.rows.astype(np.float64) * pieces.columns * shown
    return np.bincount(scene.face_object[pieces.face], counts, minlength=len(scene.object_names))
