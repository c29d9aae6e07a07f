# SPDX-License-Identifier: GPL-3.0-or-later
"""Light stays on its side of walls, however thin they are and however badly they meet."""

from itertools import pairwise

import numpy as np
import pytest

from core.scene import AUTO, BOTH, Scene


def upright(x, low, high, divisions=1):
    """Return a wall across x as a row of quads, from (y, z) to (y, z)."""
    edges = np.linspace(low[0], high[0], divisions + 1)
    (z0, z1) = low[1], high[1]
    return [np.array([(x, a, z0), (x, b, z0), (x, b, z1), (x, a, z1)], float) for a, b in pairwise(edges)]


def house(box, wall, lamp=((0.4, 0.4, 0.9), 0.2)):
    """Return a room of 2 m x 1 m x 1 m with a wall across and a lamp on the left."""
    (x, y, z), size = lamp
    panel = np.array([(x, y, z), (x, y + size, z), (x + size, y + size, z), (x + size, y, z)])
    polygons = [*box((2, 1, 1)), *wall, panel]
    emission = np.zeros((len(polygons), 3))
    emission[-1] = 10.0
    return Scene.from_polygons(polygons, 0.7, emission, sides=[*[AUTO] * (len(polygons) - 1), BOTH])


WALLS = {
    "whole": (upright(1, (0, 0), (1, 1)), 0.0),
    "in pieces": (upright(1, (0, 0), (1, 1), 5), 0.0),
    "on T-junctions": ([*upright(1, (0, 0), (1, 0.5), 3), *upright(1, (0, 0.5), (1, 1), 2)], 0.0),
    "through floor and walls": (upright(1, (-1e-3, -1e-3), (1 + 1e-3, 1 + 1e-3)), 0.0),
    "1 mm short of the ceiling": (upright(1, (0, 0), (1, 1 - 1e-3)), 0.02),
}


@pytest.mark.parametrize("quality", ["preview", "medium", "high"])
@pytest.mark.parametrize("name", WALLS)
def test_a_wall_without_thickness_keeps_the_light(name, quality, box, light):
    wall, most = WALLS[name]
    scene = house(box, wall)
    baked = light(scene, "hierarchical", quality=quality, max_edge=0.25)
    x = baked.patches.centre[:, 0]
    radiosity = baked.solution.radiosity.mean(axis=1)
    lit, dark = radiosity[x < 0.99], radiosity[x > 1.01]
    assert lit.mean() > 0.3
    assert dark.max() <= most * lit.mean()
    # The corners at the far end of the room; blending along the edges of the floor, one face on both sides of the wall,
    # carries next to nothing across.
    far = scene.vertices[scene.corner_vertex][:, 0] > 1.5
    assert baked.corner_radiance[far].max() <= max(most, 1e-6) * lit.mean()
