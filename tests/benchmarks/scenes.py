# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark scenes: rooms that are closed or have an open front, lit by emissive faces alone."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from . import meshes
from .meshes import Mesh, box, cells, grid, join, moved

Colour = tuple[float, float, float]

WHITE: Colour = (0.73, 0.73, 0.73)
RED: Colour = (0.65, 0.05, 0.05)
GREEN: Colour = (0.12, 0.45, 0.15)
BLACK: Colour = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Part:
    """Faces of one material: a mesh, its reflectance and its emitted radiance [W/m^2/sr]."""

    mesh: Mesh
    reflectance: Colour
    radiance: Colour = BLACK


@dataclass(frozen=True, eq=False)
class Item:
    """One object: its parts become material slots of one mesh; parts with the same array of vertices share them.

    In Cycles every face radiates and receives on both sides. `both_sides` tells that nothing hides the back, so that
    this matters; with `front_only` the material of emitters sees to it that their backs are dark.
    """

    name: str
    parts: tuple[Part, ...]
    smooth: bool = False
    both_sides: bool = False
    front_only: bool = False


def cornell(*, hung: bool = True) -> list[Item]:
    """Build Cornell's box as published (mm / 100), non-planar walls and all: 3451 vertices, 3025 faces.

    The lamp hangs a centimetre under the ceiling, which it lights with its back; or the ceiling has a hole for it.

    References
    ----------
    Cornell University Program of Computer Graphics, "Cornell Box Data", 1998.
    """
    floor = _published([(552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)])
    back = _published([(549.6, 0, 559.2), (0, 0, 559.2), (0, 548.8, 559.2), (556, 548.8, 559.2)])
    right = _published([(0, 0, 559.2), (0, 0, 0), (0, 548.8, 0), (0, 548.8, 559.2)])
    left = _published([(552.8, 0, 0), (549.6, 0, 559.2), (556, 548.8, 559.2), (556, 548.8, 0)])
    height = 547.8 if hung else 548.8
    lamp = _published([(343, height, 227), (343, height, 332), (213, height, 332), (213, height, 227)])
    white = [grid(floor, 20, 20), grid(back, 20, 20), _cornell_ceiling(hung)]
    blocks = [
        (165, [(130, 65), (82, 225), (240, 272), (290, 114)]),
        (330, [(423, 247), (265, 296), (314, 456), (472, 406)]),
    ]
    return [
        Item("Walls", (Part(join(*white), WHITE), Part(grid(left, 20, 20), RED), Part(grid(right, 20, 20), GREEN))),
        Item("Blocks", tuple(Part(_cornell_block(*block), WHITE) for block in blocks)),
        Item("Lamp", (Part(grid(lamp, 5, 5), BLACK, (17.0, 12.0, 4.0)),), both_sides=hung),
    ]


def _published(points: Iterable[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """Turn Cornell's y-up millimetres into z-up metres, ten times as large."""
    return [(x / 100, z / 100, y / 100) for x, y, z in points][::-1]


def _cornell_ceiling(whole: bool) -> Mesh:
    """Return the ceiling as one grid, or as a frame around the lamp."""
    if whole:
        return grid(_published([(556, 548.8, 0), (556, 548.8, 559.2), (0, 548.8, 559.2), (0, 548.8, 0)]), 20, 20)
    xs, zs = [0, 213, 343, 556], [0, 227, 332, 559.2]
    frame = []
    for i in range(3):
        for j in range(3):
            if (i, j) != (1, 1):
                x, X, z, Z = xs[i], xs[i + 1], zs[j], zs[j + 1]
                frame.append(cells(_published([(X, 548.8, z), (X, 548.8, Z), (x, 548.8, Z), (x, 548.8, z)]), 0.28))
    return meshes.weld(join(*frame))


def _cornell_block(height: float, base: list[tuple[float, float]]) -> Mesh:
    """Return the five visible sides of a block, 10 x 10 faces each, not welded."""
    top = [(x, height, z) for x, z in base]
    sides = []
    for k in range(4):
        (x0, z0), (x1, z1) = base[k], base[k - 1]
        sides.append([(x0, 0, z0), (x0, height, z0), (x1, height, z1), (x1, 0, z1)])
    return join(*(grid(_published(side), 10, 10) for side in [top, *sides]))


def furnished() -> list[Item]:
    """Build a closed room with a table, chairs, a shelf in the corner and two coloured lamps: about 5 500 faces.

    One lamp is a panel that hangs well below the ceiling, the other a box on the wall.
    """
    room = box((0, 0, 0), (6, 4.5, 2.7), 0.2, inside=True)
    legs = [box((x, y, 0), (x + 0.06, y + 0.06, 0.7), 0.12) for x in (0.0, 1.54) for y in (0.0, 0.84)]
    table = join(box((0, 0, 0.7), (1.6, 0.9, 0.74), 0.08), *legs)
    boards = [box((0.02, 0, z), (1.18, 0.3, z + 0.02), 0.075) for z in (0.1, 0.55, 1.0, 1.45)]
    sides = [box((x, 0, 0), (x + 0.02, 0.3, 1.9), 0.075) for x in (0.0, 1.18)]
    shelf = join(*boards, *sides)
    lamp = cells([(2.2, 2.8, 2.4), (2.2, 3.4, 2.4), (3.4, 3.4, 2.4), (3.4, 2.8, 2.4)], 0.2)
    sconce = box((5.9, 0.63, 1.43), (6.0, 1.17, 1.87), 0.1)
    chest = box((0, 0, 0), (0.9, 0.5, 0.6), 0.09, without="-z")
    return [
        Item("Room", (Part(room, (0.75, 0.72, 0.68)),)),
        Item("Table", (Part(moved(table, (2.0, 1.6, 0)), (0.5, 0.32, 0.18)),)),
        Item("Chair", (Part(moved(_chair(), (2.3, 1.0, 0), turn=8), (0.2, 0.35, 0.55)),)),
        Item("Chair 2", (Part(moved(_chair(), (3.1, 2.9, 0), turn=172), (0.55, 0.2, 0.15)),)),
        Item("Shelf", (Part(moved(shelf, (0.0, 4.2, 0)), (0.6, 0.6, 0.6)),)),
        Item("Chest", (Part(moved(chest, (5.0, 3.2, 0), turn=20), (0.7, 0.65, 0.3)),)),
        Item("Lamp", (Part(lamp, BLACK, (14.0, 10.0, 6.0)),), both_sides=True),
        Item("Sconce", (Part(sconce, BLACK, (3.0, 6.0, 12.0)),)),
    ]


def _chair() -> Mesh:
    """Return a chair at the origin, its back towards -y: seat, back and four legs that run through the seat's rim."""
    seat = box((0, 0, 0.42), (0.42, 0.42, 0.46), 0.06)
    back = box((0, 0, 0.46), (0.42, 0.03, 0.9), 0.06)
    legs = [box((x, y, 0), (x + 0.04, y + 0.04, 0.42), 0.1) for x in (0.0, 0.38) for y in (0.0, 0.38)]
    return join(seat, back, *legs)


def corridor() -> list[Item]:
    """Build a long bright corridor (reflectance 0.88), lit by some faces of the ceiling round the corner."""
    size, height = 0.2, 2.4
    # The plan is an L of three blocks: long arm, corner, short arm; the walls between them are open.
    low_high = [((0, 0), (10, 1.8), "+x"), ((10, 0), (11.8, 1.8), "-x +y"), ((10, 1.8), (11.8, 4.6), "-y")]
    arms = [box((*low, 0), (*high, height), size, inside=True, without=open_) for low, high, open_ in low_high]
    lamp, walls = meshes.split(meshes.weld(join(*arms)), (10.45, 3.4, 2.39), (11.35, 4.2, 2.41))
    bench = box((3.0, 0.1, 0.0), (4.6, 0.5, 0.45), 0.15, without="-z")
    return [
        Item("Walls", (Part(walls, (0.9, 0.88, 0.85)), Part(lamp, BLACK, (30.0, 28.0, 25.0)))),
        Item("Bench", (Part(bench, (0.6, 0.4, 0.3)),)),
    ]


def smooth(*, glowing_ball: bool = False) -> list[Item]:
    """Build smooth triangle meshes (about 8 000 faces) on the floor of a room with a ceiling lamp or a glowing ball."""
    room = meshes.triangulated(box((-2.5, -2, 0), (2.5, 2, 2.6), 0.25, inside=True))
    ring = moved(meshes.tilted(meshes.torus(0.45, 0.16, 48, 20), 25), (1.2, 0.5, 0.45))
    lump = moved(meshes.lumpy_ball(0.55, 4, 0.3), (-1.1, 0.5, 0.62))
    column = moved(meshes.triangulated(meshes.cylinder(0.2, 2.6, 32, 20)), (0.2, -1.2, 0))
    items = [
        Item("Room", (Part(room, (0.7, 0.7, 0.7)),)),
        Item("Torus", (Part(ring, (0.7, 0.3, 0.15)),), smooth=True),
        Item("Lump", (Part(lump, (0.3, 0.5, 0.75)),), smooth=True),
        Item("Column", (Part(column, (0.8, 0.8, 0.75)),), smooth=True),
    ]
    if glowing_ball:
        ball = moved(meshes.icosphere(0.18, 3), (0.1, 0.3, 1.5))
        return [*items, Item("Glow", (Part(ball, BLACK, (20.0, 16.0, 10.0)),), smooth=True)]
    lamp = cells([(-0.5, -0.4, 2.3), (-0.5, 0.6, 2.3), (0.7, 0.6, 2.3), (0.7, -0.4, 2.3)], 0.25)
    return [*items, Item("Lamp", (Part(meshes.triangulated(lamp), BLACK, (9.0, 9.0, 9.0)),), both_sides=True)]


def mixed() -> list[Item]:
    """Build a ten metre room of a few huge faces with a statue of centimetre faces and a coarse crate in it."""
    room = box((0, 0, 0), (10, 8, 3.5), 20.0, inside=True)
    statue = moved(meshes.tilted(meshes.torus(0.3, 0.1, 180, 60, triangles=False), 60), (4.0, 3.5, 1.0))
    plinth = box((3.7, 3.2, 0), (4.3, 3.8, 0.64), 0.04, without="-z")
    crate = box((5.5, 4.0, 0), (6.7, 5.0, 1.1), 5.0, without="-z")
    lamp = grid([(3.5, 4.5, 3.45), (3.5, 6.0, 3.45), (6.0, 6.0, 3.45), (6.0, 4.5, 3.45)], 1, 1)
    return [
        Item("Room", (Part(room, (0.7, 0.68, 0.6)),)),
        Item("Statue", (Part(statue, (0.75, 0.75, 0.7)),), smooth=True),
        Item("Plinth", (Part(plinth, (0.4, 0.4, 0.45)),)),
        Item("Crate", (Part(crate, (0.6, 0.3, 0.15)),)),
        Item("Lamp", (Part(lamp, BLACK, (15.0, 14.0, 12.0)),), both_sides=True),
    ]


SCENES: dict[str, Callable[[], list[Item]]] = {
    "cornell": cornell,
    "cornell_flush": lambda: cornell(hung=False),
    "furnished": furnished,
    "corridor": corridor,
    "smooth": smooth,
    "smooth_glow": lambda: smooth(glowing_ball=True),
    "mixed": mixed,
}


def size(items: Iterable[Item]) -> tuple[int, int]:
    """Return the numbers of vertices and faces."""
    parts = [part.mesh for item in items for part in item.parts]
    arrays = {id(mesh.vertices): len(mesh.vertices) for mesh in parts}
    return sum(arrays.values()), sum(len(mesh.faces) for mesh in parts)
