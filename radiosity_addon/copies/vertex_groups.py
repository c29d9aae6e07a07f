# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex groups of a mesh that is cut finer; geometry nodes move all weights at once, Python one vertex at a time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from .parts import Part, mixed

# Attributes that weights pass through on their way.
_PASSING = "radiosity-weight-"


def group_names(mesh: bpy.types.Mesh) -> list[str]:
    """Return the names of a mesh's vertex groups, in order."""
    with _object(mesh) as obj:
        return obj.vertex_groups.keys()


def with_groups(base: bpy.types.Mesh, mesh: bpy.types.Mesh, part: Part) -> bpy.types.Mesh:
    """Make a mesh like one that is cut finer, with the vertex groups of the coarse one.

    Parameters
    ----------
    base : bpy.types.Mesh
        The coarse one; stays as it is.
    mesh : bpy.types.Mesh
        The finer one, without attributes and materials; left as no more than scrap.
    part : Part
        How it is cut.

    Returns
    -------
    bpy.types.Mesh
        Its weights are interpolated. Vertices of weight 0 are in no group.
    """
    names = group_names(base)
    passing = [f"{_PASSING}{number}" for number in range(len(names))]
    with _stored(base, names, passing) as (evaluated, _):
        weights = np.zeros((len(base.vertices), 1), np.float32)
        for name in passing:
            evaluated.data.attributes[name].data.foreach_get("value", weights[:, 0])
            finer = mixed(weights, part.vertex_source, part.vertex_weight).astype(np.float32)
            mesh.attributes.new(name, 'FLOAT', 'POINT').data.foreach_set("value", finer.ravel())
    # The groups have to be there, or the nodes would make attributes of these names.
    with _object(mesh) as obj:
        for name in names:
            obj.vertex_groups.new(name=name)
    with _stored(mesh, passing, names) as (evaluated, depsgraph):
        made = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
    for name in passing:
        made.attributes.remove(made.attributes[name])
    return made


@contextmanager
def _object(mesh: bpy.types.Mesh) -> Iterator[bpy.types.Object]:
    """Give an object that a mesh is on, through which Blender tells its vertex groups, while the block runs."""
    obj = bpy.data.objects.new(mesh.name, mesh)
    try:
        yield obj
    finally:
        bpy.data.objects.remove(obj)


@contextmanager
def _stored(
    mesh: bpy.types.Mesh, sources: list[str], targets: list[str]
) -> Iterator[tuple[bpy.types.Object, bpy.types.Depsgraph]]:
    """Give an evaluated object whose mesh has the weights or attributes of some names under other names, too."""
    tree = _storing(sources, targets)
    scene = bpy.data.scenes.new(tree.name)
    try:
        with _object(mesh) as obj:
            scene.collection.objects.link(obj)
            obj.modifiers.new(tree.name, 'NODES').node_group = tree
            layer = scene.view_layers[0]
            layer.update()
            yield obj.evaluated_get(layer.depsgraph), layer.depsgraph
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.node_groups.remove(tree)


def _storing(sources: list[str], targets: list[str]) -> bpy.types.GeometryNodeTree:
    """Make geometry nodes that store what has some names under other names."""
    tree = bpy.data.node_groups.new("radiosity-groups", 'GeometryNodeTree')
    for way in ('INPUT', 'OUTPUT'):
        tree.interface.new_socket("Geometry", in_out=way, socket_type='NodeSocketGeometry')
    geometry = tree.nodes.new('NodeGroupInput').outputs[0]
    for source, target in zip(sources, targets, strict=True):
        read = tree.nodes.new('GeometryNodeInputNamedAttribute')
        store = tree.nodes.new('GeometryNodeStoreNamedAttribute')
        read.data_type = store.data_type = 'FLOAT'
        store.domain = 'POINT'
        read.inputs["Name"].default_value, store.inputs["Name"].default_value = source, target
        tree.links.new(read.outputs["Attribute"], store.inputs["Value"])
        tree.links.new(geometry, store.inputs["Geometry"])
        geometry = store.outputs["Geometry"]
    tree.links.new(geometry, tree.nodes.new('NodeGroupOutput').inputs[0])
    return tree
