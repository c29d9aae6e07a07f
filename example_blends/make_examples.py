# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the example scenes: ``python example_blends/make_examples.py [NAME ...]`` with the bpy wheel (`make examples`).

Every surface is a grid whose faces look towards the side that is lit, since vertex colours are as fine as the mesh. The
files in the repository are saved by Blender 4.2, the oldest one supported: a newer one's file would not open there.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from building import add, camera, diffuse, emission
from daylight import daylight
from grids import Grid, box, closed_box, even, grid, inside, prism, rectangle, stops, without
from numpy.typing import NDArray
from still_life import still_life
from textured_room import textured_room

FOLDER = Path(__file__).resolve().parent


def cornell_box() -> None:
    """Make Cornell's box as it was measured (Cornell University Program of Computer Graphics, "The Cornell Box Data").

    Positions are the published ones in millimetres, walls not quite square and not quite flat. Colours are the
    published spectra as linear sRGB under D65; the lamp's are its emission at 700, 600 and 500 nm.
    """

    def metres(*points: tuple[float, float, float]) -> NDArray[np.float64]:
        """Turn published points (x to the left, y up, z away) into Blender's axes, the camera at x = 0."""
        x, y, z = np.array(points).T / 1000.0
        return np.stack([0.278 - x, z, y], axis=1)

    white = diffuse("White", (0.738, 0.736, 0.740))
    red, green = diffuse("Red", (0.490, 0.050, 0.051)), diffuse("Green", (0.069, 0.398, 0.087))
    wall = even(20)
    floor = metres((552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2))
    back = metres((549.6, 0, 559.2), (0, 0, 559.2), (0, 548.8, 559.2), (556.0, 548.8, 559.2))
    right = metres((0, 0, 559.2), (0, 0, 0), (0, 548.8, 0), (0, 548.8, 559.2))
    left = metres((552.8, 0, 0), (549.6, 0, 559.2), (556.0, 548.8, 559.2), (556.0, 548.8, 0))
    add("Floor", white, grid(floor, wall, wall))
    add("Back Wall", white, grid(back, wall, wall))
    add("Green Wall", green, grid(right, wall, wall))
    add("Red Wall", red, grid(left, wall, wall))

    # The lamp fills a hole in the ceiling, whose grid lines run along its edges.
    low, high = metres((343.0, 548.8, 227.0), (213.0, 548.8, 332.0))
    ceiling = metres((0, 548.8, 0), (556.0, 548.8, 0), (556.0, 548.8, 559.2), (0, 548.8, 559.2))
    across = stops((0, 213, 8), (213, 343, 5), (343, 556, 8)) / 556.0
    along = stops((0, 227, 8), (227, 332, 4), (332, 559.2, 8)) / 559.2
    add("Ceiling", white, without(grid(ceiling, across, along), np.subtract(low, (0, 0, 1)), np.add(high, (0, 0, 1))))
    lamp = metres((213.0, 548.8, 227.0), (343.0, 548.8, 227.0), (343.0, 548.8, 332.0), (213.0, 548.8, 332.0))
    add("Lamp", emission("Lamp", (1.0, 15.6 / 18.4, 8.0 / 18.4), 18.4), grid(lamp, even(5), even(4)))

    short = metres((130.0, 165.0, 65.0), (82.0, 165.0, 225.0), (240.0, 165.0, 272.0), (290.0, 165.0, 114.0))
    tall = metres((423.0, 330.0, 247.0), (265.0, 330.0, 296.0), (314.0, 330.0, 456.0), (472.0, 330.0, 406.0))
    add("Short Block", white, *prism(short[:, :2], 0.0, 0.165, 0.02))
    add("Tall Block", white, *prism(tall[:, :2], 0.0, 0.330, 0.02))
    camera((0.0, -0.8, 0.273), 35.0, (720, 720), sensor=25.0)
    bpy.context.scene.view_settings.exposure = 1.0


def thesis_room() -> None:
    """Make the room of the scene file beside this script, twice as fine: 2624 quads (the thesis's y points up)."""
    sys.path.insert(0, str(FOLDER.parent))
    from core.scene_text import EMITTER, read_scene_text

    materials: dict[tuple[float, ...], bpy.types.Material] = {}
    for number, part in enumerate(read_scene_text(FOLDER / "thesis_room.txt"), start=1):
        color = np.asarray(part.colour) * part.factor
        emits = part.kind == EMITTER
        if (light := (emits, *color)) not in materials:
            # The file's factor is an exitance; Blender's strength is a radiance, which is a pi-th of it.
            lamp = emission("Lamp", part.colour, part.factor / np.pi) if emits else None
            materials[light] = lamp or diffuse("Surface", color)
        corners, normal = (points[..., [0, 2, 1]] * (1.0, -1.0, 1.0) for points in (part.corners, part.normal))
        if np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ normal < 0.0:
            corners = corners[::-1]
        lines = even(2 * part.divisions)
        add(f"{'Emitter' if emits else 'Rectangle'} {number:02}", materials[light], grid(corners, lines, lines))
    camera((0.5, -2.2, 0.5), 42.0, (720, 720), clip=1.21)
    bpy.context.scene.view_settings.exposure = 1.5


def furnace() -> None:
    """Make a closed room where everything emits a radiance of 1 and reflects half: all must read 1 / (1 - 0.5) = 2."""
    material = diffuse("Furnace", (0.5, 0.5, 0.5))
    tree = material.node_tree
    reflects, output = tree.nodes["Diffuse BSDF"], tree.nodes["Material Output"]
    emits, both = tree.nodes.new('ShaderNodeEmission'), tree.nodes.new('ShaderNodeAddShader')
    emits.inputs["Color"].default_value, emits.inputs["Strength"].default_value = (1.0, 1.0, 1.0, 1.0), 1.0
    tree.links.new(reflects.outputs[0], both.inputs[0])
    tree.links.new(emits.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], output.inputs["Surface"])
    # The pillar stands in a hole of the floor: what it hid would be the one dark place.
    low, high = (-0.4, 0.0, 0.0), (0.0, 0.4, 1.2)
    room = inside(closed_box((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0), 0.2))
    add("Room", material, *(without(part, np.subtract(low, (0, 0, 1)), high) for part in room))
    add("Pillar", material, *box(low, high, 0.2))
    camera((0.0, -3.4, 1.0), 36.0, (720, 720), clip=2.45)
    bpy.context.scene.view_settings.exposure = -2.0  # 2 would be shown as white: 2 / 2^2 is a middle grey


def two_rooms() -> None:
    """Make a house of two rooms, 4 m x 4 m each: one has a lamp, the other what comes through the door."""
    cell, width, depth, height, thick = 0.125, 4.0, 4.0, 2.5, 0.125
    door_low, door_high, lintel = 1.0, 2.25, 2.125
    white, wood = diffuse("Plaster", (0.78, 0.77, 0.74)), diffuse("Boards", (0.48, 0.33, 0.21))
    orange, blue = diffuse("Orange Plaster", (0.72, 0.30, 0.10)), diffuse("Blue Plaster", (0.16, 0.30, 0.58))
    inner = thick / 2.0

    for name, start, sign, side in (("Lit", inner, 1.0, orange), ("Dark", -inner, -1.0, blue)):
        far = start + sign * width
        x0 = min(start, far)
        add(f"{name} Floor", wood, rectangle((x0, 0, 0), (width, 0, 0), (0, depth, 0), cell))
        add(f"{name} Back Wall", white, rectangle((x0, depth, 0), (width, 0, 0), (0, 0, height), cell))
        add(f"{name} Front Wall", white, rectangle((x0, 0, 0), (0, 0, height), (width, 0, 0), cell))
        add(f"{name} Side Wall", side, _wall(far, 0.0, depth, height, cell, -sign))
        part = _wall(start, 0.0, depth, height, cell, sign)
        add(f"{name} Door Wall", white, without(part, (-9, door_low, -9), (9, door_high, lintel)))
        if sign < 0.0:
            add("Dark Ceiling", white, rectangle((x0, 0, height), (0, depth, 0), (width, 0, 0), cell))
    # The lamp fills a hole in the ceiling of the lit room.
    lit = rectangle((inner, 0, height), (0, depth, 0), (width, 0, 0), cell)
    lamp_low, lamp_high = (inner + 1.25, 1.5), (inner + 2.25, 2.5)
    add("Lit Ceiling", white, without(lit, (*lamp_low, 0), (*lamp_high, 9)))
    lamp = rectangle((*lamp_low, height), (0, 1, 0), (1, 0, 0), cell)
    add("Lamp", emission("Lamp", (1.0, 0.86, 0.66), 14.0), lamp)
    add(
        "Door Frame",
        white,
        _wall_y(door_low, -inner, inner, lintel, cell, 1.0),
        _wall_y(door_high, -inner, inner, lintel, cell, -1.0),
        rectangle((-inner, door_low, lintel), (0, door_high - door_low, 0), (thick, 0, 0), cell),
    )
    add("Door Sill", wood, rectangle((-inner, door_low, 0), (thick, 0, 0), (0, door_high - door_low, 0), cell))
    # What the camera sees of the wall between the rooms where its view begins.
    add("Wall Section", white, rectangle((-inner, 0.02, 0), (thick, 0, 0), (0, 0, height), cell))
    _furnish(inner, cell / 2.0)
    camera((0.0, -4.0, 1.5), 17.5, (1280, 432), clip=4.01, shift=-0.02)
    bpy.context.scene.view_settings.exposure = 1.25


def _wall(x: float, low: float, high: float, height: float, cell: float, sign: float) -> Grid:
    """Mesh an upright wall across X that is lit from +X (sign 1) or from -X."""
    start, edge = (low, high - low) if sign > 0.0 else (high, low - high)
    return rectangle((x, start, 0), (0, edge, 0), (0, 0, height), cell)


def _wall_y(y: float, low: float, high: float, height: float, cell: float, sign: float) -> Grid:
    """Mesh an upright wall across Y that is lit from +Y (sign 1) or from -Y."""
    start, edge = (high, low - high) if sign > 0.0 else (low, high - low)
    return rectangle((start, y, 0), (edge, 0, 0), (0, 0, height), cell)


def _furnish(inner: float, cell: float) -> None:
    """Put furniture into the rooms, on the lines of the floor's grid, so that its shadow ends where it stands."""
    oak, linen = diffuse("Oak", (0.42, 0.26, 0.13)), diffuse("Linen", (0.70, 0.66, 0.58))
    green, grey = diffuse("Green Felt", (0.18, 0.42, 0.20)), diffuse("Grey Paint", (0.45, 0.46, 0.48))
    x, z = inner + 1.25, 0.75
    legs = [(x + dx, 1.75 + dy) for dx in (0.0, 1.375) for dy in (0.0, 0.625)]
    add(
        "Table",
        oak,
        *closed_box((x, 1.75, z - 0.0625), (x + 1.5, 2.5, z), cell),
        *(part for a, b in legs for part in box((a, b, 0.0), (a + 0.125, b + 0.125, z - 0.0625), cell)),
    )
    add("Cupboard", grey, *box((inner + 3.0, 3.375, 0.0), (inner + 3.875, 4.0, 1.75), cell * 2))
    add("Bench", green, *box((inner + 0.5, 3.25, 0.0), (inner + 2.0, 3.75, 0.4375), cell * 2))
    x = -inner - 3.75
    add("Bed", linen, *box((x, 2.0, 0.0), (x + 1.5, 4.0, 0.5), cell * 2))
    cotton = diffuse("Red Cotton", (0.62, 0.12, 0.10))
    add("Pillow", cotton, *box((x + 0.375, 3.5, 0.5), (x + 1.125, 3.875, 0.625), cell))
    add("Chest", oak, *box((-inner - 1.5, 3.25, 0.0), (-inner - 0.5, 3.75, 0.625), cell))


EXAMPLES: dict[str, Callable[[], None]] = {
    "cornell_box": cornell_box,
    "thesis_room": thesis_room,
    "furnace": furnace,
    "two_rooms": two_rooms,
    "daylight": daylight,
    "textured_room": textured_room,
    "still_life": still_life,
}


def make(name: str, folder: Path = FOLDER) -> Path:
    """Make one example in a new file and save it, beside this script if nothing else is said."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.save_version = 0
    scene = bpy.context.scene
    scene.world = None
    scene.render.engine = 'CYCLES'
    scene.cycles.samples = 256
    scene.view_settings.view_transform = 'Standard'
    EXAMPLES[name]()
    path = folder / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    meshes = [obj.data for obj in scene.objects if obj.type == 'MESH']
    vertices, faces = (sum(len(getattr(mesh, what)) for mesh in meshes) for what in ("vertices", "polygons"))
    print(f"{path.name}: {len(meshes)} objects, {vertices} vertices, {faces} faces, {path.stat().st_size // 1024} kB")
    return path


if __name__ == "__main__":
    for wanted in sys.argv[1:] or EXAMPLES:
        make(wanted)
