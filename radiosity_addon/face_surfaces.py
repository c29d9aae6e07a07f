# SPDX-License-Identifier: GPL-3.0-or-later
"""What the faces of meshes reflect and emit: their materials, read while the meshes are there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.paint.paint import Paint, join_paint
from .materials import Surface
from .materials.painting import Painting, paint_meshes
from .materials.points import read_ground
from .materials.reading import COLUMNS, Unreadable, Varies, read_constant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FaceSurfaces:
    """How the faces of one mesh take part in radiosity.

    Attributes
    ----------
    reflectance, emission : ndarray of shape (f, 3)
        Diffuse reflectance, and radiant exitance [W/m^2], of each face; their means where they vary.
    passed : ndarray of shape (f, 3)
        Share of light that goes straight on behind each face.
    transmittance : ndarray of shape (f, 3)
        Share that leaves diffusely on the other side of each face.
    specular : ndarray of shape (f, 3)
        Share that the clear part of each face reflects of light that comes straight down.
    paint : Paint or None
        How they vary inside faces, in the space of the mesh.
    """

    reflectance: FloatArray
    emission: FloatArray
    passed: FloatArray
    transmittance: FloatArray
    specular: FloatArray
    paint: Paint | None = None

    def placed(self, linear: FloatArray, offset: FloatArray, order: IntArray) -> FaceSurfaces:
        """Return this on a mesh that was brought to the world.

        Parameters
        ----------
        linear : ndarray of shape (3, 3)
        offset : ndarray of shape (3,)
            A point p of the mesh is at `linear` p + `offset` in the world [m].
        order : ndarray of shape (c,)
            Which of the mesh's corners each corner in the world is.

        Returns
        -------
        FaceSurfaces
        """
        return self if self.paint is None else replace(self, paint=self.paint.moved(linear, offset, order))


class SurfaceReader:
    """Reads the materials of meshes, each of them once.

    Meshes are added while Blender's evaluated data is there; `finish` gives the values of all of them, in the order in
    which they were added. It may render, which makes the depsgraph old.
    """

    def __init__(self) -> None:
        # None stands for a material that is not the same everywhere.
        self._known: dict[str, Surface | None] = {}
        self._named: dict[str, set[str]] = {}
        self._done: list[FaceSurfaces | Painting] = []

    def add(self, mesh: bpy.types.Mesh, obj: bpy.types.Object) -> int:
        """Read the faces of a mesh.

        Parameters
        ----------
        mesh : bpy.types.Mesh
            Not needed any more afterwards.
        obj : bpy.types.Object
            Whose mesh it is: slots may take their material from it.

        Returns
        -------
        int
            Where in the list that `finish` returns its values are.
        """
        materials = [None if material is None else material.original for material in slot_materials(mesh, obj)]
        table = [self._constant(material) for material in materials]
        # Like Blender: an index beyond the last slot means the last slot.
        index = np.zeros(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", index)
        index = index.clip(0, len(table) - 1)
        plain = np.stack([np.zeros(COLUMNS) if surface is None else surface.columns for surface in table])[index]
        varying = {slot: materials[slot] for slot in np.unique(index).tolist() if table[slot] is None}
        if varying:
            named = set().union(*(self._names(material) for material in varying.values()))
            self._done.append(Painting(read_ground(mesh, obj, index, named), varying, plain))
        else:
            self._done.append(_surfaces(plain))
        return len(self._done) - 1

    def finish(self, notes: list[str]) -> list[FaceSurfaces]:
        """Return the surfaces of all meshes that were added.

        Parameters
        ----------
        notes : list of str
            What was read otherwise than Blender would render it is added.

        Returns
        -------
        list of FaceSurfaces
        """
        for surface in self._known.values():
            notes.extend(surface.warnings if surface is not None else ())
        paintings = [item for item in self._done if isinstance(item, Painting)]
        painted = iter(paint_meshes(paintings, notes))
        return [_surfaces(*next(painted)) if isinstance(item, Painting) else item for item in self._done]

    def _constant(self, material: bpy.types.Material | None) -> Surface | None:
        """Return the values of a material, or None where they depend on the place or only Cycles can tell."""
        key = "" if material is None else material.name_full
        if key not in self._known:
            try:
                self._known[key] = read_constant(material)
            except (Varies, Unreadable):
                self._known[key] = None
        return self._known[key]

    def _names(self, material: bpy.types.Material) -> set[str]:
        if material.name_full not in self._named:
            self._named[material.name_full] = _attribute_names(material.node_tree)
        return self._named[material.name_full]


def _surfaces(columns: FloatArray, paint: Paint | None = None) -> FaceSurfaces:
    return FaceSurfaces(*np.split(columns, COLUMNS // 3, axis=1), paint)


def join_surfaces(
    meshes: Sequence[tuple[FaceSurfaces, IntArray]],
) -> FaceSurfaces:
    """Put the surfaces of several meshes one after the other.

    Parameters
    ----------
    meshes : sequence of (FaceSurfaces, ndarray of shape (f + 1,))
        For each mesh also the first corner of each face, and the number of corners.

    Returns
    -------
    FaceSurfaces
        Of all faces.
    """
    parts = [
        (surface.reflectance, surface.emission, np.repeat(np.arange(len(start) - 1), np.diff(start)), surface.paint)
        for surface, start in meshes
    ]
    reflectance, emission = (np.concatenate([part[column] for part in parts]) for column in (0, 1))
    passed, transmittance, specular = (
        np.concatenate([getattr(surface, name) for surface, _ in meshes])
        for name in ("passed", "transmittance", "specular")
    )
    return FaceSurfaces(reflectance, emission, passed, transmittance, specular, join_paint(parts))


def _attribute_names(tree: bpy.types.NodeTree, seen: tuple[bpy.types.NodeTree, ...] = ()) -> set[str]:
    """Return the attributes that a node tree and the groups in it ask for by name."""
    names = set()
    for node in tree.nodes:
        if node.bl_idname == 'ShaderNodeAttribute':
            names.add(node.attribute_name)
        elif node.bl_idname == 'ShaderNodeGroup' and node.node_tree is not None and node.node_tree not in seen:
            names |= _attribute_names(node.node_tree, (*seen, tree))
    return names


def slot_materials(mesh: bpy.types.Mesh, obj: bpy.types.Object) -> list[bpy.types.Material | None]:
    """Return the material of each slot, be it linked to mesh or object; one empty slot where there is none."""
    materials = list(mesh.materials)
    for index, slot in enumerate(obj.material_slots):
        if slot.link == 'OBJECT':
            materials[index : index + 1] = [slot.material]
    return materials or [None]
