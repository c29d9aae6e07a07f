# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes cut finer without cracks: the faces at an edge are all cut at the same points of it.

How often an edge is cut depends on the edge alone, and `anchoring` makes each face meet the cuts of its cuts, so that
no vertex lies in the middle of an edge, where light would break. It knows what each of its parts is made of, so that
whatever a mesh carries can be carried over.

References
----------
D. R. Baum, S. Mann, K. P. Smith, J. M. Winget, Making radiosity usable: automatic preprocessing and meshing techniques
for the generation of accurate radiosity solutions, SIGGRAPH 1991.
"""

from dataclasses import dataclass

import numpy as np

from .anchoring import INSIDE, Cells, Pattern, anchored, quad_pattern, triangle_patterns
from .arrays import BoolArray, FloatArray, IntArray
from .edge_cuts import EdgeCuts, edge_cuts
from .errors import RadiosityError
from .grids import PATCH_LIMIT
from .runs import counted
from .scene import Scene
from .triangulation import pieces


@dataclass(frozen=True, eq=False)
class Refinement:
    """A finer mesh, and what of the coarse one each of its parts is made of.

    Attributes
    ----------
    vertices : ndarray of shape (v, 3)
        Positions [m]; those of the coarse mesh come first, unchanged.
    corner_vertex : ndarray of shape (c,)
        Vertex of each corner.
    face_start : ndarray of shape (f + 1,)
        First corner of each face; the last entry is c.
    face : ndarray of shape (f,)
        The coarse face that each is a part of, ascending.
    corner_source, corner_weight : ndarray of shape (c, 4)
        Corners of the coarse face, and how much each counts; together 1.
    vertex_source, vertex_weight : ndarray of shape (v, 4)
        Vertices of the coarse mesh, and how much each counts; together 1.
    edge, edge_source : ndarray of shape (e, 2)
        Vertices of each part of an edge of the coarse mesh, and the vertices of that edge.
    """

    vertices: FloatArray
    corner_vertex: IntArray
    face_start: IntArray
    face: IntArray
    corner_source: IntArray
    corner_weight: FloatArray
    vertex_source: IntArray
    vertex_weight: FloatArray
    edge: IntArray
    edge_source: IntArray


def refine(scene: Scene, max_edge: float | None = None, subdivide: int = 1) -> Refinement:
    """Cut the faces of a mesh finer.

    Parameters
    ----------
    scene : Scene
        The mesh; of its surfaces only `max_edge` and `divisions` count.
    max_edge : float, optional
        No edge may be longer [m], but for faces with a length of their own; where a face is cut less on one side than
        on the other, an edge in between may be up to twice as long.
    subdivide : int
        Every edge is cut into at least `divisions` times as many parts.

    Returns
    -------
    Refinement
        Faces that need no cut keep their corners; those without area only follow their neighbours.

    Raises
    ------
    RadiosityError
        When there would be too many faces; before they are made.
    """
    whole = pieces(scene)
    cuts = edge_cuts(scene, whole, max_edge, subdivide)
    one = scene.corner_vertex[whole.corner]
    other = np.roll(one, -1, axis=1)
    parts = np.where(one == other, 0, cuts.parts[cuts.find(one, other)])
    cut = np.zeros(len(scene.face_start) - 1, dtype=bool)
    cut[whole.face[(parts > 1).any(axis=1)]] = True
    quad, triangle = (cut[whole.face] & kind for kind in (~whole.triangle, whole.triangle))
    patterns = [
        quad_pattern(whole.corner[quad], whole.face[quad], parts[quad]),
        *triangle_patterns(whole.corner[triangle], whole.face[triangle], parts[triangle]),
    ]
    _check_count(scene, patterns)
    return _joined(scene, cuts, patterns, ~cut)


def _check_count(scene: Scene, patterns: list[Pattern]) -> None:
    """Refuse to make more faces than fit into memory."""
    cells = np.concatenate([pattern.rows.astype(np.float64) * pattern.columns for pattern in patterns])
    total = float(np.sum(cells))
    if total <= PATCH_LIMIT:
        return
    counts = np.bincount(scene.face_object[np.concatenate([pattern.face for pattern in patterns])], cells)
    most = int(np.argmax(counts))
    raise RadiosityError(
        f"Object '{scene.object_names[most]}' would be cut into some {counts[most]:,.0f} faces ({total:,.0f} in all, "
        f"{PATCH_LIMIT:,} at most): take larger patches or fewer subdivisions"
    )


@dataclass(frozen=True, eq=False)
class _Faces:
    """Some faces of the finer mesh: the coarse face and the size of each, and the corners of all, see `Refinement`."""

    face: IntArray
    size: IntArray
    vertex: IntArray
    source: IntArray
    weight: FloatArray


def _joined(scene: Scene, cuts: EdgeCuts, patterns: list[Pattern], keep: BoolArray) -> Refinement:
    """Put the cells, and the outlines of the faces that are kept, together into one mesh."""
    parts = [_outlines(scene, cuts, keep)]
    source, weight = [np.repeat(np.arange(cuts.base)[:, None], 4, axis=1)], [np.tile((1.0, 0, 0, 0), (cuts.base, 1))]
    owner, step = counted(cuts.parts - 1)
    source.append(np.stack([cuts.low, cuts.high, cuts.low, cuts.low], axis=1)[owner])
    weight.append(_shares((step + 1) / cuts.parts[owner]))
    count = cuts.base + len(owner)
    for pattern in patterns:
        cells, corner = anchored(pattern), scene.corner_vertex[pattern.corner]
        inner = pattern.inner
        vertex = _numbers(cuts, cells, corner, count + np.cumsum(inner) - inner)
        inside = cells.side == INSIDE
        shares = np.zeros((int(inner.sum()), 4))
        shares[vertex[inside] - count] = cells.weight[inside]
        source.append(corner[counted(inner)[0]])
        weight.append(shares)
        count += len(shares)
        parts.append(_faces(pattern, cells, vertex))

    face, size, vertex, corner_source, corner_weight = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("face", "size", "vertex", "source", "weight")
    )
    order = np.argsort(face, kind="stable")
    first = (np.cumsum(size) - size)[order]
    owner, step = counted(size[order])
    corner = first[owner] + step
    vertex_source, vertex_weight = np.concatenate(source), np.concatenate(weight)
    # From the first source on, which far from the origin keeps the digits.
    start = scene.vertices[vertex_source[:, 0]]
    arms = scene.vertices[vertex_source] - start[:, None]
    edge, edge_source = cuts.split()
    return Refinement(
        start + np.einsum("vk,vkx->vx", vertex_weight, arms),
        vertex[corner],
        np.concatenate(([0], np.cumsum(size[order]))),
        face[order],
        corner_source[corner],
        corner_weight[corner],
        vertex_source,
        vertex_weight,
        edge,
        edge_source,
    )


def _outlines(scene: Scene, cuts: EdgeCuts, keep: BoolArray) -> _Faces:
    """Return the faces that are kept, with the cuts of their edges as corners."""
    corner = np.flatnonzero(keep[scene.corner_face])
    following = scene.following_corner[corner]
    one, other = scene.corner_vertex[corner], scene.corner_vertex[following]
    parts = np.where(one == other, 1, cuts.parts[cuts.find(one, other)])
    owner, step = counted(parts)
    size = np.bincount(scene.corner_face[corner], parts, len(keep)).astype(np.int64)
    source = np.stack([corner, following, corner, corner], axis=1)
    return _Faces(
        np.flatnonzero(keep),
        size[keep],
        cuts.point(one[owner], other[owner], step),
        source[owner],
        _shares(step / parts[owner]),
    )


def _numbers(cuts: EdgeCuts, cells: Cells, corner: IntArray, first: IntArray) -> IntArray:
    """Return the vertex at each corner of some cells, shape (m, 4); `first` is that inside of each piece."""
    side = np.maximum(cells.side, 0)
    piece = cells.piece[:, None]
    bound = cuts.point(corner[piece, side], corner[piece, (side + 1) % 4], cells.step)
    return np.where(cells.side == INSIDE, first[piece] + cells.step, bound)


def _faces(pattern: Pattern, cells: Cells, vertex: IntArray) -> _Faces:
    """Return the cells that are faces, each corner once."""
    distinct = vertex != np.roll(vertex, 1, axis=1)
    size = np.count_nonzero(distinct, axis=1)
    solid = size >= 3
    used = distinct & solid[:, None]
    piece = np.broadcast_to(cells.piece[:, None], used.shape)[used]
    return _Faces(
        pattern.face[cells.piece[solid]], size[solid], vertex[used], pattern.corner[piece], cells.weight[used]
    )


def _shares(far: FloatArray) -> FloatArray:
    """Return how much each of four sources counts at a point between the first two, shape (n, 4)."""
    nothing = np.zeros_like(far)
    return np.stack([1 - far, far, nothing, nothing], axis=1)
