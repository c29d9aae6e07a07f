# SPDX-License-Identifier: GPL-3.0-or-later
"""Color attributes of meshes: made, filled and shown; and what bytes lose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.errors import RadiosityError
from .destination import BYTE, Destination

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

# Bytes hold up to 1; what rounds to that is not cut off.
_WHITE = 1.0 + 0.5 / 255.0


def store_colors(mesh: bpy.types.Mesh, destination: Destination, colors: FloatArray) -> None:
    """Get or create the color attribute of a mesh, fill it, and make it the active one.

    Parameters
    ----------
    mesh : bpy.types.Mesh
    destination : Destination
    colors : ndarray of shape (n, 3)
        Linear, one for each corner or vertex.

    Raises
    ------
    RadiosityError
        When Blender does not take the name.
    """
    name, kind = destination.attribute, (destination.domain, destination.data_type)
    existing = mesh.color_attributes.get(name)
    if existing is not None and (existing.domain, existing.data_type) != kind:
        mesh.color_attributes.remove(existing)
        existing = None
    layer = existing or mesh.color_attributes.new(name, destination.data_type, destination.domain)
    if layer is None or layer.name != name:
        raise RadiosityError(
            f"Blender does not give mesh '{mesh.name_full}' an attribute '{name}': choose another name"
        )
    rgba = np.ones((len(colors), 4), dtype=np.float32)
    # Bytes are clamped here and not by Blender, whose versions may differ in what they do with 256.
    # Floats end where single precision does: a bake that did not converge must not become infinite.
    rgba[:, :3] = np.clip(colors, 0.0, 1.0 if destination.data_type == BYTE else np.finfo(np.float32).max)
    layer.data.foreach_set("color", rgba.ravel())
    mesh.attributes.active_color_name = name
    mesh.attributes.default_color_name = name
    mesh.update()


class ByteLoss:
    """Counts the colors that bytes cannot hold.

    Parameters
    ----------
    destination : Destination
        Tells whether there are bytes at all.
    """

    def __init__(self, destination: Destination) -> None:
        self._bytes = destination.data_type == BYTE
        self._clipped = self._total = 0

    def add(self, colors: FloatArray) -> None:
        """Look at some colors, shape (n, 3)."""
        self._clipped += int(np.count_nonzero((colors > _WHITE).any(axis=1)))
        self._total += len(colors)

    def warnings(self) -> list[str]:
        """Tell what was lost, in one line or none."""
        if not (self._bytes and self._clipped):
            return []
        return [
            f"{self._clipped / self._total:.1%} of the colors are brighter than 1, where bytes end, and are clipped; "
            "store floats to keep them, or lower the light"
        ]
