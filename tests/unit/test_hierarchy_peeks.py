# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners that do not see who looks for them: a few rays of their own tell them of their light."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from core.bake import bake
from core.hierarchy import quality as qualities
from core.hierarchy.doubts import _believed
from core.hierarchy.element_hits import ElementHits
from core.hierarchy.glances import Corners
from core.hierarchy.outlook import Outlook
from core.hierarchy.peeks import Peeks, evened, peeks
from core.hierarchy.probes import ways_round
from core.hierarchy.vantages import corner_receivers
from core.lighting.lamps import SkyLamp, scene_reach
from core.meshing import mesh
from core.progress import exhaust
from core.scene import BOTH, Scene
from core.settings import Settings
from core.visibility import scene_occluders
from tests.unit.source_trees import random_polygons

EVEN_SKY = SkyLamp("Sky", np.ones((1, 1, 3)))
PREVIEW = qualities.QUALITIES["preview"]


def bush(count=800):
    """Return black leaves in a ball under an even sky."""
    rng = np.random.default_rng(5)
    leaves = random_polygons(rng, count, triangles=0)
    way = rng.normal(size=(count, 1, 3))
    way *= rng.uniform(0, 1, (count, 1, 1)) ** (1 / 3) / np.linalg.norm(way, axis=2, keepdims=True)
    corners = way + 0.7 * (leaves - leaves.mean(axis=1, keepdims=True))
    scene = Scene.from_polygons([[*map(tuple, leaf)] for leaf in corners], 0.0, lamps=[EVEN_SKY])
    return replace(scene, sides=np.full(count, BOTH, np.uint8))


def test_leaves_have_each_their_light_and_not_one_anothers(monkeypatch):
    pytest.importorskip("bpy", reason="without Blender's tree nobody asks what rays meet")
    scene = bush()
    monkeypatch.setitem(qualities.QUALITIES, "preview", replace(PREVIEW, corners=300, samples=300))
    light = exhaust(bake(scene, Settings(quality="preview"))).corner_irradiance[:, 0]
    corners, rays = corner_receivers(scene), 400
    way = ways_round(np.repeat(corners.normal[:, None], rays, axis=1)).reshape(-1, 3)
    origin = np.repeat(corners.point, rays, axis=0)
    blocked = scene_occluders(scene, mesh(scene)).blocked(origin, origin + 99 * way)
    sky = np.pi * (1 - blocked.reshape(-1, rays).mean(axis=1))[corners.group]
    # Some leaves are outside, most are not.
    assert sky.std() > sky.mean()
    assert light.mean() == pytest.approx(sky.mean(), rel=0.03)
    assert np.corrcoef(light, sky)[0, 1] > 0.95
    assert np.sqrt(((light - sky) ** 2).mean()) < 0.45 * sky.mean()


def looking(scene, point, normal, skies=(), rays=256, piece=None):
    """Let points peek in a scene; what its faces send is their number."""
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    corners = patches.corners
    hits = ElementHits(corners, patches.face, patches.side, scene.occludes[patches.face])
    outlook = Outlook(hits, np.repeat(patches.face[:, None] + 1.0, 6, axis=1), skies, occluders, scene_reach(scene))
    receivers = Corners(np.array(point, float), np.array(normal, float), np.arange(len(point)))
    which = np.arange(len(point))
    with ThreadPoolExecutor(2) as workers:
        return exhaust(peeks(receivers, which, which if piece is None else np.array(piece), outlook, rays, workers))


def test_peeks_see_the_sky_by_direction_and_what_is_before_it():
    # The west of the sky shines; a wall in the east is met instead.
    west = SkyLamp("Sky", np.tile(np.array([1.0, 0, 0, 1])[:, None], (64, 1, 3)))
    wall = Scene.from_polygons([[(1, -99, -99), (1, -99, 99), (1, 99, 99), (1, 99, -99)]], 0.5)
    up = [(0.0, 0.0, 1.0)] * 2
    own = looking(wall, [(0.0, 0, 0), (0.5, 0, 0)], up, [west])
    assert own.light[:, :3] == pytest.approx(west.unshadowed(np.zeros((2, 3)), np.array(up)) + 0.5, rel=0.05)
    assert own.sees == pytest.approx(np.ones(2)) and own.apart[0] > own.apart[1] > 0.5
    # A sky that nothing blocks is behind the wall, too.
    whole = replace(EVEN_SKY, shadows=False)
    assert looking(wall, [(0.0, 0, 0)], up[:1], [whole]).light[0, 0] == pytest.approx(np.pi + 0.5, rel=0.02)
    # The back of the wall has no light.
    behind = looking(wall, [(1.5, 0, 0)], [(-1.0, 0, 0)], [EVEN_SKY])
    assert behind.light[0] == pytest.approx(np.zeros(6), abs=0.05) and behind.sees[0] < 0.05


def test_one_speaks_for_its_piece_as_far_as_surfaces_are_away():
    wall = Scene.from_polygons([[(1, -99, -99), (1, -99, 99), (1, 99, 99), (1, 99, -99)]], 0.5)
    place = [(0.0, 0, 0), (0.9, 0, 0), (0.05, 0, 0), (0.05, 0, 0)]
    own = looking(wall, place, [(0.0, 0, 1)] * 4, rays=16, piece=[0, 0, 0, 1])
    assert own.rays == 3 * 16
    assert (own.which == np.arange(4)).all()
    assert own.light[0, 0] == own.light[2, 0] and own.apart[0] == own.apart[2]
    assert own.apart[1] < 0.7 * own.apart[0]
    # Who looks another way sees something else.
    turned = looking(wall, place[:3:2], [(0.0, 0, 1), (1, 0, 0)], rays=16, piece=[0, 0])
    assert turned.rays == 2 * 16 and turned.light[1, 0] == pytest.approx(1)


def test_panes_color_what_peeks_see():
    quads = [[(-99, -99, z), (-99, 99, z), (99, 99, z), (99, -99, z)] for z in (1, 2)]
    scene = Scene.from_polygons(quads, 0.5)
    pane = np.array([True, False])
    tint = np.where(pane[:, None], (1.0, 0.5, 0.25), 1.0)
    scene = replace(scene, occludes=~pane, shades=~pane, tint=tint)
    own = looking(scene, [(0.0, 0, 0)], [(0.0, 0, 1)])
    assert own.light[0, :3] == pytest.approx(2 * tint[0], rel=0.05)


def chain(light, place, normal, variance=1.0):
    """Return peeks of corners in a row, from all of which surfaces are 1 m away, and their edges."""
    n = len(light)
    point = np.column_stack((place, np.zeros((n, 2))))
    every = np.arange(n)
    own = Peeks(
        every, np.repeat(np.array(light, float)[:, None], 6, 1), np.full(n, variance), np.ones(n), np.ones(n), 0
    )
    return own, Corners(point, np.array(normal, float), every), (every[:-1], every[1:])


def test_neighbours_that_see_the_same_even_out_chance_and_others_do_not():
    up, aside = (0, 0, 1), (1, 0, 0)
    near = evened(*chain([1, 3, 2], [0, 0, 0], [up] * 3))
    assert near.light[:, 0] == pytest.approx([2, 2, 2.5]) and near.variance == pytest.approx([1 / 2, 1 / 3, 1 / 2])
    for place, normal in (([0, 1, 2], [up] * 3), ([0, 0, 0], [up, aside, up])):
        far = evened(*chain([1, 3, 2], place, normal))
        assert far.light[:, 0] == pytest.approx([1, 3, 2]) and far.variance == pytest.approx([1, 1, 1])


def test_own_rays_are_believed_where_they_differ_from_what_was_told_by_more_than_chance():
    rng = np.random.default_rng(2)
    noise = rng.normal(size=400)
    own, *_ = chain(5 + noise, np.zeros(400), [(0, 0, 1)] * 400)
    region = np.repeat([0, 1], 200)
    told = np.full((400, 6), 5.0)
    # In the second region light changes from corner to corner, and its sample does not know.
    own.light[200:] += 3 * rng.normal(size=(200, 1))
    assert _believed(own, told, region) == pytest.approx([0, 0.9], abs=0.1)
    assert (_believed(replace(own, light=told), told, region) == 0).all()
    # What no ray meets is added to what is seen.
    unmet = np.hstack((told + 2, np.full((400, 6), 2.0)))
    assert _believed(own, unmet, region) == pytest.approx(_believed(own, told, region))
