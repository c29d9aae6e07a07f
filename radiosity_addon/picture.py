# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of a bake: Cycles draws the baked attribute and computes no light of its own."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import bpy

from ..core.errors import RadiosityError
from .camera import fit_camera
from .display_scene import display_scene
from .outputs import replacing
from .scene_reader import read_scene
from .wording import last_line

LONGER_SIDE = 960  # of the picture [pixels]
SAMPLES = 16  # enough for smooth edges, as nothing else is noisy
WALLS = 64  # seen through from behind, at most
_RESULT = "Render Result"


def render_picture(
    path: Path,
    depsgraph: bpy.types.Depsgraph,
    attribute: str = "Radiosity",
    exposure: float | str | None = None,
    *,
    copies: bool = False,
    lighting: bool = False,
) -> float:
    """Draw the objects that have a baked attribute, through the scene's camera or else through a fitted one.

    The picture has the proportions of the scene's renders. Without a camera of its own a room is looked into through
    its open side, or else through the walls that turn their back.

    Parameters
    ----------
    path : Path
        The PNG file, replaced once the new one is complete.
    depsgraph : bpy.types.Depsgraph
        The evaluated state of the scene that was baked.
    attribute : str
        Name of the baked color attribute.
    exposure : float or str, optional
        Stops; as for `display_scene` when not given.
    copies : bool
        Whether to draw the baked copies, and not what was baked in place.
    lighting : bool
        Whether the attribute is lighting only; as for `display_scene`.

    Returns
    -------
    float
        The exposure that was applied [stops].

    Raises
    ------
    RadiosityError
        If nothing is baked, Cycles is missing, or the file cannot be written.
    """
    if not hasattr(bpy.types.Scene, "cycles"):
        raise RadiosityError("The picture is drawn by Cycles: enable the add-on Cycles Render Engine")
    fitted = depsgraph.scene.camera is None
    scene = display_scene(
        depsgraph, attribute, exposure, copies=copies, lighting=lighting, see_through=fitted, keep_bright=True
    )
    with scene as shown, replacing(path) as temporary:
        _set_up(shown.scene, temporary)
        with _fitted_camera(shown.scene) if fitted else nullcontext():
            _render(shown.scene)
        if not temporary.is_file():
            raise RadiosityError(f"Cannot write {path}: Cycles has drawn no picture")
        return shown.stops


@contextmanager
def _fitted_camera(scene: bpy.types.Scene) -> Iterator[None]:
    """Give a scene a camera that sees all of it, for as long as the block runs."""
    layer = scene.view_layers[0]
    layer.update()
    camera = fit_camera(scene, read_scene(scene, layer, layer.depsgraph).scene)
    data = camera.data
    # Walls in the way are seen through, so nothing has to be clipped.
    data.clip_start = data.clip_end * 1e-5
    try:
        yield
    finally:
        bpy.data.batch_remove([camera, data])


def _set_up(scene: bpy.types.Scene, path: Path) -> None:
    """Let Cycles draw colors as they are: no world, no bounces, no look."""
    render, cycles = scene.render, scene.cycles
    longer = max(render.resolution_x * render.pixel_aspect_x, render.resolution_y * render.pixel_aspect_y)
    render.resolution_x = round(LONGER_SIDE * render.resolution_x * render.pixel_aspect_x / longer)
    render.resolution_y = round(LONGER_SIDE * render.resolution_y * render.pixel_aspect_y / longer)
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.engine = 'CYCLES'
    render.filepath = str(path)
    render.image_settings.file_format = 'PNG'
    render.image_settings.color_mode = 'RGB'
    render.use_compositing = render.use_sequencer = False
    # Pictures are shown around: they need not tell where the scene lies on whose disk.
    for name in render.bl_rna.properties.keys():
        if name.startswith("use_stamp"):
            setattr(render, name, False)
    cycles.samples, cycles.seed = SAMPLES, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces, cycles.transparent_max_bounces = 0, WALLS
    # The colors are exposed already, and clamped where no image is multiplied with them.
    scene.view_settings.view_transform = 'Standard'
    scene.view_settings.look = 'None'
    scene.view_settings.exposure = 0.0
    scene.view_settings.gamma = 1.0


def _render(scene: bpy.types.Scene) -> None:
    """Render a scene that is not the window's, and leave no image behind."""
    known = _RESULT in bpy.data.images
    try:
        bpy.ops.render.render(write_still=True, scene=scene.name)
    except RuntimeError as error:
        raise RadiosityError(f"Cycles could not draw the picture: {last_line(error)}") from error
    finally:
        if not known and _RESULT in bpy.data.images:
            bpy.data.images.remove(bpy.data.images[_RESULT])
