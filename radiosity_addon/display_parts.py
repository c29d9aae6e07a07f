# SPDX-License-Identifier: GPL-3.0-or-later
"""What a picture or an export shows of each baked object: a copy of its evaluated mesh, and the colors on that."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from .base_textures import base_texture
from .copies.collection import COPY_OF
from .materials import read_material
from .rendered import rendered_objects
from .scene_reader import world_matrix

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

_MESH = "radiosity-mesh"


@dataclass(frozen=True, eq=False)
class Part:
    """A baked object.

    Attributes
    ----------
    name, mesh_name : str
        Of the user's object and mesh.
    mesh : bpy.types.Mesh
        A copy of the evaluated one.
    matrix : Matrix
        Its space to world space.
    materials : tuple of bpy.types.Material or None
        The user's, one for each slot.
    colors : ndarray of shape (n, 3)
        What is to be shown, linear and unclamped.
    domain : str
        What carries a color, 'CORNER' or 'POINT'.
    emitting : ndarray of shape (n,)
        Which belong to lamps, that need not be shown below white.
    textured : ndarray of shape (n,)
        Which an image is multiplied with.
    """

    name: str
    mesh_name: str
    mesh: bpy.types.Mesh
    matrix: Matrix
    materials: tuple[bpy.types.Material | None, ...]
    colors: FloatArray
    domain: str
    emitting: NDArray[np.bool_]
    textured: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Look:
    """What a material makes of lighting: reflectance and radiance, each of shape (3,); 1 and 0 for an image."""

    reflectance: FloatArray
    radiance: FloatArray
    image: bool


def read_parts(
    depsgraph: bpy.types.Depsgraph, attribute: str, made: list[bpy.types.ID], *, copies: bool, lighting: bool
) -> Iterator[Part]:
    """Copy the evaluated mesh of every baked object, and read its colors.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        The evaluated state of the scene that was baked.
    attribute : str
        Name of the color attribute. Only meshes that have it, and that renders show, count.
    made : list
        What is made is added to it.
    copies, lighting : bool
        As for `display_scene`.

    Yields
    ------
    Part
    """
    looks: dict[str | None, _Look] = {}
    for obj in rendered_objects(depsgraph.view_layer, copies=copies):
        if obj.type != 'MESH' or attribute not in obj.data.color_attributes:
            continue
        evaluated = obj.evaluated_get(depsgraph)
        mesh = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
        mesh.name = _MESH
        made.append(mesh)
        # The exporter does this too, which may take faces away: before the colors are read, not after.
        mesh.validate(clean_customdata=False)
        baked = mesh.color_attributes.get(attribute)
        if baked is None or not mesh.polygons:
            continue  # modifiers have left nothing of it
        values = np.zeros(len(baked.data) * 4, np.float32)
        baked.data.foreach_get("color", values)
        colors, domain = values.reshape(-1, 4)[:, :3].astype(np.float64), baked.domain
        materials = tuple(slot.material for slot in obj.material_slots) or (None,)
        of_slot = [_look(material, looks) for material in materials]
        slot, vertex = _corners(mesh, len(materials))
        radiance = np.array([look.radiance for look in of_slot])
        emitting = radiance.any(axis=1)[slot]
        textured = np.zeros(len(colors), bool)
        if lighting:
            # Vertices may have faces of different materials.
            colors, domain = colors if domain == 'CORNER' else colors[vertex], 'CORNER'
            colors = radiance[slot] + np.array([look.reflectance for look in of_slot])[slot] * colors
            textured = np.array([look.image for look in of_slot])[slot]
        elif domain == 'POINT':
            lamp = np.zeros(len(mesh.vertices), bool)
            lamp[vertex[emitting]] = True
            emitting = lamp
        matrix = Matrix(world_matrix(obj, depsgraph).tolist())
        name = obj.get(COPY_OF, obj.name)
        yield Part(name, obj.data.name, mesh, matrix, materials, colors, domain, emitting, textured)


def face_slots(mesh: bpy.types.Mesh, count: int) -> NDArray[np.int32]:
    """Return the material slot of each face; as in Blender, what is beyond the last is in the last."""
    slots = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    return np.clip(slots, 0, count - 1)


def _look(material: bpy.types.Material | None, looks: dict[str | None, _Look]) -> _Look:
    """Return what a material makes of lighting; each is read once."""
    name = material.name_full if material else None
    if name not in looks:
        surface = read_material(material)
        image = base_texture(material) is not None
        looks[name] = _Look(np.ones(3) if image else surface.reflectance, surface.emission / np.pi, image)
    return looks[name]


def _corners(mesh: bpy.types.Mesh, count: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the material slot and the vertex of each corner."""
    sizes, vertices = np.zeros(len(mesh.polygons), np.int32), np.zeros(len(mesh.loops), np.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    mesh.loops.foreach_get("vertex_index", vertices)
    return np.repeat(face_slots(mesh, count), sizes), vertices
