# SPDX-License-Identifier: GPL-3.0-or-later
"""A passing scene that shows a bake and nothing else: what the glTF export writes and the picture draws.

Everything in it is a copy, so the user's objects, meshes, materials and selection are not touched: meshes as they are
after their modifiers, with the baked colors exposed and clamped as their only color attribute, and with materials
that show this attribute unlit. The scene and its copies are gone afterwards, whatever happens.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.errors import RadiosityError
from ..core.exposure import automatic_exposure, expose, scaled
from .base_textures import base_texture
from .copies.collection import originals_shown
from .display_parts import Part, face_slots, read_parts
from .placement import place
from .unlit import unlit_materials

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

# Copies are told from each other by name, whatever kind they are; Blender numbers those that are already taken.
_SCENE, _CAMERA, _OBJECT = "radiosity-scene", "radiosity-camera", "radiosity-object"
# Exposures that are no number: what suits the light, and what the scene's own color management says.
AUTO, OF_SCENE = "auto", "scene"


@dataclass(frozen=True, eq=False)
class DisplayScene:
    """The passing scene.

    Attributes
    ----------
    scene : bpy.types.Scene
        It holds the copies and, if the user's scene has a camera, a copy of that.
    objects : tuple of bpy.types.Object
        The copies with baked meshes.
    stops : float
        Exposure that was applied to the colors: they were multiplied by 2 to this power.
    names : dict
        Name of a copy (object, mesh, material, camera, scene) -> name of what it was made from.
    textured : frozenset of str
        Names of the copies of materials that multiply the colors with an image.
    brightness : ndarray of shape (n,)
        Brightest channel of each exposed color that an image is multiplied with, not clamped.
    """

    scene: bpy.types.Scene
    objects: tuple[bpy.types.Object, ...]
    stops: float
    names: dict[str, str]
    textured: frozenset[str]
    brightness: FloatArray


@contextmanager
def display_scene(
    depsgraph: bpy.types.Depsgraph,
    attribute: str,
    exposure: float | str | None = None,
    *,
    copies: bool = False,
    lighting: bool = False,
    see_through: bool = False,
    keep_bright: bool = False,
) -> Iterator[DisplayScene]:
    """Build a scene that shows a baked attribute; remove it afterwards.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        The evaluated state of the scene that was baked.
    attribute : str
        Name of the color attribute. Only meshes that have it, and that renders show, are in the scene.
    exposure : float or {'auto', 'scene'}, optional
        Stops, or those that suit the light, or those that the scene's own color management says. When not given: the
        scene's, unless they are 0, which need not have been chosen.
    copies : bool
        Whether to show the baked copies, and not what was baked in place.
    lighting : bool
        Whether the attribute is lighting only, which shows multiplied with what the surfaces reflect: images as they
        are, everything else in the colors, with what it emits.
    see_through : bool
        Whether renders show no face from behind, even where the user's material does.
    keep_bright : bool
        Whether colors above 1 stay so where images are multiplied with them, which may bring them back below.

    Yields
    ------
    DisplayScene
        The scene, which must not be used after the block.

    Raises
    ------
    RadiosityError
        If no mesh has the attribute.
    """
    made: list[bpy.types.ID] = []
    scene = None
    try:
        # Creating data makes the depsgraph old, so everything is read from it first.
        with originals_shown():
            parts = list(read_parts(depsgraph, attribute, made, copies=copies, lighting=lighting))
        if not parts:
            raise RadiosityError(f'No visible mesh has a color attribute "{attribute}": bake it first')
        source = depsgraph.scene
        camera = _copy_camera(depsgraph, made) if source.camera else None
        stops = _choose_stops(source, parts, exposure)

        scene = bpy.data.scenes.new(_SCENE)
        names = {scene.name: source.name}
        _copy_frame(source.render, scene.render)
        if camera is not None:
            names[camera.name] = source.camera.name
            scene.collection.objects.link(camera)
            scene.camera = camera
        sources = [material for part in parts for material in part.materials]
        materials = unlit_materials(sources, attribute, see_through, made, textured=lighting)
        names.update({copy.name: name or attribute for name, copy in materials.items()})
        textured = {materials[m.name_full].name for m in sources if lighting and base_texture(m) is not None}
        objects = []
        for part in parts:
            _show_materials(part, [materials[m.name_full if m else None] for m in part.materials])
            _show_colors(part, attribute, stops, keep_bright)
            objects.append(_place(part, scene, made))
            names[part.mesh.name] = part.mesh_name
            names[objects[-1].name] = part.name
        brightness = np.concatenate([scaled(part.colors[part.textured], stops).max(axis=1) for part in parts])
        yield DisplayScene(scene, tuple(objects), stops, names, frozenset(textured), brightness)
    finally:
        if scene is not None:
            bpy.data.scenes.remove(scene)
        bpy.data.batch_remove(made)


def _choose_stops(scene: bpy.types.Scene, parts: list[Part], exposure: float | str | None) -> float:
    """Return the exposure that is asked for; as a rule the scene's own, or one that suits all colors together [stops].

    Blender's own 0 does not tell whether somebody chose it, which is why it can be asked for.
    """
    if exposure is not None and not isinstance(exposure, str):
        return float(exposure)
    of_scene = float(scene.view_settings.exposure)
    if exposure == OF_SCENE or (exposure is None and of_scene != 0.0):
        return of_scene
    colors, emitting = (np.concatenate([getattr(part, name) for part in parts]) for name in ("colors", "emitting"))
    return automatic_exposure(colors, emitting)


def _copy_frame(source: bpy.types.RenderSettings, target: bpy.types.RenderSettings) -> None:
    """Give a scene the image format that decides how much a camera sees."""
    for name in ("resolution_x", "resolution_y", "pixel_aspect_x", "pixel_aspect_y"):
        setattr(target, name, getattr(source, name))


def _copy_camera(depsgraph: bpy.types.Depsgraph, made: list[bpy.types.ID]) -> bpy.types.Object:
    """Copy the scene's camera to where it stands now, free of parents, constraints and animation."""
    source = depsgraph.scene.camera
    camera = bpy.data.objects.new(_CAMERA, source.data)
    made.append(camera)
    camera.matrix_world = source.evaluated_get(depsgraph).matrix_world
    return camera


def _show_materials(part: Part, materials: list[bpy.types.Material]) -> None:
    """Give a mesh the materials that show its colors."""
    mesh = part.mesh
    # Changing the list of slots sets every face to the first.
    slots = face_slots(mesh, len(materials))
    mesh.materials.clear()
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", slots)


def _show_colors(part: Part, attribute: str, stops: float, keep_bright: bool) -> None:
    """Leave a mesh one color attribute, ready for a display."""
    mesh = part.mesh
    for name in [layer.name for layer in mesh.color_attributes]:
        mesh.color_attributes.remove(mesh.color_attributes[name])
    layer = mesh.color_attributes.new(attribute, 'FLOAT_COLOR', part.domain)
    colors = np.ones((len(part.colors), 4), np.float32)
    colors[:, :3] = expose(part.colors, stops)
    if keep_bright:
        colors[part.textured, :3] = scaled(part.colors[part.textured], stops)
    layer.data.foreach_set("color", colors.ravel())
    # The exporter's "active" is the one for rendering.
    mesh.color_attributes.render_color_index = 0
    mesh.color_attributes.active_color_index = 0


def _place(part: Part, scene: bpy.types.Scene, made: list[bpy.types.ID]) -> bpy.types.Object:
    """Put a mesh into the scene where the object it was copied from stands."""
    copy = bpy.data.objects.new(_OBJECT, part.mesh)
    made.append(copy)
    scene.collection.objects.link(copy)
    place(copy, part.matrix)
    return copy
