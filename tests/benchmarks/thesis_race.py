# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's room: ours at every quality, the thesis's program, and Cycles at the patches' centres as the judge."""

import re
import subprocess
import time
from argparse import Namespace
from collections.abc import Iterator
from math import pi

import numpy as np
from mathutils.kdtree import KDTree
from numpy.typing import NDArray

from core.meshing import Patches, mesh
from core.scene import Scene
from core.scene_text import read_scene_text, rectangles_to_scene
from core.settings import Settings

from . import cycles, machine, measure, tables
from .meshes import grid
from .one_bake import bake_room
from .scenes import Item, Part

FloatArray = NDArray[np.float64]

# The thesis's own method holds n * n numbers: it is measured patch by patch up to this size only.
DENSE_PATCHES = 6000


def main(options: Namespace) -> None:
    """Race at every size asked for and write a table."""
    rows = [row for factor in options.factors for row in _race(factor, options)]
    head = ["program", "patches", "seconds", "mean radiosity", "off Cycles' mean", "rms error at patches"]
    options.output.mkdir(parents=True, exist_ok=True)
    text = f"Machine: {machine.description()}\n\n{tables.table(head, rows)}\n"
    (options.output / "race.md").write_text(text)
    print(text)


def _race(factor: int, options: Namespace) -> Iterator[list[str]]:
    """Yield the rows of one size."""
    scene = rectangles_to_scene(read_scene_text(options.room), factor)
    patches = mesh(scene)
    count = len(patches.area)
    first, second, took = _at_centres(scene, patches, options.samples)
    truth = (first + second).mean() / 2
    yield [f"Cycles, {options.samples} samples", f"{count:_}", f"{took:.1f}", f"{truth:.4f}", "", ""]

    settings = {
        f"Radiosity, {quality}": Settings(method=options.method, quality=quality) for quality in options.qualities
    }
    if count <= DENSE_PATCHES:
        settings["Radiosity, the thesis's method"] = Settings(method="gathering", form_factors="centre", tolerance=0.0)
    for name, chosen in settings.items():
        baked, seconds = bake_room(options.room, factor, chosen)
        radiosity = baked.solution.radiosity
        off = tables.percent(radiosity.mean() / truth - 1)
        error = tables.percent(_error(patches, radiosity, first, second))
        yield [name, f"{count:_}", f"{seconds:.2f}", f"{radiosity.mean():.4f}", off, error]

    if options.opponent:
        count, seconds, mean = _opponent(options, factor)
        off = tables.percent(mean / truth - 1)
        yield [options.opponent.name, f"{count:_}", f"{seconds:.2f}", f"{mean:.4f}", off, ""]


def _opponent(options: Namespace, factor: int) -> tuple[int, float, float]:
    """Run the thesis's program; return its number of patches, its time and its mean radiosity."""
    command = [str(options.opponent.resolve()), str(options.room), str(factor), str(options.iterations)]
    start = time.perf_counter()
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    seconds = time.perf_counter() - start
    patches, mean = re.match(r"(\d+)", said), re.search(r"mean ([\d.]+)", said)
    if patches is None or mean is None:
        raise RuntimeError(f"{options.opponent} said what cannot be read: {said}")
    return int(patches[1]), seconds, float(mean[1])


def _at_centres(scene: Scene, patches: Patches, samples: int) -> tuple[FloatArray, FloatArray, float]:
    """Return two Cycles bakes of the radiosity at the patches' centres, and how long the second one took."""
    corners = scene.vertices[scene.corner_vertex].reshape(-1, 4, 3)
    # Twice as fine as the patches: every patch has a vertex in its middle.
    sizes = (2 * scene.divisions).tolist()
    parts = [
        Part(grid(quad, size, size), tuple(reflectance), tuple(exitance / pi))
        for quad, size, reflectance, exitance in zip(corners, sizes, scene.reflectance, scene.emission, strict=True)
    ]
    items = [Item("Room", tuple(parts), front_only=True)]
    objects = cycles.build(items)
    geometry = cycles.read(items, objects)
    tree = KDTree(len(geometry.corner_vertex))
    for index, position in enumerate(geometry.vertices[geometry.corner_vertex].tolist()):
        tree.insert(position, index)
    tree.balance()
    corner = np.array([tree.find(centre)[1] for centre in patches.centre.tolist()])
    first, _ = cycles.bake(objects, samples, 1)
    second, seconds = cycles.bake(objects, samples, 2)
    return pi * first[corner], pi * second[corner], seconds


def _error(patches: Patches, radiosity: FloatArray, first: FloatArray, second: FloatArray) -> float:
    """Return the rms error of luminance over its mean, off the emitters and off centres that are under boxes."""
    lit = ~patches.emission.any(axis=1) & ((first + second) > 0).any(axis=1)
    everywhere = measure.Points(np.arange(len(lit)), lit)
    return measure.error(everywhere, radiosity, first, second)
