# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender scene as a `core.scene.Scene`: what renders, evaluated, in world space and metres.

Beside the surfaces it returns `Target`s: which corner of the scene lights which corner of a mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.errors import RadiosityError
from ..core.lighting.lamps import Lamp
from ..core.scene import AUTO, Scene
from .face_surfaces import FaceSurfaces, SurfaceReader
from .lamps import read_lamp
from .rendered import SURFACE_TYPES, left_out, rendered_objects
from .world import read_world

if TYPE_CHECKING:
    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Target:
    """A mesh that the light of one object goes to.

    It holds no reference to Blender's data, which Undo or loading a file may free while a bake runs.

    Attributes
    ----------
    object_name, mesh_name : str
        Full names, for messages.
    mesh_uid : int
        The mesh's `session_uid`.
    corner_vertex : ndarray of shape (c,)
        Vertex of each corner of the mesh when it was read.
    vertex_count : int
        Vertices of the mesh when it was read.
    scene_corner : ndarray of shape (c,)
        Corner of the scene that each corner of the mesh takes its light from.
    """

    object_name: str
    mesh_name: str
    mesh_uid: int
    corner_vertex: IntArray
    vertex_count: int
    scene_corner: IntArray


@dataclass(frozen=True, eq=False)
class Reading:
    """A scene that was read.

    Attributes
    ----------
    scene : core.scene.Scene
        Its surfaces; what could not be read is in its warnings.
    targets : tuple of Target
        One for each object with faces, in the order of the scene's `object_names`.
    """

    scene: Scene
    targets: tuple[Target, ...]


@dataclass(frozen=True, eq=False)
class _Part:
    """The faces of one object, in world space [m]."""

    vertices: FloatArray
    corner_vertex: IntArray
    face_start: IntArray
    corner_normals: FloatArray
    surfaces: int  # its number among those of the `SurfaceReader`


def read_scene(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, depsgraph: bpy.types.Depsgraph) -> Reading:
    """Read the meshes and lamps that are visible in renders, and the world.

    Parameters
    ----------
    scene : bpy.types.Scene
        Gives the unit scale and the world.
    view_layer : bpy.types.ViewLayer
        Gives the objects.
    depsgraph : bpy.types.Depsgraph
        The evaluated state of `view_layer`.

    Returns
    -------
    Reading
        Surfaces, and the meshes that they came from.

    Raises
    ------
    RadiosityError
        When no mesh with faces renders, or when a mesh has a position that is not finite.
    """
    notes = left_out(depsgraph)
    scale = 1.0 if scene.unit_settings.system == 'NONE' else scene.unit_settings.scale_length
    surfaces = SurfaceReader()
    parts: list[_Part] = []
    targets: list[Target] = []
    lamps: list[Lamp] = []
    corners = 0
    for obj in rendered_objects(view_layer):
        if obj.type in SURFACE_TYPES:
            notes.append(
                f"Object '{obj.name_full}' is not a mesh and is left out; convert it (Object > Convert > Mesh)"
            )
        elif obj.type == 'LIGHT':
            lamp = read_lamp(obj, depsgraph, world_matrix(obj, depsgraph), scale, notes)
            lamps += [lamp] if lamp is not None else []
        elif obj.type == 'MESH':
            part, target = _read_object(obj, depsgraph, scale, corners, surfaces, notes)
            if len(target.corner_vertex):
                parts.append(part)
                targets.append(target)
                corners += len(target.corner_vertex)
    if not parts:
        raise RadiosityError(
            f"Scene '{scene.name}' has no mesh with faces that is visible in renders: add a mesh, or enable its render "
            "visibility (the camera icon in the Outliner)"
        )
    names = tuple(target.object_name for target in targets)
    # Last, as these may render, which makes the depsgraph old.
    materials = surfaces.finish(notes)
    lamps += read_world(scene.world, notes)
    return Reading(_join(parts, [materials[part.surfaces] for part in parts], names, lamps, notes), tuple(targets))


def _read_object(
    obj: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    scale: float,
    first_corner: int,
    surfaces: SurfaceReader,
    notes: list[str],
) -> tuple[_Part, Target]:
    """Read one mesh object; `surfaces` reads its materials."""
    if obj.mode == 'EDIT':
        # The mesh itself is old while it is edited; this brings it up to date, as saving the file would.
        obj.update_from_editmode()
    original_topology = _topology(obj.data)
    evaluated = obj.evaluated_get(depsgraph)
    if not evaluated.is_evaluated and (obj.modifiers or obj.constraints):
        notes.append(f"Object '{obj.name_full}' is disabled in viewports and is read without modifiers and constraints")
    # A mesh of its own, also where the evaluated one is only a wrapper (in Edit Mode, or subdivided on the GPU).
    mesh = evaluated.to_mesh()
    try:
        if _same(original_topology, _topology(mesh)):
            part, order = _part(mesh, evaluated, world_matrix(obj, depsgraph), scale, surfaces)
        else:
            notes.append(
                f"Object '{obj.name_full}': its modifiers change the faces, so it is baked without them; apply them "
                "to light what they make"
            )
            part, order = _part(obj.data, evaluated, world_matrix(obj, depsgraph), scale, surfaces)
    finally:
        evaluated.to_mesh_clear()
    target = Target(
        object_name=obj.name_full,
        mesh_name=obj.data.name_full,
        mesh_uid=obj.data.session_uid,
        corner_vertex=original_topology[0],
        vertex_count=len(obj.data.vertices),
        scene_corner=first_corner + order,
    )
    return part, target


def _part(
    mesh: bpy.types.Mesh,
    obj: bpy.types.Object,
    matrix: FloatArray,
    scale: float,
    surfaces: SurfaceReader,
) -> tuple[_Part, IntArray]:
    """Bring a mesh to the world; also return which of its part's corners each corner of the mesh is."""
    corner_vertex, face_start = _topology(mesh)
    linear = matrix[:3, :3]
    vertices = scale * (_column(mesh.vertices, "co", 3) @ linear.T + matrix[:3, 3])
    # Normals go by the cofactors, the inverse transpose without its division: right for any scale, 0 included.
    cofactors = np.stack(
        [np.cross(linear[1], linear[2]), np.cross(linear[2], linear[0]), np.cross(linear[0], linear[1])]
    )
    normals = _column(mesh.corner_normals, "vector", 3) @ cofactors.T
    order = np.arange(len(corner_vertex))
    if np.linalg.det(linear) < 0.0:
        # Mirrored: what was counter-clockwise is clockwise now, while the outside stays the outside.
        sizes = np.diff(face_start)
        order = np.repeat(face_start[:-1] + face_start[1:] - 1, sizes) - order
        normals = -normals
    # Vertices that no face uses are not a part of any surface, wherever they are.
    used = np.zeros(len(vertices), dtype=bool)
    used[corner_vertex] = True
    part = _Part(
        vertices[used], (np.cumsum(used) - 1)[corner_vertex[order]], face_start, normals[order], surfaces.add(mesh, obj)
    )
    return part, order  # reversing twice gives the first order again, so it also maps the mesh's corners to the part's


def _join(
    parts: list[_Part], surfaces: list[FaceSurfaces], names: tuple[str, ...], lamps: list[Lamp], notes: list[str]
) -> Scene:
    """Put the parts one after the other into one scene."""
    first_vertex = np.cumsum([0] + [len(part.vertices) for part in parts])
    first_corner = np.cumsum([0] + [len(part.corner_vertex) for part in parts])
    sizes = [len(part.face_start) - 1 for part in parts]
    return Scene(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.corner_vertex + first for part, first in zip(parts, first_vertex, strict=False)]),
        np.concatenate(
            [part.face_start[:-1] + first for part, first in zip(parts, first_corner, strict=False)]
            + [first_corner[-1:]]
        ),
        np.concatenate([surface.reflectance for surface in surfaces]),
        np.concatenate([surface.emission for surface in surfaces]),
        corner_normals=np.concatenate([part.corner_normals for part in parts]),
        face_object=np.repeat(np.arange(len(parts)), sizes),
        object_names=names,
        lamps=lamps,
        sides=np.full(sum(sizes), AUTO),
        warnings=notes,
    )


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


def _topology(mesh: bpy.types.Mesh) -> tuple[IntArray, IntArray]:
    """Return the vertex of each corner, and the first corner of each face with the number of corners at the end."""
    starts = _column(mesh.polygons, "loop_start", 1, np.int32)
    return (
        _column(mesh.loops, "vertex_index", 1, np.int32).astype(np.int64),
        np.append(starts, len(mesh.loops)).astype(np.int64),
    )


def _same(one: tuple[IntArray, IntArray], other: tuple[IntArray, IntArray]) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def _column(
    collection: bpy.types.bpy_prop_collection, name: str, width: int, dtype: type = np.float32
) -> NDArray[np.generic]:
    """Return one property of all items as an array of shape (n,) or (n, width), in Blender's own precision."""
    values = np.zeros(len(collection) * width, dtype=dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values
