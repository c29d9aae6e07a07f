# SPDX-License-Identifier: GPL-3.0-or-later
"""A room with one window in a thick wall: few rays find the way out, and the sunlit outside outshines the room."""

import numpy as np
import pytest

from core.bake import bake
from core.hierarchy.elements import split_patches
from core.hierarchy.linking import hierarchical_transport
from core.hierarchy.quality import QUALITIES
from core.hierarchy.samples import each
from core.hierarchy.scenery import build_scenery
from core.lighting.lamps import SkyLamp, lamp_irradiance, scene_reach
from core.meshing import mesh
from core.progress import exhaust
from core.scene import Scene
from core.settings import Settings
from core.visibility import scene_occluders
from tests.at_once import AtOnce

WIDE, LONG, HIGH, THICK = 4.0, 6.0, 3.0, 0.4
LOW, TOP = np.array((2.2, 0.8)), np.array((3.2, 2.2))  # of the window, along y and up
CELLS = 12


def rectangle(y, z, x, *, outward=False):
    face = np.array([(x, y[0], z[0]), (x, y[1], z[0]), (x, y[1], z[1]), (x, y[0], z[1])])
    return face[::-1] if outward else face


def wall(x, **side):
    """Return four rectangles round the window."""
    (y, z), (other, up) = LOW, TOP
    whole, beside = (0, LONG), (z, up)
    parts = [(whole, (0, z)), (whole, (up, HIGH)), ((0, y), beside), ((other, LONG), beside)]
    return [rectangle(*part, x, **side) for part in parts]


@pytest.fixture
def room(box):
    """The room: five walls, that with the window, what lines it, and its outside."""
    walls = [face for face in box((WIDE, LONG, HIGH)) if np.ptp(face[:, 0]) or face[0, 0] > 0]
    lining = box((THICK, *(TOP - LOW)), (-THICK, *LOW))
    lining = [face for face in lining if np.ptp(face[:, 0])]
    return [*walls, *wall(0.0), *lining, *wall(-THICK, outward=True)]


def test_a_room_keeps_no_light_that_goes_out_through_its_window(room):
    scene = Scene.from_polygons(room, 0.5, 1.0, divisions=np.full(len(room), CELLS))
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    elements = split_patches(patches, occluders, tolerance=1.0, size=1.0)
    x, y, z = elements.centre.T
    inside = x > -1e-6
    spot = inside & (z < 1e-6) & (np.abs(x - 1.2) < 0.5) & (np.abs(y - 3) < 0.4)
    B = np.where(inside, np.where(spot, 3.0, 0.3), 4.0)
    scenery = build_scenery(elements, B[:, None] * np.ones(3), 1.0, occluders)
    detail = QUALITIES["medium"].solve
    transport = exhaust(hierarchical_transport(elements, each(elements), scenery, detail, AtOnce()))
    power = elements.area * B * inside
    rng = np.random.default_rng(7)
    asked = rng.choice(len(power), 2000, p=power / power.sum())
    # What a sky of radiance one lights is the way out.
    sky = [SkyLamp("World", np.ones((1, 1, 3)))]
    point, normal = elements.centre[asked], elements.normal[asked]
    lost = lamp_irradiance(sky, point, normal, occluders, rays=100, reach=scene_reach(scene)) / np.pi
    truth = 1 - lost.mean()
    assert truth < 0.995
    assert power @ transport.sums / power.sum() == pytest.approx(truth, abs=0.001)


def test_the_light_of_a_far_window_shows_no_spots(room):
    rows, columns = 16, 24
    ceiling = np.flatnonzero([(face[:, 2] == HIGH).all() for face in room])[0]
    tile, size = np.array([(0, 0, HIGH), (0, 1, HIGH), (1, 1, HIGH), (1, 0, HIGH)]), (WIDE / rows, LONG / columns, 1)
    tiles = [(tile + (x, y, 0)) * size for x in range(rows) for y in range(columns)]
    others = [face for index, face in enumerate(room) if index != ceiling]
    scene = Scene.from_polygons([*tiles, *others], 0.7, 0.0, lamps=(SkyLamp("World", np.ones((1, 1, 3))),))
    baked = exhaust(bake(scene, Settings(), executor=AtOnce()))
    place = scene.vertices[scene.corner_vertex]
    up = place[:, 2] == HIGH
    at = np.rint(place[up] / size).astype(int)[:, :2]
    H = np.zeros((rows + 1, columns + 1))
    H[tuple(at.T)] = baked.corner_irradiance[up, 0]
    around = (H[:-2, 1:-1] + H[2:, 1:-1] + H[1:-1, :-2] + H[1:-1, 2:]) / 4
    spots = (H[1:-1, 1:-1] / around - 1)[rows // 2 : -2, 2:-2]
    assert np.sqrt((spots**2).mean()) < 0.021
