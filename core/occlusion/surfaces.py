# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces that block light, told in as few triangles as they can be (T14).

A ray does not care how finely a wall is meshed for light: a tree over the surfaces is several times cheaper to ask than
one over the patches. So flat faces that share edges are joined and cut anew into the few convex polygons that fill
their union; it stays the same union, to rounding. What is curved stays as it is: faces one by one, non-planar quads as
the patches that mesh them, so that what blocks is the surface that is lit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..scene import BACK, Scene
from ..triangulation import pieces
from .core_part import CorePart, core_part
from .joining import join

if TYPE_CHECKING:
    from ..meshing import Patches


# How exactly surfaces block, as shares of the scene's diagonal. An end of a segment that is this near to the plane of a
# surface lies on it, and the surface does not block it, however shallow the segment leaves: shortening segments instead
# would let neighbours of a slightly hollow mesh hide each other. Ten times what single precision gets wrong.
MARGIN = 4e-6
# Surfaces reach this much over their edges, so that nothing slips through where they meet.
GROWTH = 1e-6
# Half the height that the corners of a flat face may differ by, as a share of the scene's diagonal; Blender's single
# precision accounts for a tenth of it.
PLANAR = 1e-6
# Twice the area over the squared length of a triangle that is only rounding.
_NOTHING = 1e-14
# Multiplications that looking for what cannot block may take.
_EFFORT = 3e7


@dataclass(frozen=True, eq=False)
class Occluding:
    """Triangles that block light, whatever the meshing for light is.

    Two that follow each other and are halves of one parallelogram a, b, c, d stand as (a, b, c), (a, c, d).

    Attributes
    ----------
    vertices : ndarray of shape (v, 3)
        World space [m].
    triangles : ndarray of shape (t, 3)
        Indices into `vertices`, counter-clockwise seen from the front of the face.
    triangle_face : ndarray of shape (t,)
        The face of the scene that each triangle is a part of; of joined faces, one of them.
    slack : ndarray of shape (t,) or float
        How far from the triangle the surface that it stands for may lie [m]; above zero on bilinear patches only.
    """

    vertices: FloatArray
    triangles: IntArray
    triangle_face: IntArray
    slack: FloatArray | float = 0.0

    @cached_property
    def core(self) -> CorePart:
        """Return the part of the scene that tolerances are shares of."""
        corners = self.vertices[self.triangles]
        part = core_part(corners.min(axis=1), corners.max(axis=1))
        if not part.whole or not len(self.vertices):
            return part
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        return CorePart(0.5 * (low + high), float(np.linalg.norm(high - low)) or 1.0, True)

    @property
    def diagonal(self) -> float:
        """Return the diagonal of the bounding box [m], of its core where other things are far larger; 1 for nothing."""
        return self.core.size

    @property
    def margins(self) -> FloatArray:
        """Return how far from each triangle's plane an end lies in it, shape (t,) [sizes of the core]."""
        margin = MARGIN + np.broadcast_to(self.slack, len(self.triangles)) / self.core.size
        return np.asarray(margin + MARGIN * self.core.away(self.vertices[self.triangles]))


def occluder_polygons(scene: Scene, patches: Patches, blocking: BoolArray | None = None) -> Occluding:
    """Return the surfaces of a scene that block light.

    Parameters
    ----------
    scene : Scene
        Faces without area block nothing.
    patches : Patches
        How the faces are meshed; non-planar quads block as their patches do.
    blocking : ndarray of shape (f,), optional
        The faces that block; `Scene.occludes` when not given.

    Returns
    -------
    Occluding
        Its union is the union of the faces that block.
    """
    blocking = scene.occludes if blocking is None else blocking
    used = scene.vertices[scene.corner_vertex]
    diagonal = float(np.linalg.norm(np.ptp(used, axis=0))) if len(used) else 1.0
    if len(used):
        first = scene.face_start[:-1]
        core = core_part(np.minimum.reduceat(used, first, axis=0), np.maximum.reduceat(used, first, axis=0))
        diagonal = diagonal if core.whole else core.size
    flat = scene.live & blocking & (_off_plane(scene) <= PLANAR * diagonal)
    joined = join(scene, flat, diagonal)
    whole = pieces(scene)
    part = blocking[whole.face]
    bent = _bent(scene, patches, whole.face[part & ~whole.triangle & ~flat[whole.face]])

    # Everything as quads over one list of vertices; a triangle repeats its last corner.
    alone = part & ~joined.done[whole.face] & (whole.triangle | flat[whole.face])
    cells = patches.corners[bent]
    # All towards the front of the face, like everything else.
    cells[patches.side[bent] < 0] = cells[patches.side[bent] < 0][:, ::-1]
    loose = np.concatenate([joined.cut, cells])
    loose_quads = len(scene.vertices) + np.arange(4 * len(loose)).reshape(-1, 4)
    quads = np.concatenate([joined.fan, scene.corner_vertex[whole.corner[alone]], loose_quads])
    face = np.concatenate([joined.fan_face, whole.face[alone], joined.cut_face, patches.face[bent]])
    slack = np.concatenate([np.zeros(len(quads) - len(cells)), _twist(cells)])
    return _halved(np.concatenate([scene.vertices, loose.reshape(-1, 3)]), quads, face, slack)


def separate_polygons(scene: Scene, chosen: BoolArray) -> Occluding:
    """Return some faces of a scene, shape (f,), each for itself: none is joined with another."""
    whole = pieces(scene)
    part = chosen[whole.face]
    quads = scene.corner_vertex[whole.corner[part]]
    return _halved(scene.vertices, quads, whole.face[part], np.zeros(len(quads)))


def loose_polygons(quads: FloatArray) -> Occluding:
    """Return quads, shape (n, 4, 3) [m], that block each for itself; a triangle repeats its last corner."""
    index = np.arange(4 * len(quads)).reshape(-1, 4)
    a, b, c, d = (quads[:, k] for k in range(4))
    normal = np.cross(c - a, d - b)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    # A trapezoid is no parallelogram either, but flat.
    off_plane = 0.25 * np.abs(((a - b + c - d) * normal).sum(axis=1))
    return _halved(quads.reshape(-1, 3), index, np.arange(len(quads)), off_plane)


def never_block(vertices: FloatArray, triangles: IntArray, tolerance: float) -> BoolArray:
    """Find triangles in whose plane the scene ends: no segment between two of its points crosses them.

    The walls of a room are of this kind. Something that asks about segments inside the scene only may leave them out.

    Parameters
    ----------
    vertices : ndarray of shape (v, 3)
        All points of the scene lie in their convex hull [m].
    triangles : ndarray of shape (t, 3)
        Indices into `vertices`.
    tolerance : float
        How far behind the plane a point may lie and still count as on it [m].

    Returns
    -------
    ndarray of shape (t,)
        Of many triangles only the largest are looked at; the others count as blocking.
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    vector = np.cross(b - a, c - a)
    size = np.linalg.norm(vector, axis=1)
    normal = vector / np.where(size > 0, size, 1.0)[:, None]
    # A few extreme points tell most triangles from walls at once.
    ways = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 3)
    extreme = np.unique(np.argmax(vertices @ ways.T, axis=0)) if len(vertices) else np.zeros(0, dtype=np.int64)
    maybe = np.flatnonzero(_one_sided(vertices[extreme], a, normal, tolerance))
    largest = np.argsort(-size[maybe], kind="stable")[: int(_EFFORT / max(len(vertices), 1))]
    maybe = maybe[largest]
    never = np.zeros(len(triangles), dtype=bool)
    step = max(1, 1_000_000 // max(len(vertices), 1))
    for first in range(0, len(maybe), step):
        part = maybe[first : first + step]
        never[part] = _one_sided(vertices, a[part], normal[part], tolerance)
    return never


def _one_sided(points: FloatArray, origin: FloatArray, normal: FloatArray, tolerance: float) -> BoolArray:
    """Return which planes have none of the points on one of their sides."""
    height = normal @ points.T - (normal * origin).sum(axis=1)[:, None]
    return np.asarray((height.min(axis=1, initial=0.0) >= -tolerance) | (height.max(axis=1, initial=0.0) <= tolerance))


def _off_plane(scene: Scene) -> FloatArray:
    """Return how far the corners of each face lie from its middle plane at most, shape (f,) [m]."""
    first = scene.face_start[:-1]
    position = scene.vertices[scene.corner_vertex]
    arm = position - position[first][scene.corner_face]
    height = (arm * scene.face_normal[scene.corner_face]).sum(axis=1)
    return np.asarray(0.5 * (np.maximum.reduceat(height, first) - np.minimum.reduceat(height, first)))


def _twist(quads: FloatArray) -> FloatArray:
    """Return how far the bilinear surface of quads lies from their two triangles, shape (q,) [m]."""
    a, b, c, d = (quads[:, k] for k in range(4))
    return np.asarray(0.25 * np.linalg.norm(a - b + c - d, axis=1))


def _bent(scene: Scene, patches: Patches, faces: IntArray) -> BoolArray:
    """Return the patches that block in place of their face, from one side only where both radiate."""
    bent = np.zeros(len(scene.sides), dtype=bool)
    bent[faces] = True
    side = np.where(scene.sides == BACK, -1, 1)
    return np.asarray(bent[patches.face] & (patches.side == side[patches.face]))


def _halved(vertices: FloatArray, quads: IntArray, face: IntArray, slack: FloatArray) -> Occluding:
    """Return quads as pairs of triangles over the vertices that they use."""
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    # Where corners are repeated, half a quad is nothing.
    double = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    real = double > _NOTHING * np.maximum(((b - a) ** 2).sum(axis=1), ((c - a) ** 2).sum(axis=1))
    used = np.zeros(len(vertices), dtype=bool)
    used[triangles[real]] = True
    index = np.cumsum(used) - 1
    return Occluding(vertices[used], index[triangles[real]], np.repeat(face, 2)[real], np.repeat(slack, 2)[real])
