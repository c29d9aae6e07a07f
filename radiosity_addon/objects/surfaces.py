# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of one object, evaluated: a mesh with its modifiers, or what a curve, text or metaball looks like."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .corner_maps import Carried, corner_map
from .meshes import LocalMesh, Topology, local_mesh, topology
from .roles import Roles
from .targets import Target

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..face_surfaces import SurfaceReader
    from .evaluation import Evaluation

    FloatArray = NDArray[np.float64]

# What Blender makes a mesh of.
HAVE_SURFACES = {'MESH', 'CURVE', 'SURFACE', 'FONT', 'META'}
# What shows in renders, but not as a mesh.
NO_SURFACES = {'CURVES': "hair curves", 'POINTCLOUD': "a point cloud", 'VOLUME': "a volume"}


@dataclass(frozen=True, eq=False)
class Body:
    """Something with faces, and where it is.

    Attributes
    ----------
    mesh : LocalMesh
        Evaluated; that of many instances is one and the same.
    surfaces : int
        Its number among those of the `SurfaceReader`.
    matrix : ndarray of shape (4, 4)
        Object space to world space [Blender units].
    roles : Roles
    own : Own or None
        The object's own mesh; None of curves and instances.
    object_name, instancer_name, instance
        As in `Target`.
    """

    mesh: LocalMesh
    surfaces: int
    matrix: FloatArray
    roles: Roles
    own: Own | None
    object_name: str
    instancer_name: str
    instance: tuple[int, ...] = ()

    def target(self, first_corner: int, mirrored: bool) -> Target:
        """Return where its light goes, when its corners begin somewhere in the scene."""
        own = self.own or Own("", 0, Topology(_NONE, _NONE, 0), _NONE, Carried.NOWHERE)
        corner = self.mesh.topology.turned[own.corner] if mirrored else own.corner
        return Target(
            object_name=self.object_name,
            instancer_name=self.instancer_name,
            instance=self.instance,
            receives=self.roles.receives,
            evaluated=self.mesh.topology,
            first_corner=first_corner,
            mirrored=mirrored,
            mesh_name=own.name,
            mesh_uid=own.uid,
            corner_vertex=own.topology.corner_vertex,
            vertex_count=own.topology.vertex_count,
            scene_corner=first_corner + corner,
            carried=own.carried,
        )


@dataclass(frozen=True, eq=False)
class Own:
    """The mesh of an object as it is without modifiers, and where its corners are on the evaluated one.

    Attributes
    ----------
    name, uid : str, int
        Full name and `session_uid`.
    topology : Topology
    corner : ndarray of shape (c,)
        Corner of the evaluated mesh for each of its own.
    carried : Carried
        How that was found.
    """

    name: str
    uid: int
    topology: Topology
    corner: NDArray[np.int64]
    carried: Carried


_NONE = np.zeros(0, dtype=np.int64)


def read_body(obj: bpy.types.Object, state: Evaluation, roles: Roles, surfaces: SurfaceReader) -> Body | None:
    """Read an object of one of the types in `HAVE_SURFACES`.

    Parameters
    ----------
    obj : bpy.types.Object
    state : Evaluation
    roles : Roles
        What it does with light.
    surfaces : SurfaceReader
        Reads its materials.

    Returns
    -------
    Body or None
        None where there are no faces.
    """
    if obj.mode == 'EDIT' and obj.type == 'MESH':
        # The mesh itself is old while it is edited; this brings it up to date, as saving the file would.
        obj.update_from_editmode()
    evaluated = state.evaluated(obj)
    with evaluated_mesh(evaluated) as mesh:
        # A curve of which modifiers leave nothing gives no mesh at all.
        if mesh is None or len(mesh.polygons) == 0:
            return None
        found = local_mesh(mesh)
        number = surfaces.add(mesh, evaluated)
    own = _own(obj, found) if obj.type == 'MESH' else None
    name = obj.name_full
    return Body(found, number, state.matrix(obj), roles, own, name, name)


@contextmanager
def evaluated_mesh(evaluated: bpy.types.Object) -> Iterator[bpy.types.Mesh | None]:
    """Give the mesh that an object is with its modifiers, for as long as the block runs.

    It is a mesh of its own, also where the evaluated data is only a wrapper (in Edit Mode, or subdivided on the GPU).
    """
    try:
        yield evaluated.to_mesh()
    finally:
        evaluated.to_mesh_clear()


def _own(obj: bpy.types.Object, evaluated: LocalMesh) -> Own:
    """Find the corners of an object's mesh on the evaluated one."""
    before = topology(obj.data)
    if before.same(evaluated.topology):
        corner, carried = np.arange(len(before.corner_vertex)), Carried.SAME
    else:
        corner, carried = corner_map(local_mesh(obj.data), evaluated)
    return Own(obj.data.name_full, obj.data.session_uid, before, corner, carried)


def world_matrix(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> FloatArray:
    """Return object space to world space as an array of shape (4, 4)."""
    evaluated = obj.evaluated_get(depsgraph)
    if evaluated.is_evaluated:
        return np.array(evaluated.matrix_world, dtype=float)
    # Disabled in viewports, so Blender has not moved it for long: follow its parents.
    basis = np.array(obj.matrix_basis, dtype=float)
    if obj.parent is None:
        return basis
    return world_matrix(obj.parent, depsgraph) @ np.array(obj.matrix_parent_inverse, dtype=float) @ basis
