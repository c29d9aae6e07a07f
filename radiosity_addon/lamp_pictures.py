# SPDX-License-Identifier: GPL-3.0-or-later
"""What the nodes of lamps do where only Cycles can tell (slides, IES files): it bakes their light on a ball round them.

What a point or spot light shines into each direction becomes its picture; of suns and area lamps the mean is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.lighting.lamps import AreaLamp, Lamp, PointLamp, SunLamp
from ..core.lighting.patterns import Pattern, pattern_directions
from ..core.mending import BRIGHTEST
from .materials.copies import lacking_images, readable_copy
from .materials.cycles_bake import available, bake_colors, make_triangles, passing_scene
from .materials.images import NEUTRAL
from .wording import last_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_NAME = "radiosity-lamp"
# Rings and sectors of a picture; and how close to a spot's rim it goes, beyond which there is no light to be seen.
_RINGS, _SECTORS = 80, 120
_WITHIN = 0.999
# Sizes of the triangles that light falls on, and of an area lamp, at a distance of 1.
_SMALL, _TINY = 1e-3, 0.02
# Differences that are none, relative to the mean.
_EVEN = 1e-3


@dataclass(frozen=True, eq=False)
class _Asked:
    """A lamp that was read as without nodes."""

    lamp: PointLamp | AreaLamp | SunLamp
    light: bpy.types.Light
    axes: Array
    strength: Array
    notes: Sequence[str]


class LampPictures:
    """Lamps that wait for Cycles, as it may only be asked when all else has been read."""

    def __init__(self) -> None:
        self._asked: list[_Asked] = []

    def ask(
        self,
        lamp: PointLamp | AreaLamp | SunLamp,
        light: bpy.types.Light,
        axes: Array,
        strength: Array,
        notes: Sequence[str],
    ) -> None:
        """Want to know what the nodes of a lamp do.

        Parameters
        ----------
        lamp : PointLamp, AreaLamp or SunLamp
            As it would be without nodes.
        light : bpy.types.Light
            Its data, not evaluated.
        axes : ndarray of shape (3, 3)
            Of the object, as columns.
        strength : ndarray of shape (3,)
            What to multiply it with where Cycles cannot be asked.
        notes : sequence of str
            What to tell then.
        """
        self._asked.append(_Asked(lamp, light, axes, strength, notes))

    def finish(self, lamps: Sequence[Lamp], notes: list[str]) -> list[Lamp]:
        """Return lamps, those that were asked for with what their nodes do; what cannot be told is added to notes."""
        answers = {}
        baked: dict[str, tuple[Array, Array] | None] = {}
        for asked in self._asked:
            name = asked.light.name_full
            if name not in baked:
                baked[name] = _bake(asked.light, notes)
            answers[id(asked.lamp)] = _answer(asked, baked[name], notes)
        return [found for lamp in lamps if (found := answers.get(id(lamp), lamp)) is not None]


def _answer(asked: _Asked, baked: tuple[Array, Array] | None, notes: list[str]) -> Lamp | None:
    """Return a lamp with its nodes, None where they let no light out."""
    lamp = asked.lamp
    if baked is None:
        notes += asked.notes
        return _times(lamp, asked.strength) if asked.strength.any() else None
    picture, weight = baked
    mean = (picture * weight[..., None]).sum(axis=(0, 1)) / weight.sum()
    if not mean.any():
        return None
    told = _times(lamp, mean)
    relative = picture / np.where(mean > 0, mean, 1)
    if np.abs(relative - 1)[..., mean > 0].max() < _EVEN:
        return told
    if not isinstance(told, PointLamp):
        notes.append(f"Light '{lamp.name}': what its nodes do is averaged over its surface and all directions")
        return told
    turned = np.linalg.inv(asked.axes / np.linalg.norm(asked.axes, axis=0))
    return replace(told, pattern=Pattern(turned, _widest(asked.light), relative))


def _times(lamp: PointLamp | AreaLamp | SunLamp, color: Array) -> PointLamp | AreaLamp | SunLamp:
    """Return a lamp whose light is multiplied with a color."""
    if isinstance(lamp, PointLamp):
        return replace(lamp, intensity=lamp.intensity * color)
    if isinstance(lamp, AreaLamp):
        return replace(lamp, radiance=lamp.radiance * color)
    return replace(lamp, irradiance=lamp.irradiance * color)


def _widest(light: bpy.types.Light) -> float:
    """Return the angle between a light's axis and where it ends to shine [rad]."""
    return {'POINT': pi, 'SPOT': 0.5 * _WITHIN * getattr(light, "spot_size", pi)}.get(light.type, 0.5 * pi)


def _bake(light: bpy.types.Light, notes: list[str]) -> tuple[Array, Array] | None:
    """Let Cycles bake what the nodes of a light multiply it with, by direction, and how much each direction counts.

    Both are None where it cannot.
    """
    if not available():
        return None
    for image in lacking_images(light.node_tree):
        notes.append(f"Light '{light.name_full}': {image}; {NEUTRAL} is used in its place")
    directions, weight = pattern_directions(_RINGS, _SECTORS, _widest(light))
    if light.type == 'AREA':
        weight = weight * -directions[..., 2]
    try:
        light_of = _light_on_ball(light, directions)
    except RuntimeError as error:
        notes.append(f"Light '{light.name_full}': Cycles says {last_line(error)}")
        return None
    return light_of, weight


def _light_on_ball(light: bpy.types.Light, directions: Array) -> Array:
    """Return what falls on small triangles that face a light at a distance of 1, where it would be 1 without nodes."""
    with passing_scene() as (scene, made):
        bare = readable_copy(light, made)
        _strip(bare)
        source, mesh = bpy.data.objects.new(_NAME, bare), bpy.data.meshes.new(_NAME)
        target = bpy.data.objects.new(_NAME, mesh)
        made += [source, target, mesh]
        outwards = directions.reshape(-1, 3)
        # A sun shines along its axis only.
        make_triangles(mesh, _facing(outwards, np.array((0.0, 0.0, -1.0)) if light.type == 'SUN' else outwards))
        mesh.color_attributes.active_color = mesh.color_attributes.new(_NAME, 'FLOAT_COLOR', 'CORNER')
        white = bpy.data.materials.new(_NAME)
        made.append(white)
        _make_white(white)
        mesh.materials.append(white)
        for obj in (source, target):
            scene.collection.objects.link(obj)
        bake_colors(scene, target, 'DIFFUSE', {'DIRECT'})
        values = np.zeros(4 * len(mesh.loops), np.float32)
        mesh.color_attributes[_NAME].data.foreach_get("color", values)
    colors = np.nan_to_num(values.reshape(-1, 3, 4)[..., :3].astype(float), posinf=0.0).clip(0.0, BRIGHTEST)
    light_there = pi * colors.mean(axis=1).reshape(directions.shape)
    return light_there / -directions[..., 2:] if light.type == 'AREA' else light_there


def _strip(light: bpy.types.Light) -> None:
    """Let a light without nodes give 1 W/m^2 at a distance of 1; an area light as much straight ahead."""
    light.energy = {'SUN': 1.0, 'AREA': pi}.get(light.type, 4 * pi)
    light.color = (1.0, 1.0, 1.0)
    for name, value in (("exposure", 0.0), ("use_temperature", False), ("normalize", True), ("use_shadow", False)):
        if hasattr(light, name):
            setattr(light, name, value)
    if light.type == 'AREA':
        larger = max(light.size, light.size_y, 1e-6)
        light.size, light.size_y, light.spread = _TINY * light.size / larger, _TINY * light.size_y / larger, pi
    elif light.type == 'SUN':
        light.angle = 0.0
    else:
        light.shadow_soft_size = 0.0
        if light.type == 'SPOT':
            light.spot_blend = 0.0


def _make_white(material: bpy.types.Material) -> None:
    """Let a material reflect all light."""
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new('ShaderNodeBsdfDiffuse'), tree.nodes.new('ShaderNodeOutputMaterial')
    shader.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])


def _facing(middle: Array, axis: Array) -> Array:
    """Return corners of small triangles that look against an axis, one after the other, shape (3 n, 3)."""
    axis = np.broadcast_to(axis, middle.shape)
    # Across the axis, whichever way it points.
    u = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    u = _SMALL * u / np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(axis, u)
    return np.stack((middle + u, middle - 0.5 * u - v, middle - 0.5 * u + v), axis=1).reshape(-1, 3)
