# SPDX-License-Identifier: GPL-3.0-or-later
"""Where light goes: what each object and instance was when it was read, and which corners of the scene are its own.

None of it refers to Blender's data, which Undo or loading a file may free while a bake runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...core.errors import RadiosityError
from ..wording import counted, listed
from .corner_maps import Carried
from .meshes import Topology

if TYPE_CHECKING:
    from numpy.typing import NDArray

    IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Target:
    """One object or instance that light falls on; `remade.remake` makes its evaluated mesh once more.

    Attributes
    ----------
    object_name : str
        Full name of the object; of an instance, of the object that it is an instance of.
    instancer_name : str
        Full name of the object that makes the instance; `object_name` where it is no instance.
    instance : tuple of int
        Which of the instancer's instances, as Blender keeps telling it; empty where it is no instance.
    receives : bool
        Whether the user wants colors on it.
    evaluated : Topology
        The mesh that was lit: with modifiers, made from a curve, or the instance's.
    first_corner : int
        Where its corners begin in the scene.
    mirrored : bool
        Whether the corners of each of its faces are in opposite order there.
    mesh_name, mesh_uid : str, int
        The object's own mesh, where it has one of its own; the `session_uid`, or 0 for curves and instances.
    corner_vertex : ndarray of shape (c,)
        Vertex of each corner of that mesh when it was read; empty where it has none.
    vertex_count : int
        Vertices of that mesh when it was read.
    scene_corner : ndarray of shape (c,)
        Corner of the scene that each corner of that mesh takes its light from; empty where there is nothing to take.
    carried : Carried
        How that was found.
    """

    object_name: str
    instancer_name: str
    instance: tuple[int, ...]
    receives: bool
    evaluated: Topology
    first_corner: int
    mirrored: bool
    mesh_name: str
    mesh_uid: int
    corner_vertex: IntArray
    vertex_count: int
    scene_corner: IntArray
    carried: Carried

    @property
    def name(self) -> str:
        """Return a name for messages."""
        same = self.object_name == self.instancer_name
        return self.object_name if same else f"{self.instancer_name} > {self.object_name}"

    @property
    def evaluated_corner(self) -> IntArray:
        """Return the corner of the scene for each corner of the evaluated mesh."""
        corner = np.arange(len(self.evaluated.corner_vertex))
        return self.first_corner + (self.evaluated.turned if self.mirrored else corner)


def require_receivers(targets: Iterable[Target]) -> None:
    """Refuse to bake where nothing wants colors.

    Raises
    ------
    RadiosityError
        Says how to want them.
    """
    if not any(target.receives for target in targets):
        raise RadiosityError("No object receives light: switch on Receive in the Radiosity panel of one")


def stored_in_place(targets: Iterable[Target]) -> tuple[list[Target], list[str]]:
    """Choose the targets whose own mesh can take their light.

    Parameters
    ----------
    targets : iterable of Target

    Returns
    -------
    chosen : list of Target
        Those that receive, with a mesh that has corners.
    warnings : list of str
        What gets no colors, and what gets others than those that were computed.
    """
    wanted = [target for target in targets if target.receives]
    chosen = [target for target in wanted if target.mesh_uid and target.carried is not Carried.NOWHERE]
    warnings = []
    for target in chosen:
        if target.carried is not Carried.SAME:
            way = "carried back to" if target.carried is Carried.FOUND else "brought from the nearest corners to"
            warnings.append(
                f"Object '{target.object_name}': its modifiers change the faces; colors are {way} the original "
                "corners; choose Baked Copy to keep them all"
            )
    grown = Counter(t.object_name for t in wanted if t.mesh_uid and t.carried is Carried.NOWHERE)
    shapes = Counter(t.object_name for t in wanted if not t.mesh_uid and not t.instance)
    copies = Counter(t.object_name for t in wanted if t.instance)
    for names, what, which in (
        (grown, "object", " with faces by modifiers only"),
        (shapes, "object", " without a mesh"),
        (copies, "instance", ""),
    ):
        if names:
            count, gets = counted(names.total(), what), "gets" if names.total() == 1 else "get"
            warnings.append(f"{count}{which} ({listed(names)}) {gets} no colors in place; choose Baked Copy")
    return chosen, warnings
