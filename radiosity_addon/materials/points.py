# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh that a material is read on: its triangles, coordinates and attributes, and points on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.mending import FARTHEST
from ...core.paint.averages import Triangles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ...core.paint.samples import PaintSamples

    Array = NDArray[np.float64]
    IntArray = NDArray[np.int64]

# Property and width of the attributes that a shader can read, by their data type.
_ATTRIBUTES = {
    'FLOAT': ("value", 1),
    'INT': ("value", 1),
    'INT8': ("value", 1),
    'BOOLEAN': ("value", 1),
    'FLOAT_VECTOR': ("vector", 3),
    'FLOAT2': ("vector", 2),
    'FLOAT_COLOR': ("color", 4),
    'BYTE_COLOR': ("color", 4),
}


@dataclass(frozen=True, eq=False)
class Layer:
    """An attribute of a mesh.

    Attributes
    ----------
    domain : str
        'POINT', 'CORNER' or 'FACE'.
    values : ndarray of shape (n, k)
        One row for each vertex, corner or face.
    """

    domain: str
    values: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Ground:
    """A mesh with what materials are read from, in the object's own space.

    Attributes
    ----------
    triangles : Triangles
    corner_vertex, corner_face : ndarray of shape (c,)
    material_index : ndarray of shape (f,)
        The slot of each face.
    normal : ndarray of shape (f, 3)
        Of the faces, or 0 for those without area.
    uv_maps, attributes : dict of Layer
    active_uv, active_color : str
        The ones that count where no name is given, "" for none.
    space : tuple of ndarray
        Middle and half size of the box that generated coordinates span.
    matrix : ndarray of shape (4, 4)
        Where the object stands.
    color : ndarray of shape (3,)
        Of the object.
    """

    triangles: Triangles
    corner_vertex: IntArray
    corner_face: IntArray
    material_index: IntArray
    normal: Array
    uv_maps: dict[str, Layer]
    attributes: dict[str, Layer]
    active_uv: str
    active_color: str
    space: tuple[Array, Array]
    matrix: Array
    color: Array

    def at(self, layer: Layer, samples: PaintSamples) -> Array:
        """Return the values of an attribute at points, shape (s, k)."""
        if layer.domain == 'FACE':
            return layer.values[self.triangles.face[samples.triangle]].astype(float)
        index = self.triangles.corner if layer.domain == 'CORNER' else self.corner_vertex[self.triangles.corner]
        return np.einsum("sj,sjk->sk", samples.share, layer.values[index[samples.triangle]], dtype=float)


@dataclass(frozen=True, eq=False)
class Points:
    """Points on a mesh at which a network is read.

    Attributes
    ----------
    ground : Ground
    samples : PaintSamples
    """

    ground: Ground
    samples: PaintSamples

    @property
    def position(self) -> Array:
        """Return where the points are in the object's space, shape (n, 3)."""
        corners = self.ground.triangles.points[self.samples.triangle]
        return np.einsum("sj,sjk->sk", self.samples.share, corners)

    @property
    def normal(self) -> Array:
        """Return the normals of the faces in the object's space, shape (n, 3)."""
        return self.ground.normal[self.ground.triangles.face[self.samples.triangle]]

    def uv(self, name: str) -> Array:
        """Return texture coordinates, shape (n, 3); 0 where there are none, as in Blender."""
        layer = self.ground.uv_maps.get(name or self.ground.active_uv)
        if layer is None:
            return np.zeros((len(self.samples.triangle), 3))
        return np.column_stack([self.ground.at(layer, self.samples), np.zeros(len(self.samples.triangle))])

    def attribute(self, name: str) -> Array | None:
        """Return an attribute as colors, shape (n, 4), or None where there is none of that name."""
        layer = self.ground.attributes.get(name)
        if layer is None:
            return None
        values = self.ground.at(layer, self.samples)
        if values.shape[1] == 1:
            values = np.repeat(values, 3, axis=1)
        whole = np.zeros((len(values), 4))
        whole[:, 3] = 1.0
        whole[:, : values.shape[1]] = values
        return whole


def read_ground(mesh: bpy.types.Mesh, obj: bpy.types.Object, material_index: IntArray, named: set[str]) -> Ground:
    """Read what materials may ask for.

    Parameters
    ----------
    mesh : bpy.types.Mesh
    obj : bpy.types.Object
        Whose mesh it is.
    material_index : ndarray of shape (f,)
    named : set of str
        Attributes that are asked for by name; UV maps and color attributes are read in any case.

    Returns
    -------
    Ground
    """
    mesh.calc_loop_triangles()
    position = _column(mesh.vertices, "co", 3).astype(float)
    # Faces with a vertex that is nowhere are left out later; until then they shall be somewhere.
    position[~(np.abs(position) <= FARTHEST)] = 0.0
    corner_vertex = _column(mesh.loops, "vertex_index", 1, np.int32)[:, 0].astype(np.int64)
    corner = _column(mesh.loop_triangles, "loops", 3, np.int32).astype(np.int64)
    face = _column(mesh.loop_triangles, "polygon_index", 1, np.int32)[:, 0].astype(np.int64)
    order = np.argsort(face, kind="stable")
    corner, face = corner[order], face[order]
    sizes = _column(mesh.polygons, "loop_total", 1, np.int32)[:, 0]
    data = obj.data if isinstance(obj.data, bpy.types.Mesh) else mesh
    colors = {layer.name for layer in mesh.color_attributes}
    attributes = {}
    for item in mesh.attributes:
        if item.name in named | colors and (read := _layer(item)) is not None:
            attributes[item.name] = read
    maps = {item.name: Layer('CORNER', _column(item.uv, "vector", 2)) for item in mesh.uv_layers}
    active = next((item.name for item in mesh.uv_layers if item.active_render), "")
    shown = mesh.color_attributes.render_color_index
    return Ground(
        Triangles(position[corner_vertex[corner]], corner, face),
        corner_vertex,
        np.repeat(np.arange(len(sizes)), sizes),
        material_index,
        _column(mesh.polygons, "normal", 3).astype(float),
        maps,
        attributes,
        active,
        mesh.color_attributes[shown].name if 0 <= shown < len(mesh.color_attributes) else "",
        (np.array(data.texspace_location, dtype=float), np.array(data.texspace_size, dtype=float)),
        np.array(obj.matrix_world, dtype=float),
        np.array(obj.color[:3], dtype=float),
    )


def _layer(item: bpy.types.Attribute) -> Layer | None:
    """Read an attribute; None where shaders cannot."""
    if item.data_type not in _ATTRIBUTES or item.domain not in {'POINT', 'CORNER', 'FACE'}:
        return None
    name, width = _ATTRIBUTES[item.data_type]
    kind = {'BOOLEAN': bool, 'INT': np.int32, 'INT8': np.int32}.get(item.data_type, np.float32)
    return Layer(item.domain, _column(item.data, name, width, kind).astype(np.float32))


def _column(
    items: bpy.types.bpy_prop_collection, name: str, width: int, dtype: type = np.float32
) -> NDArray[np.generic]:
    """Return one property of all items as an array of shape (n, width)."""
    values = np.zeros(len(items) * width, dtype=dtype)
    items.foreach_get(name, values)
    return values.reshape(-1, width)
