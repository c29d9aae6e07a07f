# SPDX-License-Identifier: GPL-3.0-or-later
"""A passing scene that shows a bake and nothing else: what the glTF export writes and the picture draws.

Everything in it is a copy, so the user's objects, meshes, materials and selection are not touched: meshes as they are
after their modifiers, with the baked colors exposed and clamped as their only color attribute, and with materials
that show this attribute unlit. The scene and its copies are gone afterwards, whatever happens.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ..core.errors import RadiosityError
from ..core.exposure import automatic_exposure, expose
from .copies.collection import COPY_OF, originals_shown
from .materials import read_material
from .placement import place
from .rendered import rendered_objects
from .scene_reader import world_matrix
from .unlit import unlit_materials

# Copies are told from each other by name, whatever kind they are; Blender numbers those that are already taken.
_SCENE, _CAMERA, _OBJECT = "radiosity-scene", "radiosity-camera", "radiosity-object"
_MESH = "radiosity-mesh"


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
    """

    scene: bpy.types.Scene
    objects: tuple[bpy.types.Object, ...]
    stops: float
    names: dict[str, str]


@dataclass(frozen=True, eq=False)
class _Part:
    """A baked object: a copy of its evaluated mesh, and what else is needed to show that."""

    name: str
    mesh_name: str
    mesh: bpy.types.Mesh
    matrix: Matrix
    materials: tuple[bpy.types.Material | None, ...]
    colors: NDArray[np.float64]
    domain: str
    emitting: NDArray[np.bool_]


@contextmanager
def display_scene(
    depsgraph: bpy.types.Depsgraph,
    attribute: str,
    exposure: float | None = None,
    *,
    copies: bool = False,
    see_through: bool = False,
) -> Iterator[DisplayScene]:
    """Build a scene that shows a baked attribute; remove it afterwards.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        The evaluated state of the scene that was baked.
    attribute : str
        Name of the color attribute. Only meshes that have it, and that renders show, are in the scene.
    exposure : float, optional
        Stops. When not given: the exposure that the scene's own color management sets, else an automatic one.
    copies : bool
        Whether to show the baked copies, and not what was baked in place.
    see_through : bool
        Whether renders show no face from behind, even where the user's material does.

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
            parts = list(_read_parts(depsgraph, attribute, copies, made))
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
        materials = unlit_materials(sources, attribute, see_through, made)
        names.update({copy.name: name or attribute for name, copy in materials.items()})
        objects = []
        for part in parts:
            _show_colors(part, attribute, stops, [materials[m.name_full if m else None] for m in part.materials])
            objects.append(_place(part, scene, made))
            names[part.mesh.name] = part.mesh_name
            names[objects[-1].name] = part.name
        yield DisplayScene(scene, tuple(objects), stops, names)
    finally:
        if scene is not None:
            bpy.data.scenes.remove(scene)
        bpy.data.batch_remove(made)


def _read_parts(
    depsgraph: bpy.types.Depsgraph, attribute: str, copies: bool, made: list[bpy.types.ID]
) -> Iterator[_Part]:
    """Copy the evaluated mesh of every baked object, and read its colors."""
    for obj in rendered_objects(depsgraph.view_layer, copies=copies):
        if obj.type != 'MESH' or attribute not in obj.data.color_attributes:
            continue
        evaluated = obj.evaluated_get(depsgraph)
        mesh = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
        mesh.name = _MESH
        made.append(mesh)
        # The exporter does this too, which may take faces away: before the colors are read, not after.
        mesh.validate(clean_customdata=False)
        baked = mesh.color_attributes.get(attribute)
        if baked is None or not mesh.polygons:
            continue  # modifiers have left nothing of it
        colors = np.zeros(len(baked.data) * 4, np.float32)
        baked.data.foreach_get("color", colors)
        materials = tuple(slot.material for slot in obj.material_slots) or (None,)
        yield _Part(
            name=obj.get(COPY_OF, obj.name),
            mesh_name=obj.data.name,
            mesh=mesh,
            matrix=Matrix(world_matrix(obj, depsgraph).tolist()),
            materials=materials,
            colors=colors.reshape(-1, 4)[:, :3].astype(np.float64),
            domain=baked.domain,
            emitting=_emitting(mesh, materials, baked.domain),
        )


def _emitting(mesh: bpy.types.Mesh, materials: tuple[bpy.types.Material | None, ...], domain: str) -> NDArray[np.bool_]:
    """Return which corners or vertices belong to lamps, which need not be shown below white."""
    shines = np.array([read_material(material).emission.any() for material in materials])
    faces = shines[_slots(mesh, len(materials))]
    sizes, vertices = np.zeros(len(mesh.polygons), np.int32), np.zeros(len(mesh.loops), np.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    corners = np.repeat(faces, sizes)
    if domain == 'CORNER':
        return corners
    mesh.loops.foreach_get("vertex_index", vertices)
    emitting = np.zeros(len(mesh.vertices), bool)
    emitting[vertices[corners]] = True
    return emitting


def _slots(mesh: bpy.types.Mesh, count: int) -> NDArray[np.int32]:
    """Return the material slot of each face; as in Blender, what is beyond the last is in the last."""
    slots = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    return np.clip(slots, 0, count - 1)


def _choose_stops(scene: bpy.types.Scene, parts: list[_Part], exposure: float | None) -> float:
    """Return the exposure that is asked for, else the scene's own, else one that suits all colors together [stops]."""
    if exposure is not None:
        return exposure
    if scene.view_settings.exposure != 0.0:
        return float(scene.view_settings.exposure)
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


def _show_colors(part: _Part, attribute: str, stops: float, materials: list[bpy.types.Material]) -> None:
    """Leave a mesh one color attribute, ready for a display, and give it the materials that show it."""
    mesh = part.mesh
    # Changing the list of slots sets every face to the first.
    slots = _slots(mesh, len(materials))
    mesh.materials.clear()
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", slots)

    for name in [layer.name for layer in mesh.color_attributes]:
        mesh.color_attributes.remove(mesh.color_attributes[name])
    layer = mesh.color_attributes.new(attribute, 'FLOAT_COLOR', part.domain)
    colors = np.ones((len(part.colors), 4), np.float32)
    colors[:, :3] = expose(part.colors, stops)
    layer.data.foreach_set("color", colors.ravel())
    # The exporter's "active" is the one for rendering.
    mesh.color_attributes.render_color_index = 0
    mesh.color_attributes.active_color_index = 0


def _place(part: _Part, scene: bpy.types.Scene, made: list[bpy.types.ID]) -> bpy.types.Object:
    """Put a mesh into the scene where the object it was copied from stands."""
    copy = bpy.data.objects.new(_OBJECT, part.mesh)
    made.append(copy)
    scene.collection.objects.link(copy)
    place(copy, part.matrix)
    return copy
