# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the example scenes, leave pictures of them in ``pictures/``: ``python make_pictures.py [NAME ...]``.

thesis_room is the thesis's figures 26 to 28: the same room of 656, 5904 and 16 400 patches, side by side. Others stand
beside what Cycles makes of the same scene, camera and exposure: ours on the left.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).resolve().parent
PICTURES = FOLDER / "pictures"
SCENES = ("cornell_box", "two_rooms")
THESIS_ROOM, FACTORS = "thesis_room", (1, 3, 5)
EXPOSURE = "2.3"  # the same for all three [stops]
GAP = 8  # pixels between pictures that stand side by side
BESIDE_CYCLES = {
    "daylight": ("--target", "copy"),
    "textured_room": ("--light", "lighting"),  # images stay as fine as they are
    "still_life": ("--target", "copy"),  # instances have no mesh of their own
}
SAMPLES, BOUNCES = 256, 32  # of Cycles


def bake(scene: Path, picture: Path, *options: str) -> None:
    """Bake with the command, in a process of its own; only the picture is kept."""
    command = [sys.executable, str(FOLDER / "bake.py"), str(scene), "--render", str(picture), *options]
    subprocess.run(command, check=True)


def pixels(path: Path) -> NDArray[np.float32]:
    """Return a picture as an array of shape (height, width, 4), lowest row first."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    values = np.zeros(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, 4)


def trace(scene: Path, picture: Path) -> None:
    """Draw a scene with Cycles at half the size of a bake's picture, its noise removed."""
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.engine, render.filepath, render.resolution_percentage = 'CYCLES', str(picture), 50
    render.image_settings.file_format, render.image_settings.color_mode = 'PNG', 'RGB'
    cycles.device, cycles.samples, cycles.seed = 'CPU', SAMPLES, 0
    cycles.use_denoising, cycles.use_adaptive_sampling = True, False
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES
    cycles.sample_clamp_indirect = 0.0  # it would take light away
    bpy.ops.render.render(write_still=True)


def square(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Cut the sides off a wide picture."""
    height, width = picture.shape[:2]
    start = (width - height) // 2
    return picture[:, start : start + height]


def halved(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Make one pixel of each two by two."""
    height, width, channels = picture.shape
    return picture.reshape(height // 2, 2, width // 2, 2, channels).mean(axis=(1, 3))


def side_by_side(parts: list[NDArray[np.float32]], target: Path) -> None:
    """Put pictures of one height into one."""
    gap = np.ones((parts[0].shape[0], GAP, 4), dtype=np.float32)
    row = np.concatenate([piece for part in parts for piece in (gap, part)][1:], axis=1)
    image = bpy.data.images.new(target.stem, row.shape[1], row.shape[0])
    image.pixels.foreach_set(row.ravel())
    image.filepath_raw, image.file_format = str(target), 'PNG'
    image.save()


def beside_cycles(name: str) -> None:
    """Bake a scene and put Cycles' picture beside the bake's."""
    scene = FOLDER / f"{name}.blend"
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = Path(folder) / "ours.png", Path(folder) / "cycles.png"
        bake(scene, ours, "--quality", "medium", *BESIDE_CYCLES[name])
        trace(scene, theirs)
        side_by_side([halved(pixels(ours)), pixels(theirs)], PICTURES / f"{name}.png")


def thesis_room() -> None:
    """Bake the room at three sizes, with the thesis's method."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{factor}.png" for factor in FACTORS]
        for factor, path in zip(FACTORS, paths, strict=True):
            room = FOLDER / f"{THESIS_ROOM}.txt"
            bake(room, path, "--method", "gathering", "--subdivide", str(factor), "--exposure", EXPOSURE)
        side_by_side([square(pixels(path)) for path in paths], PICTURES / f"{THESIS_ROOM}.png")


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or (*SCENES, THESIS_ROOM, *BESIDE_CYCLES):
        if name == THESIS_ROOM:
            thesis_room()
        elif name in BESIDE_CYCLES:
            beside_cycles(name)
        else:
            bake(FOLDER / f"{name}.blend", PICTURES / f"{name}.png")
