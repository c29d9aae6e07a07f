# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a flat stretch runs round the edge of a wall: the light there depends on the side that one comes from."""

import numpy as np
import pytest

from core.hierarchy.notches import at_corners
from core.hierarchy.vantages import corner_receivers
from core.scene import Scene

INNER = (2.0, 2.0, 0.0)


def squares(start, along, up, count, height):
    """Return unit squares along and up a wall, seen from the left of it."""
    square = np.array([0 * up, up, up + along, along])
    return [square + start + i * np.array(along) + k * up for i in range(count) for k in range(height)]


def passage():
    """Return a bright passage round a corner, two metres wide, with a lamp at one end; the inner edge is at (2, 2)."""
    up = np.array((0.0, 0.0, 1.0))
    walls = [
        ((0, 0, 0), (1, 0, 0), 5),
        ((5, 0, 0), (0, 1, 0), 2),
        ((5, 2, 0), (-1, 0, 0), 3),
        ((2, 2, 0), (0, 1, 0), 3),
        ((2, 5, 0), (-1, 0, 0), 2),
        ((0, 5, 0), (0, -1, 0), 5),
    ]
    polygons = [square for start, along, count in walls for square in squares(start, along, up, count, 2)]
    for x in range(5):
        for y in range(5):
            if x < 2 or y < 2:
                floor = np.array([(x, y, 0), (x + 1, y, 0), (x + 1, y + 1, 0), (x, y + 1, 0)], float)
                polygons += [floor, floor[::-1] + 2 * up]
    emission = np.zeros((len(polygons), 3))
    emission[[k for k, polygon in enumerate(polygons) if (polygon[:, 0] == 5).all()]] = 1
    return Scene.from_polygons(polygons, 0.8, emission)


def of_floor(scene, at):
    position = scene.vertices[scene.corner_vertex]
    floor = scene.face_normal[scene.corner_face][:, 2] > 0.5
    return np.flatnonzero(floor & (np.abs(position - at).max(axis=1) < 1e-9))


def test_every_face_round_a_notch_has_a_receiver():
    scene = passage()
    corners = corner_receivers(scene)
    around = of_floor(scene, INNER)
    assert len(around) == 3 and len(np.unique(corners.group[around])) == 3
    # Each on its own face; elsewhere there is one for all.
    middle = scene.vertices[scene.corner_vertex].reshape(-1, 4, 3).mean(axis=1)[scene.corner_face[around]]
    to = corners.point[corners.group[around]] - INNER
    assert ((middle - INNER) * to).sum(axis=1) == pytest.approx(
        np.linalg.norm(middle - INNER, axis=1) * np.linalg.norm(to, axis=1)
    )
    for place in ((1, 1, 0), (1, 0, 0), (0, 0, 0)):
        assert len(np.unique(corners.group[of_floor(scene, place)])) == 1


def test_a_notch_shows_the_mean_of_its_faces():
    scene = passage()
    corners = corner_receivers(scene)
    around, values = of_floor(scene, INNER), np.arange(float(len(corners.point)))[:, None]
    shown = at_corners(scene, corners, values)[:, 0]
    assert shown[around] == pytest.approx(values[corners.group[around], 0].mean())
    others = np.flatnonzero(scene.vertices[scene.corner_vertex, 2] == 1)
    assert shown[others] == pytest.approx(values[corners.group[others], 0])


def test_the_dark_side_of_an_edge_is_not_lit_by_the_floor_on_the_other(light):
    """The foot of the wall that turns its back on the lamp is about as bright as the wall above it."""
    scene = passage()
    found = light(scene, method="hierarchical", quality="high")
    position, normal = scene.vertices[scene.corner_vertex], scene.face_normal[scene.corner_face]
    edge = (normal[:, 0] < -0.5) & (np.abs(position[:, :2] - 2).max(axis=1) < 1e-9)
    foot, above = (found.corner_irradiance[edge & (position[:, 2] == z), 0].mean() for z in (0, 1))
    assert foot == pytest.approx(above, rel=0.06)
