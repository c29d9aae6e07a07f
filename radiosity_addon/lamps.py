# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lamps as the core's: power, color, shape and place, as Cycles understands them."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.lighting.lamps import AreaLamp, Cone, Lamp, PointLamp, SunLamp
from ..core.mending import BRIGHTEST, FARTHEST
from .lamp_pictures import LampPictures
from .materials.images import Images
from .materials.network import Network, Place
from .materials.nodes import read_output

if TYPE_CHECKING:
    Array = NDArray[np.float64]

# Cycles takes a lamp without size that is not normalized as if it had this surface.
_POINT_SURFACE = 4.0
_SIZES = ("size", "size_y", "spread", "shadow_soft_size", "spot_size", "spot_blend", "angle")


def read_lamp(
    obj: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    matrix: Array,
    scale: float,
    pictures: LampPictures,
    notes: list[str],
) -> Lamp | None:
    """Read a light object.

    Parameters
    ----------
    obj : bpy.types.Object
        Of the type LIGHT.
    depsgraph : bpy.types.Depsgraph
    matrix : ndarray of shape (4, 4)
        Object space to world space [Blender units].
    scale : float
        Length of a Blender unit [m].
    pictures : LampPictures
        Asked for what the nodes of lamps do where only Cycles can tell.
    notes : list of str
        What is read otherwise than Blender would render it is added.

    Returns
    -------
    Lamp or None
        None where it lights nothing.
    """
    light = obj.evaluated_get(depsgraph).data
    if not obj.visible_diffuse or (light.type == 'AREA' and light.cycles.is_portal):
        return None
    name = f"Light '{obj.name_full}'"
    if not _is_somewhere(light, matrix):
        notes.append(f"{name}: its place or size is no finite number within {FARTHEST:g} m, and it is left out")
        return None
    nodes = _nodes(light)
    power = _power(light, nodes, name, notes)
    if light.energy < 0 or (power < 0).any():
        notes.append(f"{name}: a negative power or color counts as 0")
        power = power.clip(0.0) if light.energy > 0 else np.zeros(3)
    if not power.any():
        return None
    linking = obj.light_linking
    if linking.receiver_collection or linking.blocker_collection:
        notes.append(f"{name}: light linking is not read; it lights everything and everything blocks it")
    axes, centre = matrix[:3, :3], scale * matrix[:3, 3]
    if abs(np.linalg.det(axes)) < 1e-30 and light.type != 'POINT':
        notes.append(f"{name} is scaled to nothing and left out")
        return None
    lamp = _shaped(light, obj.name_full, power, axes, centre, scale)
    if lamp is not None and nodes.unread:
        pictures.ask(lamp, obj.data, axes, nodes.strength, [f"{name}: {note}" for note in nodes.notes])
    return lamp


def _shaped(
    light: bpy.types.Light, name: str, power: Array, axes: Array, centre: Array, scale: float
) -> SunLamp | AreaLamp | PointLamp | None:
    """Give power its shape and place; None where that has no size."""
    if light.type == 'SUN':
        return _sun(light, name, power, axes)
    # Cycles takes units for metres: light weakens with the square of their number.
    power = scale * scale * power
    if light.type == 'AREA':
        return _area(light, name, power, axes, centre, scale)
    return _point(light, name, power, axes, centre, scale)


def _power(light: bpy.types.Light, nodes: _Nodes, name: str, notes: list[str]) -> Array:
    """Return energy times color: watts, or for a sun the irradiance [W/m^2]."""
    strength = np.ones(3)
    if not nodes.unread:
        strength = nodes.strength
        notes += [f"{name}: {note}" for note in nodes.notes]
    color = np.array(light.color, dtype=float)
    # Since 4.5.
    if getattr(light, "use_temperature", False):
        color *= np.array(light.temperature_color[:3], dtype=float)
    with np.errstate(over="ignore", invalid="ignore"):
        power = light.energy * np.exp2(getattr(light, "exposure", 0.0)) * color * strength
    if not np.isfinite(power).all():
        notes.append(f"{name}: a power or color that is not a finite number counts as 0")
    return np.nan_to_num(power, posinf=0.0, neginf=0.0).clip(None, BRIGHTEST)


def _is_somewhere(light: bpy.types.Light, matrix: Array) -> bool:
    """Tell whether a lamp has a place and a size."""
    sizes = np.array([getattr(light, name, 0.0) for name in _SIZES])
    return bool((np.abs(matrix) <= FARTHEST).all() and (np.abs(sizes) <= FARTHEST).all())


@dataclass(frozen=True, eq=False)
class _Nodes:
    """What the nodes of a light do.

    Attributes
    ----------
    strength : ndarray of shape (3,)
        What they multiply it with, as far as they can be read.
    unread : bool
        Whether that is for Cycles to tell.
    notes : tuple of str
        What was not read.
    """

    strength: Array
    unread: bool = False
    notes: tuple[str, ...] = ()


def _nodes(light: bpy.types.Light) -> _Nodes:
    """Read the nodes of a light."""
    with warnings.catch_warnings():
        # From 5.0 on it warns that it will go.
        warnings.simplefilter("ignore", DeprecationWarning)
        nodes = light.node_tree.nodes if light.use_nodes and light.node_tree is not None else ()
    outputs = [node for node in nodes if node.bl_idname == 'ShaderNodeOutputLight']
    if not outputs:
        return _Nodes(np.ones(3))
    output = next((node for node in outputs if node.is_active_output), outputs[0])
    network = Network(read_output, Images(), strict=False)
    found, _, place = Place(network).source(output.inputs["Surface"])
    if found is None:
        return _Nodes(np.zeros(3))
    shader = found.node
    if shader.bl_idname != 'ShaderNodeEmission':
        return _Nodes(np.ones(3), True, (f"its node '{shader.name}' is not read; it shines as without nodes",))
    strength = np.broadcast_to(place.value(shader, "Color") * place.value(shader, "Strength"), 3)
    # What changes with the distance has no picture.
    falls = any(node.bl_idname == 'ShaderNodeLightFalloff' for node in nodes)
    return _Nodes(strength, bool(network.notes) and not falls, tuple(network.notes))


def _sun(light: bpy.types.Light, name: str, power: Array, axes: Array) -> SunLamp:
    angle = min(light.angle, math.pi)
    if not _normalized(light) and angle > 0.0:
        power = power * math.pi * math.sin(0.5 * angle) ** 2
    return SunLamp(name, power, _unit(axes[:, 2]), angle, light.use_shadow)


def _point(light: bpy.types.Light, name: str, power: Array, axes: Array, centre: Array, scale: float) -> PointLamp:
    """Read a point or spot light; the scale of the object does not change its radius."""
    radius = light.shadow_soft_size
    if not _normalized(light):
        power = power * (4.0 * math.pi * radius**2 if radius > 0.0 else _POINT_SURFACE)
    cone = Cone(np.linalg.inv(axes), light.spot_size, light.spot_blend) if light.type == 'SPOT' else None
    soft = light.use_soft_falloff
    return PointLamp(name, power / (4.0 * math.pi), centre, scale * radius, soft, cone, light.use_shadow)


def _area(light: bpy.types.Light, name: str, power: Array, axes: Array, centre: Array, scale: float) -> AreaLamp | None:
    round_shape = light.shape in {'DISK', 'ELLIPSE'}
    height = light.size_y if light.shape in {'RECTANGLE', 'ELLIPSE'} else light.size
    half_u, half_v = 0.5 * scale * light.size * axes[:, 0], 0.5 * scale * height * axes[:, 1]
    area = 4.0 * float(np.linalg.norm(half_u) * np.linalg.norm(half_v)) * (math.pi / 4.0 if round_shape else 1.0)
    if area == 0.0:
        return None
    radiance = power / (math.pi * (area if _normalized(light) else scale * scale))
    direction = -_unit(np.cross(half_u, half_v))
    # Mirrored, the two sides keep the lengths but change the way round.
    if direction @ axes[:, 2] > 0.0:
        direction = -direction
    return AreaLamp(name, radiance, centre, half_u, half_v, direction, round_shape, light.spread, light.use_shadow)


def _normalized(light: bpy.types.Light) -> bool:
    """Tell whether the power stays when the size changes, as it always does before 4.5."""
    return getattr(light, "normalize", True)


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)
