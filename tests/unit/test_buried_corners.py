# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners inside of other geometry: neither black, nor lit from the room next door."""

from itertools import pairwise

import numpy as np
import pytest

from tests.unit.blockers import scene_of

DOWN = np.array([(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)], float)


def baked(light, things, lamp):
    """Return the light at the corners of the last thing and their places; a lamp of 0.4 m hangs at `lamp`."""
    scene = scene_of([*things, [0.4 * DOWN + lamp]], 10.0)
    result = light(scene, "hierarchical", quality="preview", max_edge=0.5)
    mine = scene.face_object[scene.corner_face] == len(things) - 1
    return result.corner_radiance[mine, 0], scene.vertices[scene.corner_vertex[mine]]


@pytest.mark.parametrize("depth", [0.001, 0.05])
def test_a_box_that_is_sunk_into_the_floor(box, light, depth):
    def walls(bottom):
        # Without lid and bottom, whose corners are not of the walls.
        return box((0.5, 0.5, 0.6 - bottom), (0.75, 0.75, bottom), inward=False)[2:]

    lamp = (0.8, 0.8, 1.8)
    standing, places = baked(light, [box((2, 2, 2)), walls(0.0)], lamp)
    sunk, _ = baked(light, [box((2, 2, 2)), walls(-depth)], lamp)
    low = places[:, 2] < 0.1
    assert standing[low].min() > 0.01
    # What is below the floor shows what stands on it: some light of the walls, at least half of what is right there.
    assert np.all(sunk[low] > 0.5 * standing[low])
    assert np.all(sunk[low] < 2.0 * standing[~low].max())


def test_a_column_through_a_ceiling(box, light):
    """Two storeys with a slab of 20 cm between them, in which the column ends that stands below."""
    storeys = [box((2, 2, 1)), box((2, 2, 1), (0, 0, 1.2))]
    column = box((0.2, 0.2, 1.15), (0.9, 0.9, -0.05), inward=False)[2:]
    below, _ = baked(light, [*storeys, column], (0.2, 0.8, 0.9))
    above, _ = baked(light, [*storeys, column], (0.2, 0.8, 2.1))
    assert below.min() > 0.1 * below.mean() > 0.0
    assert above.max() == 0.0


def test_books_of_triangles_that_run_into_each_other(box, light):
    """Half of the cover is inside the next book, and so is the middle of one of its two triangles."""
    room = box((2, 2, 2))
    thick = box((0.24, 0.3, 0.34), (0.88, 1.07, 0), inward=False)
    thin = [
        face[corners]
        for face in box((0.2, 0.3, 0.3), (0.9, 0.9, 0), inward=False)
        for corners in ([0, 1, 2], [0, 2, 3])
    ]
    found, places = baked(light, [room, thick, thin], (1.5, 1.0, 1.5))
    cover = np.repeat([np.ptp(face[:, 0]) == 0 and face[0, 0] > 1 for face in thin], 3)
    sunk = places[:, 1] > 1.1
    assert found[cover & sunk].min() > 0.3 * found[cover & ~sunk].max() > 0.01


def test_walls_that_end_in_the_middle_of_other_walls(box, light):
    """Their ends look along the inside of those, at the end of the wall across."""
    slabs = [
        box((2.4, 2.4, 0.2), (-0.2, -0.2, -0.2), inward=False),
        box((2.4, 2.4, 0.2), (-0.2, -0.2, 2.0), inward=False),
        box((2.4, 0.2, 2.0), (-0.2, -0.2, 0.0), inward=False),
        box((2.4, 0.2, 2.0), (-0.2, 2.0, 0.0), inward=False),
        box((0.2, 2.2, 2.0), (2.0, -0.1, 0.0), inward=False),
    ]
    rows = np.linspace(0, 2, 9)
    cells = [(y, z) for y in ((-0.1, 0.3), (0.3, 1.7), (1.7, 2.1)) for z in pairwise(rows)]
    wall = [np.array([(0, y0, z0), (0, y1, z0), (0, y1, z1), (0, y0, z1)]) for (y0, y1), (z0, z1) in cells]

    found, places = baked(light, [*slabs, wall], (0.8, 0.8, 1.8))
    ends = ((places[:, 1] < 0) | (places[:, 1] > 2)) & (places[:, 2] > 0) & (places[:, 2] < 2)
    assert found[ends].min() > 0.3 * found[~ends].mean() > 0.005
