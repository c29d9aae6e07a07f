# SPDX-License-Identifier: GPL-3.0-or-later
"""Lots among links that carry next to nothing."""

import numpy as np
import pytest

from core.hierarchy.elements import Elements
from core.hierarchy.exchange import build_rows
from core.hierarchy.lots import draw_lots
from core.hierarchy.quality import Detail
from core.hierarchy.receivers import group_receivers
from core.hierarchy.rows import gather
from core.hierarchy.scenery import build_scenery
from core.meshing import mesh
from core.scene import Scene
from core.visibility import scene_occluders
from tests.unit.source_trees import measured, random_polygons


def test_what_stays_makes_up_for_what_is_left_out():
    receiver, node = (axis.ravel() for axis in np.indices((300, 400)))
    chance = np.random.default_rng(1).uniform(0.05, 1.3, len(node)).astype(np.float32)
    count = draw_lots(chance, receiver, node)
    assert (count[chance >= 1] == 1).all() and (count[count > 0] >= 1).all()
    assert (count == 0).any()
    # Each node loses nothing on the mean over its receivers, nor each receiver over its nodes.
    assert count.mean() == pytest.approx(1, abs=5e-3)
    assert count.reshape(300, 400).mean(axis=0) == pytest.approx(np.ones(400), abs=0.3)
    assert count.reshape(300, 400).mean(axis=1) == pytest.approx(np.ones(300), abs=0.3)


def test_what_has_no_chance_is_left_out():
    assert (draw_lots(np.zeros(5, np.float32), np.arange(5), np.arange(5)) == 0).all()


def test_lots_keep_the_light_of_clutter(monkeypatch):
    """Check it where most links are to clusters of many directions, which rays alone tell."""
    corners = random_polygons(np.random.default_rng(2), 1500, triangles=1.0)
    middle = corners.mean(axis=1, keepdims=True)
    corners = 4 * middle + 0.5 * (corners - middle)
    centre, normal, area = measured(corners)
    one = np.ones((len(area), 3))
    elements = Elements(corners, centre, normal, area, np.arange(len(area)), one, one, one[:, 0])
    scene = Scene.from_polygons([[*map(tuple, polygon)] for polygon in corners[:, :3]], 0.5, 1.0)
    occluders = scene_occluders(scene, mesh(scene))
    scenery = build_scenery(elements, one, 1.0, occluders)
    receivers = group_receivers(0.2 * centre[:400], normal[:400], 1)
    nodes = np.ones((len(scenery.brightness), 1), np.float32)
    light, rays = [], []
    for least in (1e-9, 0.5):
        monkeypatch.setattr("core.hierarchy.exchange._LOTS", least)
        rows = build_rows(receivers, np.arange(len(receivers)), scenery, Detail(0.8, 0.02, 0.03, 8))
        light.append(gather(rows, receivers, nodes).mean())
        rays.append(rows.rays)
    assert rays[1] < 0.5 * rays[0]
    assert light[1] == pytest.approx(light[0], rel=0.03)
