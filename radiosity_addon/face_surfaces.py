# SPDX-License-Identifier: GPL-3.0-or-later
"""What the faces of meshes reflect and emit: their materials, read while the meshes are there."""

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from .materials import Surface, read_material

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FaceSurfaces:
    """How the faces of one mesh take part in radiosity.

    Attributes
    ----------
    reflectance, emission : ndarray of shape (f, 3)
        Diffuse reflectance, and radiant exitance [W/m^2], of each face.
    """

    reflectance: FloatArray
    emission: FloatArray


class SurfaceReader:
    """Reads the materials of meshes, each of them once.

    Meshes are added while Blender's evaluated data is there; `finish` gives the values of all of them, in the order in
    which they were added. It may render, which makes the depsgraph old.
    """

    def __init__(self) -> None:
        self._known: dict[str, Surface] = {}
        self._done: list[FaceSurfaces] = []

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
        table = []
        for material in slot_materials(mesh, obj):
            key = "" if material is None else material.name_full
            if key not in self._known:
                self._known[key] = read_material(material)
            table.append(self._known[key])
        # Like Blender: an index beyond the last slot means the last slot.
        index = np.zeros(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", index)
        index = index.clip(0, len(table) - 1)
        self._done.append(
            FaceSurfaces(
                np.stack([surface.reflectance for surface in table])[index],
                np.stack([surface.emission for surface in table])[index],
            )
        )
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
            notes.extend(surface.warnings)
        return self._done


def slot_materials(mesh: bpy.types.Mesh, obj: bpy.types.Object) -> list[bpy.types.Material | None]:
    """Return the material of each slot, be it linked to mesh or object; one empty slot where there is none."""
    materials = list(mesh.materials)
    for index, slot in enumerate(obj.material_slots):
        if slot.link == 'OBJECT':
            materials[index : index + 1] = [slot.material]
    return materials or [None]
