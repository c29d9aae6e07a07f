# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the example scenes, leave pictures of them in ``pictures/``: ``python make_pictures.py [NAME ...]``.

thesis_room is the thesis's figures 26 to 28: the same room of 656, 5904 and 16 400 patches, side by side.
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


def square(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Cut the sides off a wide picture."""
    height, width = picture.shape[:2]
    start = (width - height) // 2
    return picture[:, start : start + height]


def side_by_side(paths: list[Path], target: Path) -> None:
    """Put the middles of pictures of one height into one."""
    parts = [square(pixels(path)) for path in paths]
    gap = np.ones((parts[0].shape[0], GAP, 4), dtype=np.float32)
    row = np.concatenate([piece for part in parts for piece in (gap, part)][1:], axis=1)
    image = bpy.data.images.new(target.stem, row.shape[1], row.shape[0])
    image.pixels.foreach_set(row.ravel())
    image.filepath_raw, image.file_format = str(target), 'PNG'
    image.save()


def thesis_room() -> None:
    """Bake the room at three sizes, with the thesis's method."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{factor}.png" for factor in FACTORS]
        for factor, path in zip(FACTORS, paths, strict=True):
            room = FOLDER / f"{THESIS_ROOM}.txt"
            bake(room, path, "--method", "gathering", "--subdivide", str(factor), "--exposure", EXPOSURE)
        side_by_side(paths, PICTURES / f"{THESIS_ROOM}.png")


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or (*SCENES, THESIS_ROOM):
        if name == THESIS_ROOM:
            thesis_room()
        else:
            bake(FOLDER / f"{name}.blend", PICTURES / f"{name}.png")
