# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms under the dome of a sky: what is far and large does not make what is near and small coarse."""

import numpy as np
import pytest

from core.meshing import mesh
from core.occlusion.blender_tree import BVHOccluders
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.core_part import core_part
from core.occlusion.streams import StreamOccluders
from core.occlusion.surfaces import occluder_polygons
from core.scene import FRONT, Scene

DOME = 1e4


def dome(radius, rows=6):
    """Return quads of a ball that look inwards."""
    height, turn = np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, 2 * rows + 1)
    at = radius * np.stack(
        [np.outer(np.sin(height), np.cos(turn)), np.outer(np.sin(height), np.sin(turn)),
         np.outer(np.cos(height), np.ones(len(turn)))], axis=-1,
    )  # fmt: skip
    return [
        np.array([at[i, j], at[i, j + 1], at[i + 1, j + 1], at[i + 1, j]]) for i in range(rows) for j in range(2 * rows)
    ]


def open_room(box, around=()):
    """Return an open room of 5 m with a lamp and a plate of 1 cm that hangs 1 mm over its floor, and what is around."""
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    room = box((5, 5, 3))
    del room[1]
    lamp = square[::-1] + (2, 2, 2.9)
    plate = 0.01 * square + (2.505, 2.505, 0.001)
    polygons = [*room, lamp, *box((0.5, 0.5, 0.5), (1, 1, 0), inward=False)[1:], plate, *around]
    emission, reflectance = np.zeros((len(polygons), 1)), np.full((len(polygons), 1), 0.6)
    emission[len(room)] = 20.0
    reflectance[12:] = 0.0
    size = np.where(np.arange(len(polygons)) < 11, 1.0, np.nan)
    count = len(polygons)
    return Scene.from_polygons(
        polygons,
        reflectance * np.ones(3),
        emission * np.ones(3),
        max_edge=size,
        sides=np.full(count, FRONT),
    )


def test_the_core_is_what_a_few_large_faces_are_around():
    rng = np.random.default_rng(0)
    low = rng.uniform(0, 5, (100, 3))
    high = low + 0.5
    room = core_part(low, high)
    assert room.whole
    assert room.size == pytest.approx(np.linalg.norm(np.ptp(np.concatenate([low, high]), axis=0)))
    far = core_part(np.concatenate([low, [(-1e4, -1e4, 0)]]), np.concatenate([high, [(1e4, 1e4, 0)]]))
    assert not far.whole
    assert far.size == room.size
    np.testing.assert_array_equal(far.away(np.array([[(2, 2, 2)] * 3, [(1e4, 1e4, 1e4)] * 3])) > 0, [False, True])
    # Neither is one blade of grass among many the core, however far from it the next one stands.
    blades = rng.uniform(0, 5, (1000, 3))
    for size in (np.full((1000, 1), 0.01), rng.uniform(0.005, 0.02, (1000, 1))):
        assert core_part(blades, blades + size * np.ones(3)).whole
    # Sizes that grow step by step have no core.
    steps = 3.0 ** np.arange(12)[:, None] * np.ones(3)
    assert core_part(-steps, steps).whole


def test_the_pieces_of_a_segment_are_the_segment():
    low = np.zeros((20, 3))
    part = core_part(np.concatenate([low, [(-1e4, -1e4, 0)]]), np.concatenate([low + 5.0, [(1e4, 1e4, 0)]]))
    rng = np.random.default_rng(1)
    scale = 10.0 ** rng.uniform(0, 4, (2, 500, 1))
    origins, targets = rng.normal(size=(2, 500, 3)) * scale
    targets[:50, :2] = origins[:50, :2]  # straight up
    begin, end, owner = part.cut(origins, targets)
    length = np.linalg.norm(end - begin, axis=1)
    np.testing.assert_allclose(
        np.bincount(owner, length, len(origins)), np.linalg.norm(targets - origins, axis=1), rtol=1e-12
    )
    assert np.bincount(owner).max() == 3


def test_what_blocks_in_a_room_blocks_under_a_dome_too(box):
    pytest.importorskip("bpy", reason="needs Blender's tree")
    plain, domed = (open_room(box, around) for around in ((), dome(DOME)))
    patches = mesh(plain)
    centre = np.concatenate([patches.centre, [(2.51, 2.51, 0.0)]])
    rng = np.random.default_rng(2)
    i, j = rng.integers(len(centre), size=(2, 20_000))
    # Half of them reach the floor below the plate.
    j[::2] = len(centre) - 1
    expected = BruteForceOccluders(occluder_polygons(plain, patches)).blocked(centre[i], centre[j])
    under = j == len(centre) - 1
    assert expected[under].mean() > 0.5
    occluding = occluder_polygons(domed, mesh(domed))
    assert not occluding.core.whole
    for kind in (BruteForceOccluders, BVHOccluders, StreamOccluders):
        found = kind(occluding).blocked(centre[i], centre[j])
        assert np.count_nonzero(found != expected) <= 2, kind
    # What is as far as the dome sees the room's walls, from outside and from inside.
    far = mesh(domed).centre[-72:]
    k = rng.integers(len(far), size=5000)
    oracle = BruteForceOccluders(occluding).blocked(centre[i[:5000]], far[k])
    assert 0.2 < oracle.mean() < 0.8
    for kind in (BVHOccluders, StreamOccluders):
        assert np.count_nonzero(kind(occluding).blocked(centre[i[:5000]], far[k]) != oracle) <= 2, kind


def test_a_dark_dome_far_away_does_not_change_the_light_of_a_room(box, light):
    plain, domed = (open_room(box, around) for around in ((), dome(DOME)))
    count = len(plain.corner_vertex)
    one, other = (light(scene, "hierarchical", quality="preview") for scene in (plain, domed))
    lit = plain.emission[plain.corner_face, 0] == 0
    seen, under = (bake.corner_radiance[:count][lit, 0] for bake in (one, other))
    # Walls that let light through near them, as shares of the dome had it, lose a third.
    assert under.mean() == pytest.approx(seen.mean(), rel=0.06)
