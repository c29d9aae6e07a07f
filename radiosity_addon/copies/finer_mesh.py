# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh of Blender cut finer, with the materials, UV maps, attributes and normals of the one that it is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from .loose_parts import with_loose
from .parts import Part, mixed
from .vertex_groups import group_names, with_groups

if TYPE_CHECKING:
    from numpy.typing import NDArray

# What holds the values of each type of attribute, how many, and their type for Blender.
_MIXED = {
    'FLOAT': ("value", 1),
    'FLOAT2': ("vector", 2),
    'FLOAT_VECTOR': ("vector", 3),
    'FLOAT4': ("vector", 4),
    'FLOAT_COLOR': ("color", 4),
    'BYTE_COLOR': ("color", 4),
}
_CHOSEN = {
    'INT': ("value", 1, np.int32),
    'INT8': ("value", 1, np.int32),
    'BOOLEAN': ("value", 1, np.bool_),
    'INT16_2D': ("value", 2, np.int32),
    'INT32_2D': ("value", 2, np.int32),
    'QUATERNION': ("value", 4, np.float32),
    'FLOAT4X4': ("value", 16, np.float32),
}
# The topology itself, and normals, which are set in their own way.
_OWN = {"position", "custom_normal"}
_DOMAINS = {'POINT', 'EDGE', 'FACE', 'CORNER'}


def finer_mesh(base: bpy.types.Mesh, part: Part, name: str) -> bpy.types.Mesh:
    """Make a mesh that is another one cut finer.

    Parameters
    ----------
    base : bpy.types.Mesh
        Stays as it is.
    part : Part
        How it is cut.
    name : str
        Of the new mesh.

    Returns
    -------
    bpy.types.Mesh
        Numbers of attributes and weights of vertex groups are interpolated; whole numbers, marks and turns are those of
        what is nearest. Vertices and edges without faces stay as they are; what `left_out` tells is left out.
    """
    part = with_loose(base, part)
    mesh = bpy.data.meshes.new(name)
    try:
        _set_topology(mesh, base, part)
        if group_names(base):
            coarse, mesh = mesh, with_groups(base, mesh, part)
            bpy.data.meshes.remove(coarse)
        for material in base.materials:
            mesh.materials.append(material)
        _carry_attributes(mesh, base, part)
        _carry_normals(mesh, base, part)
    except BaseException:
        bpy.data.meshes.remove(mesh)
        raise
    return mesh


def left_out(base: bpy.types.Mesh) -> list[str]:
    """Return the names of the attributes of a mesh that one cut finer does not get: texts, which cannot be mixed."""
    known = _MIXED.keys() | _CHOSEN.keys()
    return [
        attribute.name
        for attribute in base.attributes
        if not _internal(attribute) and (attribute.data_type not in known or attribute.domain not in _DOMAINS)
    ]


def _internal(attribute: bpy.types.Attribute) -> bool:
    """Tell whether an attribute is the topology itself, or what Blender keeps to itself: selection, what is hidden."""
    return attribute.name in _OWN or (attribute.name.startswith(".") and attribute.name != ".uv_seam")


def _set_topology(mesh: bpy.types.Mesh, base: bpy.types.Mesh, part: Part) -> None:
    """Make the vertices and faces, and of the edges those that no face has: the others follow."""
    position = _values(base.vertices, "co", 3, np.float32)
    mesh.vertices.add(len(part.vertex_source))
    mesh.edges.add(len(part.loose))
    mesh.loops.add(len(part.corner_vertex))
    mesh.polygons.add(len(part.face))
    mesh.vertices.foreach_set("co", mixed(position, part.vertex_source, part.vertex_weight).ravel())
    mesh.edges.foreach_set("vertices", part.loose.astype(np.int32).ravel())
    mesh.loops.foreach_set("vertex_index", part.corner_vertex.astype(np.int32))
    mesh.polygons.foreach_set("loop_start", part.face_start[:-1].astype(np.int32))
    mesh.update(calc_edges=True)


def _carry_attributes(mesh: bpy.types.Mesh, base: bpy.types.Mesh, part: Part) -> None:
    """Give the finer mesh the attributes of the coarse one, UV maps and materials of faces among them."""
    for known in list(base.attributes):
        if _internal(known):
            continue
        if known.data_type in _MIXED:
            prop, width = _MIXED[known.data_type]
            kind, mixes = np.float32, True
        elif known.data_type in _CHOSEN:
            prop, width, kind = _CHOSEN[known.data_type]
            mixes = False
        else:
            continue
        values = _finer(_values(known.data, prop, width, kind), known.domain, mixes, mesh, base, part)
        new = mesh.attributes.get(known.name) or mesh.attributes.new(known.name, known.data_type, known.domain)
        if values is not None and new is not None:
            new.data.foreach_set(prop, np.ascontiguousarray(values, dtype=kind).ravel())
    if base.uv_layers.active is not None and base.uv_layers.active.name in mesh.uv_layers:
        mesh.uv_layers.active = mesh.uv_layers[base.uv_layers.active.name]
    for layer in base.uv_layers:
        if layer.active_render and layer.name in mesh.uv_layers:
            mesh.uv_layers[layer.name].active_render = True


def _finer(
    values: NDArray[np.generic], domain: str, mixes: bool, mesh: bpy.types.Mesh, base: bpy.types.Mesh, part: Part
) -> NDArray[np.generic] | None:
    """Return the values of an attribute on the finer mesh; None on a domain that meshes do not have."""
    if domain == 'FACE':
        return values[part.face]
    if domain == 'EDGE':
        edge, source = _edges(mesh, base, part)
        inner = np.zeros((len(mesh.edges), *values.shape[1:]), dtype=values.dtype)
        inner[edge] = values[source]
        return inner
    if domain == 'POINT':
        source, weight = part.vertex_source, part.vertex_weight
    elif domain == 'CORNER':
        source, weight = part.corner_source, part.corner_weight
    else:
        return None
    if mixes:
        return mixed(values, source, weight)
    return values[np.take_along_axis(source, np.argmax(weight, axis=1)[:, None], axis=1)[:, 0]]


def _edges(mesh: bpy.types.Mesh, base: bpy.types.Mesh, part: Part) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the edges of the finer mesh that are parts of edges of the coarse one, and these."""
    found = []
    for one, ends in ((mesh, part.edge), (base, part.edge_source)):
        known = np.sort(_values(one.edges, "vertices", 2, np.int32).astype(np.int64), axis=1)
        count = len(one.vertices)
        key, wanted = known @ (count, 1), np.sort(ends, axis=1) @ (count, 1)
        order = np.argsort(key, kind="stable")
        place = np.minimum(np.searchsorted(key[order], wanted), max(len(key) - 1, 0))
        found.append((order[place], key[order[place]] == wanted))
    there = found[0][1] & found[1][1]
    return found[0][0][there], found[1][0][there]


def _carry_normals(mesh: bpy.types.Mesh, base: bpy.types.Mesh, part: Part) -> None:
    """Shade the finer mesh as the coarse one is shaded, whose faces it follows."""
    if base.normals_domain == 'FACE':
        return
    normals = mixed(_values(base.corner_normals, "vector", 3, np.float32), part.corner_source, part.corner_weight)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    mesh.normals_split_custom_set(normals / np.where(length > 0.0, length, 1.0))


def _values(items: bpy.types.bpy_prop_collection, prop: str, width: int, kind: type) -> NDArray[np.generic]:
    """Return one property of all items, shape (n, width)."""
    values = np.zeros(len(items) * width, dtype=kind)
    items.foreach_get(prop, values)
    return values.reshape(-1, width)
