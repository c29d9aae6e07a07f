# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands between lamps or sky and what they light: shadows, openings, and panes that tint."""

from concurrent.futures import Executor, Future, ThreadPoolExecutor

import numpy as np
import pytest

from core.lighting.lamps import AreaLamp, PointLamp, SkyLamp, SunLamp, direct_light, lamp_irradiance, scene_reach
from core.meshing import mesh
from core.occlusion import shared_out
from core.scene import Scene
from core.settings import Settings
from core.visibility import scene_occluders
from tests.unit.lamps import COLOUR, DOWN, LAMPS, SQUARE, UP, WHITE, Nothing, disc, lit


@pytest.mark.parametrize("name", LAMPS)
def test_what_stands_between_casts_a_shadow(name):
    plate = 0.5 * SQUARE + UP
    points = [(0, 0, 0), (5, 0, 0), (0, 0, 1.5), (0.3, -0.2, 0)]
    shaded, bare = lit(LAMPS[name], points, polygons=[plate]), lit(LAMPS[name], points)
    np.testing.assert_allclose(shaded, bare * (0, 1, 1, 0))


@pytest.mark.parametrize("name", [name for name in LAMPS if name != "point"])
def test_half_a_lamp_is_seen_past_an_edge(name):
    # The plate's edge lies on the line from the receivers to the lamp's middle.
    plate = SQUARE + (-1, 0, 1)
    points = np.column_stack((np.zeros(64), np.linspace(-0.05, 0.05, 64), np.zeros(64)))
    share = lit(LAMPS[name], points, polygons=[plate]) / lit(LAMPS[name], points)
    assert share.mean() == pytest.approx(0.5, abs=0.01)
    assert share.std() < 0.03


def test_lamps_may_be_told_to_cast_no_shadows():
    lamp = PointLamp("fill", WHITE, 2 * UP, shadows=False)
    assert lit(lamp, (0, 0, 0), polygons=[0.5 * SQUARE + UP])[0] == 0.25


def test_half_of_a_sky_is_hidden_by_a_wall():
    wall = np.array([(0, -500, 0), (0, 500, 0), (0, 500, 1000), (0, -500, 1000)], float)
    points = np.column_stack((-np.linspace(0.5, 1, 100), np.zeros((100, 2))))
    share = lit(SkyLamp("sky", np.ones((1, 1, 3))), points, polygons=[wall]) / np.pi
    assert share.mean() == pytest.approx(0.5, abs=0.003)
    assert share.std() < 0.01


def test_sky_through_an_opening():
    # A ceiling with a hole of 1 m x 1 m, 2 m above the floor: the form factor of the hole.
    ceiling = [
        np.array([(a, c, 2), (b, c, 2), (b, d, 2), (a, d, 2)], float)
        for a, b, c, d in ((-90, -0.5, -90, 90), (0.5, 90, -90, 90), (-0.5, 0.5, -90, -0.5), (-0.5, 0.5, 0.5, 90))
    ]
    walls = [np.array([(90 * s, -90, 0), (90 * s, 90, 0), (90 * s, 90, 2), (90 * s, -90, 2)], float) for s in (-1, 1)]
    walls += [polygon[:, [1, 0, 2]] for polygon in walls]
    points = np.stack(np.meshgrid(np.linspace(0, 3, 24), np.linspace(0, 0.3, 8), [0.0]), axis=-1).reshape(-1, 3)
    sky = SkyLamp("sky", np.ones((1, 1, 3)))
    hole = AreaLamp("hole", WHITE, 2 * UP, np.array((0.5, 0, 0)), np.array((0, 0.5, 0)), DOWN)
    found, expected = lit(sky, points, polygons=ceiling + walls), lit(hole, points)
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.1 * expected.mean()


def test_same_receivers_same_bits():
    plate, points = SQUARE + (-1, 0, 1), np.random.default_rng(0).random((300, 3)) * (1, 1, 0)
    first, second = (lit(LAMPS["disc"], points, polygons=[plate]) for _ in range(2))
    assert (first == second).all()


def half_hidden_sky(points, **options):
    """Return the light of a white sky of which a plate hides a part."""
    scene = Scene.from_polygons([SQUARE + (-1, 0, 0.5)])
    occluders, normals = scene_occluders(scene, mesh(scene)), np.tile(UP, (len(points), 1))
    sky = SkyLamp("sky", np.ones((1, 1, 3)))
    return lamp_irradiance([sky], points, normals, occluders, rays=9, reach=scene_reach(scene), **options)[:, 0]


def test_workers_change_no_bit():
    # More receivers than are done at a time.
    points = np.random.default_rng(0).random((4000, 3)) * (4, 4, 0) - (2, 2, 0)
    with ThreadPoolExecutor(3) as workers:
        assert (half_hidden_sky(points, workers=workers) == half_hidden_sky(points)).all()


def test_a_rough_look_at_the_sky_is_right_on_the_mean():
    points = np.random.default_rng(0).random((500, 3)) * (4, 4, 0) - (2, 2, 0)
    fine, rough = half_hidden_sky(points), half_hidden_sky(points, rough=True)
    assert rough.mean() == pytest.approx(fine.mean(), rel=3e-3)
    assert 0 < np.sqrt(np.mean((rough - fine) ** 2)) < 0.03 * np.pi


def test_direct_light_of_a_scene_grows_finer_with_quality():
    scene = Scene.from_polygons([SQUARE, 0.5 * SQUARE + UP], lamps=[LAMPS["ball"]])
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    points = np.column_stack((np.linspace(0, 1.5, 200), np.zeros((200, 2))))
    normals = np.tile(UP, (200, 1))
    exact = lamp_irradiance(scene.lamps, points, normals, occluders, rays=900, reach=9.0)
    errors = [
        np.abs(direct_light(scene, points, normals, Settings(quality=quality), occluders) - exact).mean()
        for quality in ("preview", "medium", "high", "production")
    ]
    assert errors[0] > errors[1] > errors[3]
    assert errors[2] < 0.03 * exact.mean()


@pytest.mark.parametrize("kind", ["sun", "point", "disc", "sky"])
def test_light_takes_on_the_tint_of_all_panes_on_its_way(kind):
    red, blue = (0.9, 0.5, 0.1), (0.3, 0.4, 0.8)
    # Two panes of one plane side by side, over one that is larger; and a wall in the light of half of the ground.
    panes = [20 * SQUARE + (20, 0, 1), 20 * SQUARE + (-20, 0, 1), 100 * SQUARE + (0, 0, 1.2)]
    tint = np.array([red, blue, (0.5, 0.5, 0.5)])
    scene = Scene.from_polygons(panes, tint=tint, occludes=np.zeros(3), shades=np.zeros(3))
    occluders, reach = scene_occluders(scene, mesh(scene)), scene_reach(scene)
    lamp = {
        "sun": SunLamp("sun", COLOUR, UP),
        "point": PointLamp("point", COLOUR, np.array((0.0, 0.0, 2.0))),
        "disc": disc(),
        "sky": SkyLamp("sky", COLOUR.reshape(1, 1, 3)),
    }[kind]
    points = np.array([(1.5, 0.2, 0.9), (-1.5, 0.2, 0.9), (1.5, 0.2, 1.1), (0.5, 0.0, 1.3)])
    normals = np.tile(UP, (4, 1))

    def light(occluders):
        return lamp_irradiance([lamp], points, normals, occluders, rays=16, reach=reach)

    # The sky of single points is seen through the next pane as well, but hardly.
    share = light(occluders) / light(Nothing())
    expected = [0.5 * tint[0], 0.5 * tint[1], tint[2], (1, 1, 1)]
    np.testing.assert_allclose(share, expected, rtol=1e-6 if kind != "sky" else 0.05)


def test_what_blocks_has_no_tint_and_dark_rays_take_none_on():
    wall, pane = SQUARE + (1, 0, 1), 3 * SQUARE + (0, 0, 1.5)
    scene = Scene.from_polygons([wall, pane], tint=[WHITE, 0.5 * WHITE], occludes=[1, 0], shades=[1, 0])
    occluders, reach = scene_occluders(scene, mesh(scene)), scene_reach(scene)
    points = np.array([(1.0, 0, 0), (-1.0, 0, 0)])
    sun = SunLamp("sun", COLOUR, UP)
    found = lamp_irradiance([sun], points, np.tile(UP, (2, 1)), occluders, rays=16, reach=reach)
    np.testing.assert_allclose(found, [np.zeros(3), 0.5 * COLOUR])


class Interrupted(Executor):
    """Who is interrupted at the first of some tasks, before the others have begun."""

    def __init__(self):
        self.futures = []

    def submit(self, compute, *args):
        future = Future()
        if not self.futures:
            future.set_exception(KeyboardInterrupt())
        self.futures.append(future)
        return future


def test_an_interrupted_look_at_a_lamp_leaves_nothing_to_wait_for():
    points = np.zeros(((1 << 18) + 16, 3))
    workers = Interrupted()
    with pytest.raises(KeyboardInterrupt):
        lamp_irradiance(
            [LAMPS["point"]], points, np.tile(UP, (len(points), 1)), Nothing(), rays=4, reach=9.0, workers=workers
        )
    assert len(workers.futures) > 1
    assert all(future.cancelled() for future in workers.futures[1:])


def test_receivers_close_together_need_fewer_rays_each():
    scene = Scene.from_polygons([SQUARE, 0.5 * SQUARE + UP])
    patches = mesh(scene)
    occluders, asked = scene_occluders(scene, patches), {}
    points = np.column_stack((np.linspace(0, 1.5, 3000), np.zeros((3000, 2))))
    normals = np.tile(UP, (3000, 1))

    class Counted:
        def blocked(self, origins, targets):
            asked[dense] = asked.get(dense, 0) + len(origins)
            return occluders.blocked(origins, targets)

    light = {}
    for dense in (False, True):
        light[dense] = lamp_irradiance([LAMPS["ball"]], points, normals, Counted(), rays=9, reach=9.0, dense=dense)
    exact = lamp_irradiance([LAMPS["ball"]], points, normals, occluders, rays=900, reach=9.0)
    assert asked[True] < 0.7 * asked[False]
    error = light[True] - exact
    assert abs(error.mean()) < 2e-3 * exact.mean()
    assert np.sqrt((error**2).mean()) < 0.02 * exact.max()


def test_segments_are_shared_out_among_workers(monkeypatch):
    monkeypatch.setattr(shared_out, "_PART", 500)
    scene = Scene.from_polygons([SQUARE, 0.5 * SQUARE + UP])
    occluders, asked = scene_occluders(scene, mesh(scene)), []
    start, end = np.random.default_rng(3).uniform(-1, 2, (2, 2600, 3))

    class Noted:
        def blocked(self, origins, targets):
            asked.append(len(origins))
            return occluders.blocked(origins, targets)

    with ThreadPoolExecutor(2) as workers:
        shared = shared_out.SharedOut(Noted(), workers).blocked(start, end)
        assert not len(shared_out.SharedOut(Noted(), workers).blocked(start[:0], end[:0]))
    assert sorted(asked) == [0, 100, *5 * [500]]
    np.testing.assert_array_equal(shared, occluders.blocked(start, end))
    assert 0.02 < shared.mean() < 0.5
