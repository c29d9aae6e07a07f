# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes far from the origin are as bright as near it."""

import numpy as np

from core.lighting.lamps import AreaLamp, PointLamp, SkyLamp
from core.origin import middle, moved_scene
from tests.unit.painted_faces import halves, painted

AWAY = np.array([5e7, -3e7, 120.0])
LAMPS = (
    PointLamp("Bulb", np.ones(3), np.array([0.7, 0.6, 0.8]), 0.05),
    AreaLamp("Panel", np.ones(3), np.array([0.5, 0.5, 0.9]), *(0.1 * np.eye(3)[:2]), direction=-np.eye(3)[2]),
    SkyLamp("World", np.ones((1, 1, 3))),
)


def test_a_room_far_away_is_as_bright_as_near_the_origin(box, light):
    room = painted(box()[:5], halves, lamps=LAMPS)
    far = moved_scene(room, AWAY)
    near, away = (light(scene, "hierarchical", quality="preview", max_edge=0.2) for scene in (room, far))
    np.testing.assert_allclose(away.corner_radiance, near.corner_radiance, rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(away.patches.centre - AWAY, near.patches.centre, atol=1e-6)
    assert near.corner_radiance.max() > 0.1


def test_what_most_of_a_scene_is_near_to_counts(box):
    room = painted(box(), halves)
    assert not middle(room).any()
    np.testing.assert_allclose(middle(moved_scene(room, AWAY)), AWAY, atol=1)
    # A stray object far away moves nothing.
    assert not middle(painted([*box() * 5, *box(at=(1e7, 0, 0))], halves)).any()
