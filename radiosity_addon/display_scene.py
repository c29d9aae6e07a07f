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
from .rendered import rendered_objects
from .scene_reader import world_matrix

# Copies are told from each other by name, whatever kind they are; Blender numbers those that are already taken.
_SCENE, _CAMERA, _OBJECT = "radiosity-scene", "radiosity-camera", "radiosity-object"
_MESH, _MATERIAL = "radiosity-mesh", "radiosity-material"


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


@contextmanager
def display_scene(
    depsgraph: bpy.types.Depsgraph, attribute: str, exposure: float | None = None, *, see_through: bool = False
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
        parts = list(_read_parts(depsgraph, attribute, made))
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
        materials = _show_materials(parts, attribute, see_through, made)
        names.update({copy.name: name or attribute for name, copy in materials.items()})
        objects = []
        for part in parts:
            _show_colors(part, attribute, stops, [materials[m.name if m else None] for m in part.materials])
            objects.append(_place(part, scene, made))
            names[part.mesh.name] = part.mesh_name
            names[objects[-1].name] = part.name
        yield DisplayScene(scene, tuple(objects), stops, names)
    finally:
        if scene is not None:
            bpy.data.scenes.remove(scene)
        bpy.data.batch_remove(made)


def _read_parts(depsgraph: bpy.types.Depsgraph, attribute: str, made: list[bpy.types.ID]) -> Iterator[_Part]:
    """Copy the evaluated mesh of every baked object, and read its colors."""
    for obj in rendered_objects(depsgraph.view_layer):
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
        yield _Part(
            name=obj.name,
            mesh_name=obj.data.name,
            mesh=mesh,
            matrix=Matrix(world_matrix(obj, depsgraph).tolist()),
            materials=tuple(slot.material for slot in obj.material_slots) or (None,),
            colors=colors.reshape(-1, 4)[:, :3].astype(np.float64),
            domain=baked.domain,
        )


def _choose_stops(scene: bpy.types.Scene, parts: list[_Part], exposure: float | None) -> float:
    """Return the exposure that is asked for, else the scene's own, else one that suits all colors together [stops]."""
    if exposure is not None:
        return exposure
    if scene.view_settings.exposure != 0.0:
        return float(scene.view_settings.exposure)
    return automatic_exposure(np.concatenate([part.colors for part in parts]))


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


def _show_materials(
    parts: list[_Part], attribute: str, see_through: bool, made: list[bpy.types.ID]
) -> dict[str | None, bpy.types.Material]:
    """Make one unlit material for each of the user's, by name, and one for faces without any, by None."""
    copies: dict[str | None, bpy.types.Material] = {}
    for source in (material for part in parts for material in part.materials):
        name = source.name if source else None
        if name not in copies:
            copies[name] = bpy.data.materials.new(_MATERIAL)
            made.append(copies[name])
            copies[name].use_backface_culling = bool(source and source.use_backface_culling)
            _show_attribute(copies[name], attribute, see_through)
    return copies


def _show_attribute(material: bpy.types.Material, attribute: str, see_through: bool) -> None:
    """Let a material show a color attribute, whatever light falls on it.

    A color that goes straight into the surface is what the glTF exporter takes for KHR_materials_unlit, and what Cycles
    takes for emission of that radiance; an Emission node in between would make the exporter write white.
    """
    if material.node_tree is None:
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new('ShaderNodeOutputMaterial')
    shown = nodes.new('ShaderNodeVertexColor')
    shown.layer_name = attribute
    surface = shown.outputs["Color"]
    if see_through:
        # Cycles knows culling only as nodes; the exporter would not understand them.
        mix = nodes.new('ShaderNodeMixShader')
        links.new(nodes.new('ShaderNodeNewGeometry').outputs["Backfacing"], mix.inputs[0])
        links.new(surface, mix.inputs[1])
        links.new(nodes.new('ShaderNodeBsdfTransparent').outputs["BSDF"], mix.inputs[2])
        surface = mix.outputs["Shader"]
    links.new(surface, output.inputs["Surface"])


def _show_colors(part: _Part, attribute: str, stops: float, materials: list[bpy.types.Material]) -> None:
    """Leave a mesh one color attribute, ready for a display, and give it the materials that show it."""
    mesh = part.mesh
    # Changing the list of slots sets every face to the first.
    slots = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    mesh.materials.clear()
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.clip(slots, 0, len(materials) - 1))

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
    copy.matrix_world = part.matrix
    location, rotation, scale = part.matrix.decompose()
    error = np.abs(np.array(Matrix.LocRotScale(location, rotation, scale)) - np.array(part.matrix)).max()
    # A stretched parent shears its children, which no location, rotation and scale can say.
    if error > 1e-5 * max(1.0, *(abs(s) for s in scale)):
        copy.matrix_world = Matrix.Identity(4)
        part.mesh.transform(part.matrix)
        if part.matrix.determinant() < 0.0:
            part.mesh.flip_normals()
    return copy
