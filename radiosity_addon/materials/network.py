# SPDX-License-Identifier: GPL-3.0-or-later
"""A node tree while it is read: which output feeds an input, through groups, and with which values.

Values are arrays: a number has the shape (1,) or (n, 1), a color or a vector (3,) or (n, 3), for n points. So they
multiply as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .images import Images
    from .points import Points

    Array = NDArray[np.float64]
    Socket = bpy.types.NodeSocket
    Node = bpy.types.Node
    Values = Callable[["Place", Node, Socket], Array]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # Rec. 709, as Blender turns a color into a number
_NUMBERS = {'VALUE', 'INT', 'BOOLEAN'}


class Unreadable(Exception):
    """A node that only Blender itself can evaluate."""


class Varies(Exception):
    """A value that depends on the place, asked for nowhere in particular."""


@dataclass(eq=False)
class Network:
    """One reading of a material.

    Attributes
    ----------
    values : callable
        Reads a node's output.
    images : Images
    points : Points or None
        Where it is read; None stands for nowhere in particular.
    strict : bool
        Whether what cannot be read raises; else the socket's own value is taken, and `notes` tells it.
    notes : dict
        A set that keeps its order.
    known : dict
        What was read already.
    """

    values: Values
    images: Images
    points: Points | None = None
    strict: bool = True
    notes: dict[str, None] = field(default_factory=dict)
    known: dict[tuple[str, ...], object] = field(default_factory=dict)

    def note(self, text: str) -> None:
        """Keep something to tell."""
        self.notes[text] = None

    @property
    def at(self) -> Points:
        """Return the points, or raise `Varies` where there are none."""
        if self.points is None:
            raise Varies
        return self.points


@dataclass(frozen=True, eq=False)
class Place:
    """Where in a network a node is: in the material's tree, or inside a group of it.

    Attributes
    ----------
    network : Network
    path : tuple of str
        Names of the group nodes that lead here.
    outer : tuple of (Place, Node) or None
        The group node that this is the inside of, and where that is.
    """

    network: Network
    path: tuple[str, ...] = ()
    outer: tuple[Place, Node] | None = None

    def source(self, socket: Socket) -> tuple[Socket | None, Socket, Place]:
        """Find what feeds an input, past reroutes, muted nodes, and the borders of groups.

        Parameters
        ----------
        socket : NodeSocket
            An input.

        Returns
        -------
        output : NodeSocket or None
            None where nothing feeds it.
        socket : NodeSocket
            The last input on the way there, whose own value counts where nothing feeds it.
        place : Place
            Where these are.
        """
        place, seen = self, set()
        while True:
            link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
            if link is None or (place.path, link.from_socket) in seen:
                return None, socket, place
            output = link.from_socket
            seen.add((place.path, output))
            node = output.node
            if node.bl_idname == 'NodeReroute':
                if not node.inputs[0].links:
                    return None, socket, place
                socket = node.inputs[0]
            elif node.mute:
                through = next((inner for inner in node.internal_links if inner.to_socket == output), None)
                if through is None:
                    return None, socket, place
                socket = through.from_socket
            elif node.bl_idname == 'NodeGroupInput' and place.outer is not None:
                place, group = place.outer
                socket = _matching(group.inputs, output.identifier)
            elif node.bl_idname == 'ShaderNodeGroup' and node.node_tree is not None:
                place = Place(place.network, (*place.path, node.name), (place, node))
                end = _group_output(node.node_tree)
                if end is None:
                    return None, socket, place.outer[0]
                socket = _matching(end.inputs, output.identifier)
            else:
                return output, socket, place

    def value(self, node: Node, name: str, instead: float = 0.0) -> Array:
        """Read an input of a node, as the type of that input.

        Parameters
        ----------
        node : Node
        name : str
            The socket's identifier: order, number and labels change between versions of Blender.
        instead : float
            For a socket that this version does not have.

        Returns
        -------
        ndarray
        """
        socket = next((socket for socket in node.inputs if socket.identifier == name), None)
        if socket is None:
            return np.array([instead])
        output, last, place = self.source(socket)
        if output is not None:
            try:
                return convert(place.output(output), output.type, socket.type)
            except (Unreadable, Varies):
                if self.network.strict:
                    raise
                self.network.note(f"'{output.node.name}' is not read; {name} of '{node.name}' keeps its own value")
                last = socket
        return own_value(last, socket.type)

    def linked(self, node: Node, name: str) -> bool:
        """Tell whether something feeds an input."""
        socket = next((socket for socket in node.inputs if socket.identifier == name), None)
        return socket is not None and self.source(socket)[0] is not None

    def output(self, output: Socket) -> Array:
        """Read an output, each once."""
        key = (*self.path, output.node.name, output.identifier)
        if key not in self.network.known:
            self.network.known[key] = self.network.values(self, output.node, output)
        return self.network.known[key]


def _matching(sockets: bpy.types.bpy_prop_collection, identifier: str) -> Socket:
    """Return the socket of a group's node that stands for a socket inside."""
    return next(socket for socket in sockets if socket.identifier == identifier)


def _group_output(tree: bpy.types.NodeTree) -> Node | None:
    ends = [node for node in tree.nodes if node.bl_idname == 'NodeGroupOutput']
    return next((node for node in ends if node.is_active_output), ends[0] if ends else None)


def own_value(socket: Socket, kind: str) -> Array:
    """Return the value that a socket shows, as another type.

    Parameters
    ----------
    socket : NodeSocket
    kind : str
        Such as 'VALUE', 'RGBA' or 'VECTOR'.

    Returns
    -------
    ndarray
    """
    value = getattr(socket, "default_value", None)
    if value is None or isinstance(value, str):
        return convert(np.zeros(1), 'VALUE', kind)
    return convert(np.atleast_1d(np.array(value, dtype=float))[:3], socket.type, kind)


def convert(value: Array, kind: str, wanted: str) -> Array:
    """Return a value as another type of socket, as Blender does.

    Parameters
    ----------
    value : ndarray of shape (..., 1) or (..., 3)
    kind, wanted : str
        Such as 'VALUE', 'RGBA' or 'VECTOR'.

    Returns
    -------
    ndarray of shape (..., 1) or (..., 3)
    """
    if wanted in _NUMBERS:
        if value.shape[-1] == 1:
            return value
        return (value @ LUMINANCE)[..., None] if kind == 'RGBA' else value.mean(axis=-1, keepdims=True)
    return value if value.shape[-1] == 3 else np.repeat(value, 3, axis=-1)
