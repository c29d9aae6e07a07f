# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that make numbers, colors and vectors: what each of them does to arrays of values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..network import Place, Unreadable
from . import colors, inputs, numbers, textures, vectors

if TYPE_CHECKING:
    from ..network import Array, Node, Socket

_READERS = inputs.READERS | textures.READERS | colors.READERS | numbers.READERS | vectors.READERS


def read_output(place: Place, node: Node, output: Socket) -> Array:
    """Return the values of a node's output.

    Parameters
    ----------
    place : Place
    node : Node
    output : NodeSocket
        One of the node's outputs.

    Returns
    -------
    ndarray of shape (1,), (3,), (n, 1) or (n, 3)

    Raises
    ------
    Unreadable
        When only Blender can tell.
    Varies
        When it depends on the place, and the network is read nowhere in particular.
    """
    read = _READERS.get(node.bl_idname)
    if read is None:
        raise Unreadable(node.name)
    return read(place, node, output)
