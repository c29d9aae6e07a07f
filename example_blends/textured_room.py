# SPDX-License-Identifier: GPL-3.0-or-later
"""A room whose floor, rug and picture have images for their color, lit by an area lamp, a point lamp and a spot."""

from math import radians

import bpy
import numpy as np
from building import add, camera, diffuse, lamp
from grids import Grid, box, closed_box, rectangle, without
from numpy.typing import ArrayLike, NDArray

WIDTH, DEPTH, HEIGHT, CELL = 4.0, 4.0, 2.5, 0.125


def textured_room() -> None:
    """Make the room; bake its lighting only, and the images stay as fine as they are."""
    half = WIDTH / 2.0
    white, cream = diffuse("Plaster", (0.78, 0.77, 0.74)), diffuse("Cream Plaster", (0.75, 0.66, 0.50))
    teal = diffuse("Teal Plaster", (0.16, 0.38, 0.40))
    # The rug lies in a hole of the floor: its edge would be a step too low for the mesh to show its shadow.
    boards = without(rectangle((-half, 0, 0), (WIDTH, 0, 0), (0, DEPTH, 0), CELL), (-1.5, 1.0, -9), (0.5, 2.5, 9))
    floor = add("Floor", image_color("Planks", planks()), boards)
    unwrap(floor, (0.5, 0, 0), (0, 0.5, 0))
    add("Ceiling", white, rectangle((-half, 0, HEIGHT), (0, DEPTH, 0), (WIDTH, 0, 0), CELL))
    add("Back Wall", white, rectangle((-half, DEPTH, 0), (WIDTH, 0, 0), (0, 0, HEIGHT), 0.05))
    add("Front Wall", white, rectangle((-half, 0, 0), (0, 0, HEIGHT), (WIDTH, 0, 0), 2 * CELL))
    add("Left Wall", teal, rectangle((-half, 0, 0), (0, DEPTH, 0), (0, 0, HEIGHT), CELL))
    add("Right Wall", cream, rectangle((half, DEPTH, 0), (0, -DEPTH, 0), (0, 0, HEIGHT), CELL))
    _furnish()

    area = lamp('AREA', "Ceiling Lamp", (-0.5, 1.75, 2.4), (-0.5, 1.75, 0.0), 45.0)
    area.shape, area.size, area.size_y, area.color = 'RECTANGLE', 1.0, 0.5, (1.0, 0.93, 0.82)
    point = lamp('POINT', "Reading Lamp", (1.35, 3.1, 1.25), (1.35, 3.1, 0.0), 14.0)
    point.shadow_soft_size, point.color = 0.08, (1.0, 0.72, 0.42)
    spot = lamp('SPOT', "Picture Lamp", (-0.4, 2.4, 2.35), (-0.4, 4.0, 1.55), 28.0)
    spot.spot_size, spot.spot_blend, spot.shadow_soft_size = radians(60.0), 0.6, 0.03
    camera((0.0, -2.6, 1.25), 29.0, (960, 720), clip=2.62)
    bpy.context.scene.view_settings.exposure = -0.15  # lighting, which colors multiply, has to stay below 1


def _furnish() -> None:
    """Add a rug, a framed picture, a cupboard for the reading lamp to stand over, and a stool."""
    oak, blue = diffuse("Oak", (0.42, 0.26, 0.13)), diffuse("Blue Felt", (0.14, 0.22, 0.50))
    fine = CELL / 2.0
    rug = add("Rug", image_color("Weave", weave()), rectangle((-1.5, 1.0, 0), (2, 0, 0), (0, 1.5, 0), CELL))
    unwrap(rug, (0.5, 0, 0), (0, 2.0 / 3.0, 0), (0.75, -2.0 / 3.0))
    add("Frame", oak, *_hung((-1.0, 1.1), (0.2, 2.0), 0.06, 0.05, fine))
    canvas = _hung((-0.95, 1.15), (0.15, 1.95), 0.07, 0.01, fine)
    picture = add("Picture", image_color("Landscape", landscape()), *canvas)
    unwrap(picture, (1.0 / 1.1, 0, 0), (0, 0, 1.0 / 0.8), (0.95 / 1.1, -1.15 / 0.8))
    add("Cupboard", oak, *box((0.875, 2.75, 0.0), (1.875, 3.5, 0.75), fine))
    add("Stool", blue, *box((-1.75, 2.875, 0.0), (-1.25, 3.375, 0.4375), fine))


def _hung(low: tuple[float, float], high: tuple[float, float], front: float, deep: float, cell: float) -> list[Grid]:
    """Mesh a board on the back wall between two points (x, z), its face so far in front of the wall [m]."""
    y = DEPTH - front
    return closed_box((low[0], y, low[1]), (high[0], y + deep, high[1]), cell)


def image_color(name: str, pixels: NDArray[np.float64]) -> bpy.types.Material:
    """Make a diffuse material whose color is an image, which is packed into the file.

    Parameters
    ----------
    pixels : ndarray of shape (height, width, 3)
        sRGB, lowest row first, 0 to 1.
    """
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height)
    image.pixels.foreach_set(np.dstack([pixels, np.ones((height, width))]).astype(np.float32).ravel())
    image.pack()
    material = diffuse(name, (0.5, 0.5, 0.5))
    tree = material.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image, texture.location = image, (-300, 0)
    tree.links.new(texture.outputs["Color"], tree.nodes["Diffuse BSDF"].inputs["Color"])
    return material


def unwrap(obj: bpy.types.Object, u: ArrayLike, v: ArrayLike, start: ArrayLike = (0.0, 0.0)) -> None:
    """Give an object texture coordinates: the products of its positions with two vectors, plus a start."""
    mesh = obj.data
    points, corners = np.zeros(3 * len(mesh.vertices), np.float32), np.zeros(len(mesh.loops), np.int32)
    mesh.vertices.foreach_get("co", points)
    mesh.loops.foreach_get("vertex_index", corners)
    places = points.reshape(-1, 3)[corners] @ np.transpose([u, v]) + start
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", places.astype(np.float32).ravel())


def planks() -> NDArray[np.float64]:
    """Draw 2 m x 2 m of wooden planks, sixteen rows of them."""
    random = np.random.default_rng(5)
    rows, size = 16, 256
    y, x = np.mgrid[:size, :size]
    row = y * rows // size
    shift = random.integers(0, size, rows)[row]
    half = (x + shift) % size * 2 // size
    tone = random.uniform(0.75, 1.1, (rows, 2))[row, half]
    # The grain runs along the planks: noise that is long in x and short in y.
    grain = np.repeat(random.normal(0.0, 0.035, (size, size // 16)), 16, axis=1)
    seam = (y % (size // rows) == 0) | ((x + shift) % (size // 2) == 0)
    wood = (tone + grain)[..., None] * (0.72, 0.52, 0.34)
    return np.where(seam[..., None], 0.45 * wood, wood).round(2).clip(0.0, 1.0)


def weave() -> NDArray[np.float64]:
    """Draw a rug: lozenges inside a border."""
    y, x = np.mgrid[:96, :128]
    lozenge = (np.abs(x % 32 - 15.5) + np.abs(y % 32 - 15.5)) < 12
    border = (x < 8) | (x >= 120) | (y < 8) | (y >= 88)
    inner = np.where(lozenge[..., None], (0.90, 0.82, 0.66), (0.66, 0.16, 0.14))
    return np.where(border[..., None], (0.80, 0.66, 0.36), inner)


def landscape() -> NDArray[np.float64]:
    """Draw hills under an evening sun."""
    y, x = np.mgrid[:128, :176] / 128.0
    sky = np.stack([0.95 - 0.35 * y, 0.45 + 0.25 * y, 0.30 + 0.55 * y], axis=-1)
    picture = np.where((np.hypot(x - 0.95, y - 0.55) < 0.13)[..., None], (0.97, 0.90, 0.55), sky)
    hills = ((0.42, 5.0, (0.35, 0.42, 0.62)), (0.30, 7.0, (0.20, 0.45, 0.35)), (0.14, 4.0, (0.10, 0.28, 0.14)))
    for level, wave, color in hills:
        picture = np.where((y < level + 0.08 * np.sin(wave * x + 9.0 * level))[..., None], color, picture)
    return picture
