# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials as a whole: nowhere in particular, where they are the same everywhere, or at points of a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.mending import BRIGHTEST
from .images import Images
from .network import Network, Place, Unreadable, Varies
from .nodes import read_output
from .shaders import DEFAULT_REFLECTANCE, Shading, read_shader

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .network import Node
    from .points import Points

    Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Surface:
    """How a material takes part in radiosity.

    Attributes
    ----------
    reflectance : ndarray of shape (3,) or (n, 3)
        Diffuse reflectance, not below 0; `core.scene.Scene` caps what is too bright.
    emission : ndarray of shape (3,) or (n, 3)
        Radiant exitance [W/m^2], not below 0: pi times Blender's color times strength.
    passed : ndarray of shape (3,) or (n, 3)
        Share of light that goes straight on behind it, 0 to 1.
    transmittance : ndarray of shape (3,) or (n, 3)
        Share that leaves diffusely on its other side, not below 0.
    specular : ndarray of shape (3,) or (n, 3)
        Share that its clear part reflects of light that comes straight down, 0 to `passed`.
    warnings : tuple of str
        What was read otherwise than Blender would render it.
    """

    reflectance: Array
    emission: Array
    passed: Array
    transmittance: Array
    specular: Array
    warnings: tuple[str, ...] = ()

    @property
    def columns(self) -> Array:
        """All of it side by side, shape (15,) or (n, 15)."""
        return np.concatenate(self.parts, axis=-1)

    @property
    def parts(self) -> tuple[Array, ...]:
        """All of it."""
        return self.reflectance, self.emission, self.passed, self.transmittance, self.specular


# How many columns that are.
COLUMNS = 15
OPAQUE = np.zeros(3), np.zeros(3), np.zeros(3)


def read_material(material: bpy.types.Material | None) -> Surface:
    """Read the diffuse reflectance and the emission of a material, nowhere in particular.

    Parameters
    ----------
    material : bpy.types.Material or None
        None stands for an empty slot.

    Returns
    -------
    Surface
        One color each; what depends on the place, or cannot be read, gives way to the socket's own value with a
        warning that names the material.
    """
    return _read(material, Network(read_output, Images(), strict=False))


def read_constant(material: bpy.types.Material | None) -> Surface:
    """Read a material that is the same everywhere.

    Parameters
    ----------
    material : bpy.types.Material or None

    Returns
    -------
    Surface

    Raises
    ------
    Varies
        When it depends on the place.
    Unreadable
        When only Blender can tell.
    """
    return _read(material, Network(read_output, Images()))


def read_points(material: bpy.types.Material, points: Points, images: Images, *, strict: bool = True) -> Surface:
    """Read a material at points of a mesh.

    Parameters
    ----------
    material : bpy.types.Material
    points : Points
    images : Images
        Those that were read before are not read again.
    strict : bool
        Whether what cannot be read raises; else the socket's own value is taken, with a warning.

    Returns
    -------
    Surface
        One row for each of the points.

    Raises
    ------
    Unreadable
    """
    surface = _read(material, Network(read_output, images, points, strict))
    count = len(points.samples.triangle)
    return Surface(*(np.broadcast_to(part, (count, part.shape[-1])) for part in surface.parts), surface.warnings)


def _read(material: bpy.types.Material | None, network: Network) -> Surface:
    if material is None:
        return Surface(np.full(3, DEFAULT_REFLECTANCE), np.zeros(3), *OPAQUE)
    if not uses_nodes(material):
        return Surface(np.array(material.diffuse_color[:3], dtype=float).clip(0.0), np.zeros(3), *OPAQUE)
    output = output_node(material.node_tree)
    if output is None:
        network.note("it has no Material Output node and is black")
        shading = Shading()
    elif not output.inputs["Surface"].is_linked and output.inputs["Volume"].is_linked:
        # Blender shows no surface round fog.
        network.note("its volume is left out, and light goes through")
        shading = Shading(passed=np.ones(3))
    else:
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                shading = read_shader(Place(network), output.inputs["Surface"])
        except RecursionError as error:
            raise Unreadable("a network of very many nodes") from error
    colors = (shading.reflectance, shading.radiance, shading.transmittance)
    if any((color < 0.0).any() for color in colors):
        network.note("a negative color or strength counts as 0")
    if not all(np.isfinite(color).all() for color in colors):
        network.note("a color or strength that is not a finite number counts as 0")
    # A surface of radiance L has the exitance pi L.
    return Surface(
        _clean(shading.reflectance),
        np.pi * _clean(shading.radiance),
        _clean(shading.passed).clip(0.0, 1.0),
        _clean(shading.transmittance),
        _clean(shading.specular).clip(0.0, 1.0),
        tuple(f"Material '{material.name_full}': {note}" for note in network.notes),
    )


def _clean(values: Array) -> Array:
    """Return values that light can have, three where they are grey."""
    values = np.broadcast_to(values, np.broadcast_shapes(values.shape, (3,)))
    # What single precision cannot multiply any more would end as infinite in paint.
    return np.nan_to_num(values, posinf=0.0, neginf=0.0).clip(0.0, BRIGHTEST / np.pi)


def uses_nodes(material: bpy.types.Material) -> bool:
    """Tell whether a material is made of nodes."""
    # From 5.0 on every material is, and asking for `use_nodes` warns that it will go.
    return material.node_tree is not None and (bpy.app.version >= (5, 0, 0) or material.use_nodes)


def output_node(node_tree: bpy.types.ShaderNodeTree) -> Node | None:
    """Return the active output, the one for Cycles where renderers have their own."""
    kinds = ('CYCLES', 'ALL', 'EEVEE')
    return next((output for kind in kinds if (output := node_tree.get_output_node(kind)) is not None), None)


__all__ = ["OPAQUE", "Surface", "Unreadable", "Varies", "read_constant", "read_material", "read_points"]
