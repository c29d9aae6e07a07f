# SPDX-License-Identifier: GPL-3.0-or-later
"""A hall that the sun and the sky light through four tall windows, 5 m x 8 m."""

import bpy
from building import add, camera, diffuse, lamp, sky
from grids import Grid, box, closed_box, grid, rectangle, stops, without

HALF, NEAR, FAR, HEIGHT = 2.5, -4.0, 4.0, 3.0
THICK = 0.5  # of the wall with the windows: so deep that the camera sees no sky, which no bake has
STARTS, WIDTH, SILL, LINTEL = (0.0, 1.0, 2.0, 3.0), 0.5, 0.75, 2.5
CELL = 0.125
FINE = 0.0625  # where the sun shines


def daylight() -> None:
    """Make the hall; shadows' edges are as sharp as its mesh is fine."""
    white, boards = diffuse("Plaster", (0.78, 0.77, 0.74)), diffuse("Boards", (0.46, 0.32, 0.20))
    _shell(white, boards)
    _windows(white)
    _furnish()
    sun = lamp('SUN', "Sun", (-9.0, -1.0, 6.0), (-1.0, 0.0, -0.8), 22.0)
    sun.color = (1.0, 0.9, 0.75)
    sky((0.45, 0.65, 1.0), 3.0)
    camera((1.2, -3.9, 1.45), 24.0, (960, 720))
    bpy.context.scene.view_settings.exposure = 1.0


def _shell(white: bpy.types.Material, boards: bpy.types.Material) -> None:
    """Add the floor, the ceiling, three walls, and what keeps the sun off their backs."""
    width, depth = 2.0 * HALF, FAR - NEAR
    floor = [(-HALF, NEAR, 0), (HALF, NEAR, 0), (HALF, FAR, 0), (-HALF, FAR, 0)]
    across = (stops((-HALF, -1.75, 6), (-1.75, 0.125, 30), (0.125, HALF, 19)) + HALF) / width
    along = (stops((NEAR, -0.25, 30), (-0.25, FAR, 68)) - NEAR) / depth
    add("Floor", boards, grid(floor, across, along))
    add("Ceiling", white, rectangle((-HALF, NEAR, HEIGHT), (0, depth, 0), (width, 0, 0), 2 * CELL))
    add("Back Wall", white, rectangle((-HALF, FAR, 0), (width, 0, 0), (0, 0, HEIGHT), CELL))
    add("Front Wall", white, rectangle((-HALF, NEAR, 0), (0, 0, HEIGHT), (width, 0, 0), 2 * CELL))
    green = diffuse("Green Plaster", (0.42, 0.55, 0.38))
    add("Side Wall", green, rectangle((HALF, FAR, 0), (0, -depth, 0), (0, 0, HEIGHT), CELL))

    low, high = (-HALF - THICK, NEAR - 0.25, -0.25), (HALF + 0.25, FAR + 0.25, HEIGHT + 0.25)
    outside = closed_box(low, high, 0.5)[:3] + closed_box(low, high, 0.5)[4:]
    add("Outside", white, *outside, _pierced(-HALF - THICK, (low[1], high[1]), (low[2], high[2]), -1.0, 0.25))


def _pierced(x: float, along: tuple[float, float], up: tuple[float, float], sign: float, cell: float) -> Grid:
    """Mesh the wall with the windows, lit from +X (sign 1) or from -X, its grid lines along their edges."""
    start, end = along if sign > 0.0 else along[::-1]
    wall = rectangle((x, start, up[0]), (0, end - start, 0), (0, 0, up[1] - up[0]), cell)
    for y in STARTS:
        wall = without(wall, (-9, y, SILL), (9, y + WIDTH, LINTEL))
    return wall


def _windows(white: bpy.types.Material) -> None:
    """Add the wall with the windows and what lines them."""
    add("Window Wall", white, _pierced(-HALF, (NEAR, FAR), (0.0, HEIGHT), 1.0, CELL))
    x, tall = -HALF - THICK, LINTEL - SILL
    for number, y in enumerate(STARTS, start=1):
        add(
            f"Window {number}", white,
            rectangle((x, y, SILL), (THICK, 0, 0), (0, WIDTH, 0), FINE),
            rectangle((x, y, LINTEL), (0, WIDTH, 0), (THICK, 0, 0), CELL),
            rectangle((x, y, SILL), (0, 0, tall), (THICK, 0, 0), CELL),
            rectangle((x, y + WIDTH, SILL), (THICK, 0, 0), (0, 0, tall), CELL),
        )  # fmt: skip


def _furnish() -> None:
    """Put a table and a bench into the hall, the bench into the sun."""
    oak, red = diffuse("Oak", (0.42, 0.26, 0.13)), diffuse("Red Felt", (0.58, 0.12, 0.10))
    x, y, z = 0.75, 0.5, 0.75
    legs = [(x + dx, y + dy) for dx in (0.0, 0.875) for dy in (0.0, 1.875)]
    add("Table", oak, *closed_box((x, y, z - FINE), (x + 1.0, y + 2.0, z), FINE),
        *(part for a, b in legs for part in box((a, b, 0.0), (a + 0.125, b + 0.125, z - FINE), FINE)))  # fmt: skip
    add("Bench", red, *box((-1.0, 1.75, 0.0), (-0.5, 3.25, 0.4375), FINE))
