# SPDX-License-Identifier: GPL-3.0-or-later
"""What a world of nodes looks like all around: Cycles renders it, as a small picture and close up where a sun stands.

A sun is too small and too bright to be found by chance among the directions of a sky. So what is far brighter than the
rest is rendered again, finely, and becomes a lamp of its own; the sky goes on without it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from math import acos, pi
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.cells import widened
from ..core.lighting.lamps import Lamp, SkyLamp, SunLamp
from .materials.copies import lacking_images, readable_copy
from .materials.images import NEUTRAL
from .wording import last_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Window = tuple[int, int, int, int]

ROWS = 90  # of the picture, twice as many columns
CLOSER = 12  # times as many where a sun stands
SAMPLES, CLOSE_SAMPLES = 64, 256
SUNS = 4  # at most
GLARE = 20.0  # times the mean radiance is the brightness of a sun
RIM = 0.05  # share of a sun's brightness that still belongs to it
AROUND = 3  # pixels to each side that are looked at closely
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_NAME = "radiosity-sky"
_RESULT = "Render Result"


def render_sky(world: bpy.types.World, notes: list[str]) -> tuple[Lamp, ...]:
    """Render a world and return its light.

    Parameters
    ----------
    world : bpy.types.World
    notes : list of str
        What went wrong is added.

    Returns
    -------
    tuple of Lamp
        A sky, and its suns.
    """
    if not hasattr(bpy.types.Scene, "cycles"):
        notes.append(f"World '{world.name_full}' gives no light: Cycles, which reads its nodes, is not enabled")
        return ()
    for image in lacking_images(world.node_tree):
        notes.append(f"World '{world.name_full}': {image}; {NEUTRAL} is used in its place")
    try:
        with _scene(world) as scene:
            sky = _render(scene, ROWS, (0, ROWS, 0, 2 * ROWS), SAMPLES)
            suns = []
            taken = np.zeros((CLOSER * ROWS, 2 * CLOSER * ROWS), bool)
            while len(suns) < SUNS and (sun := _take_sun(scene, sky, taken, world.name_full)) is not None:
                suns.append(sun)
    except RuntimeError as error:
        notes.append(f"World '{world.name_full}' gives no light: Cycles says {last_line(error)}")
        return ()
    return (SkyLamp(world.name_full, sky), *suns) if sky.any() else tuple(suns)


def _take_sun(scene: bpy.types.Scene, sky: Array, taken: NDArray[np.bool_], name: str) -> SunLamp | None:
    """Turn the brightest spot of a sky into a lamp and fill its place, or return None where nothing is that bright.

    What became a lamp is marked in `taken`, of the fine picture, and not taken again.
    """
    brightness = sky @ LUMINANCE
    solid = _solid_angles(ROWS)[:, None]
    mean = float((brightness * solid).sum() / (4.0 * pi))
    top = int(brightness.argmax())
    if brightness.flat[top] <= GLARE * mean:
        return None
    row, column = divmod(top, 2 * ROWS)
    low, high = max(0, row - AROUND), min(ROWS, row + AROUND + 1)
    # Meridians meet at the poles.
    wide = AROUND / max(float(np.cos(np.pi * (abs(row + 0.5 - 0.5 * ROWS) / ROWS))), 0.05)
    left, right = max(0, int(column - wide)), min(2 * ROWS, int(column + wide) + 1)
    window = tuple(CLOSER * edge for edge in (low, high, left, right))
    close = _render(scene, CLOSER * ROWS, window, CLOSE_SAMPLES)
    weight, directions = _pixels(CLOSER * ROWS, window)
    part = taken[window[0] : window[1], window[2] : window[3]]
    bright = np.where(part, 0.0, close @ LUMINANCE)
    # A rim covers a little of the pixels beside.
    inside = widened(bright > RIM * bright.max()) & ~part
    # What surrounds the sun shines behind it too, and behind those that were taken before.
    around = ~inside & ~part
    behind = np.median(close[around], axis=0) if around.any() else np.zeros(3)
    close[part] = behind
    part |= inside
    glare = np.maximum(close - behind, 0.0) * inside[..., None] * weight[..., None]
    light = glare @ LUMINANCE
    if not light.any():
        return None
    rest = close * weight[..., None] - glare
    coarse = rest.reshape(high - low, CLOSER, right - left, CLOSER, 3).sum(axis=(1, 3))
    sky[low:high, left:right] = coarse / solid[low:high, :, None]
    direction = (light[..., None] * directions).sum(axis=(0, 1))
    # As large as an even disc whose light is as concentrated.
    size = min(float(light.sum() ** 2 / (light**2 / weight).sum()), 2.0 * pi)
    angle = 2.0 * acos(1.0 - size / (2.0 * pi))
    return SunLamp(name, glare.sum(axis=(0, 1)), direction / np.linalg.norm(direction), angle)


def _solid_angles(rows: int) -> Array:
    """Return the solid angle of a pixel of each row of a picture of the whole sky."""
    edges = np.sin(np.pi * (np.arange(rows + 1) / rows - 0.5))
    return np.asarray(np.diff(edges) * np.pi / rows)


def _pixels(rows: int, window: Window) -> tuple[Array, Array]:
    """Return solid angles and directions of the pixels in a window: (h, w) and (h, w, 3)."""
    low, high, left, right = window
    height = np.pi * ((np.arange(low, high) + 0.5) / rows - 0.5)[:, None]
    turn = np.pi * (1.0 - (np.arange(left, right) + 0.5) / rows)[None]
    flat = np.cos(height)
    directions = np.stack(
        [flat * np.cos(turn), flat * np.sin(turn), np.broadcast_to(np.sin(height), (high - low, right - left))], axis=-1
    )
    return np.broadcast_to(_solid_angles(rows)[low:high, None], directions.shape[:2]), directions


@contextmanager
def _scene(world: bpy.types.World) -> Iterator[bpy.types.Scene]:
    """Give a scene that shows what a world lights with, and nothing else, all around, for as long as the block runs.

    That is a copy of the world: a world may show cameras something else.
    """
    known = _RESULT in bpy.data.images
    scene = bpy.data.scenes.new(_NAME)
    data = bpy.data.cameras.new(_NAME)
    camera = bpy.data.objects.new(_NAME, data)
    made: list[bpy.types.ID] = [camera, data]
    try:
        scene.world, scene.camera = readable_copy(world, made), camera
        scene.world.cycles_visibility.camera = True
        scene.collection.objects.link(camera)
        data.type = 'PANO'
        # From 5.0 on the camera has it itself.
        (data if hasattr(data, "panorama_type") else data.cycles).panorama_type = 'EQUIRECTANGULAR'
        # Towards x, so that the picture begins and ends at -x.
        camera.rotation_euler = (0.5 * pi, 0.0, -0.5 * pi)
        render, cycles = scene.render, scene.cycles
        render.engine = 'CYCLES'
        render.use_compositing = render.use_sequencer = render.film_transparent = False
        render.image_settings.file_format = 'OPEN_EXR'
        render.image_settings.color_depth = '32'
        render.resolution_percentage = 100
        cycles.device = 'CPU'
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.pixel_filter_type, cycles.seed = 'BOX', 0
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        yield scene
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.batch_remove(made)
        if not known and _RESULT in bpy.data.images:
            bpy.data.images.remove(bpy.data.images[_RESULT])


def _render(scene: bpy.types.Scene, rows: int, window: Window, samples: int) -> Array:
    """Return the radiance in a window of a picture of the whole sky, shape (h, w, 3), from below to above."""
    low, high, left, right = window
    render = scene.render
    render.resolution_x, render.resolution_y = 2 * rows, rows
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = left / (2 * rows), right / (2 * rows)
    render.border_min_y, render.border_max_y = low / rows, high / rows
    scene.cycles.samples = samples
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sky.exr"
        render.filepath = str(path)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(str(path))
        try:
            width, height = image.size
            values = np.zeros(width * height * image.channels, np.float32)
            image.pixels.foreach_get(values)
            picture = values.reshape(height, width, -1)[..., :3].astype(np.float64)
        finally:
            bpy.data.images.remove(image)
    if picture.shape[:2] != (high - low, right - left):
        raise RuntimeError(f"the picture of the sky has the size {width} x {height}")
    return np.nan_to_num(picture, posinf=0.0, neginf=0.0).clip(0.0)
