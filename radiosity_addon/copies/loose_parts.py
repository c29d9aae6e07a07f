# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices and edges without faces, on which no light falls: a mesh that is cut finer keeps them as they are."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..objects.meshes import column
from .parts import Part

if TYPE_CHECKING:
    import bpy


def with_loose(base: bpy.types.Mesh, part: Part) -> Part:
    """Add the vertices and edges of a mesh that no face has to what it is cut into.

    Parameters
    ----------
    base : bpy.types.Mesh
        The mesh.
    part : Part
        How its faces are cut.

    Returns
    -------
    Part
        The added vertices come last.
    """
    ends = column(base.edges, "vertices", 2, np.int32).astype(np.int64)
    loose = np.ones(len(ends), dtype=bool)
    loose[column(base.loops, "edge_index", 1, np.int32)] = False
    ends = ends[loose]
    # Where the vertices of the mesh are in what it is cut into: there, nothing else counts.
    place = np.full(len(base.vertices), -1)
    alone = part.vertex_weight.max(axis=1) == 1.0
    source = np.take_along_axis(part.vertex_source, part.vertex_weight.argmax(axis=1)[:, None], axis=1)[:, 0]
    place[source[alone]] = np.flatnonzero(alone)

    wanted = np.ones(len(place), dtype=bool)
    wanted[column(base.loops, "vertex_index", 1, np.int32)] = False
    wanted[ends] = True
    added = np.flatnonzero(wanted & (place < 0))
    if not len(added) and not len(ends):
        return part
    place[added] = len(part.vertex_source) + np.arange(len(added))
    return replace(
        part,
        vertex_source=np.concatenate([part.vertex_source, np.repeat(added[:, None], 4, axis=1)]),
        vertex_weight=np.concatenate([part.vertex_weight, np.tile((1.0, 0.0, 0.0, 0.0), (len(added), 1))]),
        edge=np.concatenate([part.edge, place[ends]]),
        edge_source=np.concatenate([part.edge_source, ends]),
        loose=place[ends],
    )
