# SPDX-License-Identifier: GPL-3.0-or-later
"""Export of a bake as glTF: unlit meshes whose COLOR_0 is the light, re-read before the file counts as written.

Blender's own exporter writes the file. Which of a mesh's color attributes becomes COLOR_0, and whether materials of a
mesh lose it, has changed with its versions; so it is given meshes that have one attribute, in a range that no version
wraps around, and what it wrote is compared with what it was given.
"""

from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.errors import RadiosityError
from .display_scene import DisplayScene, display_scene
from .glb import Glb, Primitive, mesh_primitives, read_glb, write_glb
from .outputs import replacing
from .wording import last_line

# COLOR_0 is stored in steps of 1/65535 or finer.
_COLOR_STEP = 1.0 / 65535.0


def export_glb(
    path: Path,
    depsgraph: bpy.types.Depsgraph,
    attribute: str = "Radiosity",
    exposure: float | str | None = None,
    *,
    copies: bool = False,
    lighting: bool = False,
    notes: list[str] | None = None,
) -> float:
    """Export the objects that have a baked attribute, and the scene's camera, as a binary glTF file.

    Parameters
    ----------
    path : Path
        The file; replaced once the new one is complete and right.
    depsgraph : bpy.types.Depsgraph
        The evaluated state of the scene that was baked.
    attribute : str
        Name of the baked color attribute.
    exposure : float or str, optional
        Stops; as for `display_scene` when not given. Colors are clamped to [0, 1] after it, as glTF demands (3.7.2.1).
    copies : bool
        Whether to export the baked copies, and not what was baked in place.
    lighting : bool
        Whether the attribute is lighting only; as for `display_scene`.
    notes : list of str, optional
        What the file cannot hold is added.

    Returns
    -------
    float
        The exposure that was applied [stops].

    Raises
    ------
    RadiosityError
        If nothing is baked, if the exporter is missing or fails, or if it wrote other colors than were baked; no file
        is left then, and an older one stays.
    """
    with (
        display_scene(depsgraph, attribute, exposure, copies=copies, lighting=lighting) as shown,
        replacing(path) as temporary,
    ):
        _run_exporter(temporary, shown.scene)
        glb = read_glb(temporary)
        check_colors(glb, shown)
        _name_as_in_scene(glb, shown.names)
        write_glb(temporary, glb)
        if notes is not None:
            notes += _clamped(shown)
        return shown.stops


def _clamped(shown: DisplayScene) -> list[str]:
    """Tell what is lost where light above 1 falls on images, which would have made it darker again."""
    # What single precision rounds up from 1 is not lost.
    bright = shown.brightness > 1.0 + 1e-6
    if not bright.any():
        return []
    # Rounded to a tenth of a stop downwards.
    fits = np.floor(10.0 * (shown.stops - np.log2(shown.brightness.max()))) / 10.0
    return [
        f"glTF: {bright.mean():.1%} of the lighting on images is brighter than 1, where the file's colors end, and is "
        f"clipped; --exposure {fits:.1f} keeps all of it"
    ]


def _run_exporter(path: Path, scene: bpy.types.Scene) -> None:
    """Let Blender's exporter write a whole scene."""
    # It wants a window, and shows its scene in it. The context of a background command has none; the file has.
    windows = bpy.context.window_manager.windows
    window = bpy.context.window or (windows[0] if windows else None)
    if window is None:
        raise RadiosityError("The glTF exporter needs a window: save the .blend once from Blender's interface")
    users_scene, users_layer = window.scene, window.view_layer
    try:
        with bpy.context.temp_override(window=window):
            window.scene = scene
            bpy.ops.export_scene.gltf(
                filepath=str(path),
                check_existing=False,
                export_format='GLB',
                use_active_scene=True,
                export_cameras=True,
                export_animations=False,
                export_vertex_color='ACTIVE',
                export_all_vertex_colors=False,
                export_active_vertex_color_when_no_material=True,
            )
    except AttributeError as error:
        raise RadiosityError("Blender's glTF exporter is not there: enable the add-on glTF 2.0 format") from error
    except RuntimeError as error:
        raise RadiosityError(f"Blender's glTF exporter failed: {last_line(error)}") from error
    finally:
        window.scene = users_scene
        window.view_layer = users_layer


def check_colors(glb: Glb, shown: DisplayScene) -> None:
    """Compare the colors in a file with those of the scene that it was exported from, triangle by triangle.

    Parameters
    ----------
    glb : Glb
        The exported file, still with the names of the copies.
    shown : DisplayScene
        What was exported.

    Raises
    ------
    RadiosityError
        If an object's triangles or colors differ, or its material would be lit once more by the viewer.
    """
    written: dict[str, list[Primitive]] = {}
    for primitive in mesh_primitives(glb):
        written.setdefault(primitive.mesh, []).append(primitive)
    for copy in shown.objects:
        problem = _compare(written.get(copy.data.name, []), copy.data, shown.textured)
        if problem:
            raise RadiosityError(
                f"Blender's glTF exporter did not write \"{shown.names[copy.name]}\" as it was baked: {problem}. "
                "No file was written; update Blender or its glTF add-on, and try again"
            )


def _compare(primitives: list[Primitive], mesh: bpy.types.Mesh, textured: frozenset[str]) -> str | None:
    """Return what is wrong with the exported triangles of a mesh, or None."""
    positions, colors = _mesh_triangles(mesh)
    if any(primitive.colors is None for primitive in primitives):
        return "a material has no COLOR_0"
    if not all(primitive.unlit for primitive in primitives):
        return "a material is not unlit"
    if any(primitive.textured != (primitive.material in textured) for primitive in primitives):
        return "a material has lost its image, or got one"
    count = sum(len(primitive.positions) for primitive in primitives)
    if count != len(positions):
        return f"{count} triangles instead of {len(positions)}"
    # Sorted by where they are, because the exporter groups them by material. Sorting is stable: of triangles that lie
    # in the same place the first stays the first.
    exported = np.concatenate([primitive.positions for primitive in primitives])
    order, exported_order = _order(positions), _order(exported)
    if not np.array_equal(positions[order], exported[exported_order]):
        return "triangles have moved"
    exported_colors = np.concatenate([primitive.colors for primitive in primitives if primitive.colors is not None])
    error = np.abs(exported_colors[exported_order] - colors[order]).max()
    return f"COLOR_0 is off by {error:.3g}" if error > _COLOR_STEP else None


def _mesh_triangles(mesh: bpy.types.Mesh) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners of a mesh's triangles in glTF's axes (t, 3, 3), and their colors (t, 3, 4)."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners, slots = np.zeros(count * 3, np.int32), np.zeros(count, np.int32)
    mesh.loop_triangles.foreach_get("loops", corners)
    mesh.loop_triangles.foreach_get("material_index", slots)
    corners = corners.reshape(-1, 3)[np.argsort(slots, kind="stable")]
    vertices, points = np.zeros(len(mesh.loops), np.int32), np.zeros(len(mesh.vertices) * 3, np.float32)
    mesh.loops.foreach_get("vertex_index", vertices)
    mesh.vertices.foreach_get("co", points)
    layer = mesh.color_attributes[0]
    colors = np.zeros(len(layer.data) * 4, np.float32)
    layer.data.foreach_get("color", colors)

    x, y, z = points.reshape(-1, 3).astype(np.float64)[vertices[corners]].transpose(2, 0, 1)
    element = corners if layer.domain == 'CORNER' else vertices[corners]
    # glTF's y is up, Blender's z.
    return np.stack([x, z, -y], axis=-1), colors.reshape(-1, 4)[element].astype(np.float64)


def _order(triangles: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the stable order of triangles by the coordinates of their corners."""
    # 0.0 and -0.0 are the same place.
    return np.lexsort(triangles.reshape(-1, 9).T + 0.0)


def _name_as_in_scene(glb: Glb, names: dict[str, str]) -> None:
    """Give everything in a file the name of what it was copied from."""
    for kind in ("scenes", "nodes", "meshes", "materials"):
        for item in glb.document.get(kind, []):
            item["name"] = names.get(item["name"], item["name"])
