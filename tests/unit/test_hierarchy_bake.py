# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchical method from end to end, against closed forms and against the whole matrix."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from core.bake import bake
from core.errors import RadiosityError
from core.hierarchy.vantages import corner_receivers
from core.lighting.round_lamps import SunLamp
from core.lighting.sky import SkyLamp
from core.progress import exhaust
from core.scene import BOTH, FRONT, Scene
from core.settings import Settings
from tests.at_once import AtOnce

QUALITIES = ("preview", "medium", "high", "production")


def lit(scene, executor=None, **settings):
    return exhaust(bake(scene, Settings(**settings), executor=executor or AtOnce()))


def surfaces(result):
    """Return the mean radiosity of each face, shape (f,)."""
    area, face = result.patches.area, result.patches.face
    return np.bincount(face, area * result.solution.radiosity[:, 0]) / np.bincount(face, area)


@pytest.fixture
def scene(box, l_room, ceiling_lamp):
    """A scene by name: `scene(name, divisions)`."""

    def build(name, divisions):
        if name == "cube":
            return ceiling_lamp(0.5, divisions)
        polygons = l_room() if name == "L-room" else [*box(), *box((0.25, 0.5, 0.25), (0.25, 0.25, 0.25), inward=False)]
        emission = np.zeros((len(polygons), 3))
        emission[5 if name == "L-room" else 1] = 1
        return Scene.from_polygons(polygons, 0.6, emission, divisions=np.full(len(polygons), divisions))

    return build


@pytest.mark.parametrize("quality", QUALITIES)
@pytest.mark.parametrize("rho", [0.2, 0.5, 0.9])
def test_a_furnace_is_as_bright_as_the_series_says(cube, quality, rho):
    result = lit(cube(rho, 1.0, 2), quality=quality)
    exact = 1 / (1 - rho)
    assert result.solution.radiosity == pytest.approx(np.full_like(result.solution.radiosity, exact), rel=1e-3)
    assert result.corner_radiance * np.pi == pytest.approx(np.full((24, 3), exact), rel=1e-3)
    assert result.report.energy.error < 1e-3 and result.solution.converged


@pytest.mark.parametrize("name", ["cube", "L-room", "block"])
def test_energy_is_conserved_and_rows_add_up(scene, name):
    report = lit(scene(name, 4)).report
    assert report.energy.error < 1e-3
    assert abs(report.row_sum.mean - 1) < 0.01


def test_light_does_not_spread_faster_than_it_does(box):
    """Along a passage that is lit at one end it gets ten times dimmer: walls are not as bright as on the mean."""
    emission = np.zeros((6, 3))
    emission[4] = 1
    passage = Scene.from_polygons(box((8, 1, 1)), 0.85, emission)
    dense = lit(passage, method="gathering", max_edge=0.25)
    found = lit(passage, quality="high", max_edge=0.25)
    far = np.abs(dense.patches.corners[:, :, 0].mean(axis=1) - 5) < 1
    there = [float(one.patches.area[far] @ one.solution.irradiance[far, 0]) for one in (found, dense)]
    assert there[0] == pytest.approx(there[1], rel=8e-3)


def test_rows_of_what_is_inside_of_stacked_boxes_are_not_told(box):
    """Under a box that has no bottom the floor sees, through its top, the bottom of one that stands on it."""
    low = [face for face in box((0.28, 0.28, 0.28), (0.36, 0.36, 0.0), inward=False) if np.max(face[:, 2]) > 0]
    high = box((0.16, 0.16, 0.16), (0.42, 0.42, 0.28), inward=False)
    polygons = [*box(), *low, *high]
    emission = np.zeros((len(polygons), 3))
    emission[1] = 1
    scene = Scene.from_polygons(polygons, 0.6, emission, divisions=np.full(len(polygons), 8))
    row_sum = lit(scene).report.row_sum
    assert row_sum.min > 0.99 and row_sum.max < 1.01


@pytest.mark.parametrize(
    ("name", "divisions", "fine"),
    [
        ("cube", 4, 16),
        ("L-room", 8, 10),
        ("cube", 8, 16),
        ("block", 8, 8),
    ],
)
def test_production_agrees_with_the_whole_matrix(scene, name, divisions, fine):
    dense = surfaces(lit(scene(name, fine), method="gathering"))
    found = surfaces(lit(scene(name, divisions), quality="production"))
    assert found == pytest.approx(dense, rel=5e-3)


def test_the_result_does_not_depend_on_who_computes(scene):
    room = scene("block", 4)
    alone = lit(room)
    for workers in (1, 2, 4):
        with ThreadPoolExecutor(workers) as pool:
            result = lit(room, pool)
        assert np.array_equal(result.corner_radiance, alone.corner_radiance)
        assert np.array_equal(result.solution.radiosity, alone.solution.radiosity)


def test_a_bake_that_is_closed_leaves_nothing_running(scene):
    with ThreadPoolExecutor(1) as pool:
        steps = bake(scene("block", 8), Settings(), executor=pool)
        stages = set()
        for progress in steps:
            stages.add(progress.stage)
            if progress.stage == "Links" and progress.fraction > 0:
                break
        steps.close()
        assert "Elements" in stages and "Final gather" not in stages
        # The pool takes new work: what waited before it is gone or done.
        assert pool.submit(int, "7").result(timeout=60) == 7


def test_links_that_do_not_fit_are_refused(scene, monkeypatch):
    monkeypatch.setattr("core.hierarchy.foresight.available_memory", lambda: 0)
    monkeypatch.setattr("core.hierarchy.exchange.TASK", 8)
    with pytest.raises(RadiosityError, match="GiB"):
        lit(scene("block", 8))


@pytest.mark.parametrize("divisions", [4, 8])
def test_one_iteration_is_direct_light_only(ceiling_lamp, divisions):
    result = lit(ceiling_lamp(0.5, divisions), quality="production", iterations=1)
    B = surfaces(result)
    # Opposite squares of a cube exchange 0.1998 (Hottel), so that each wall beside gets a quarter of the rest.
    assert B[0] == pytest.approx(0.5 * 0.19982, rel=5e-3)
    assert B[1] == pytest.approx(1.0, rel=1e-4)
    assert B[2:] == pytest.approx(np.full(4, 0.5 * 0.20004), rel=5e-3)
    assert not result.solution.converged


def test_corners_under_a_block_are_not_black(box):
    # A block stands on the floor; the floor has a vertex under it, where nothing can be seen.
    grid = np.linspace(0, 1, 5)
    floor = [
        np.array([(x, y, 0), (x + 0.25, y, 0), (x + 0.25, y + 0.25, 0), (x, y + 0.25, 0)])
        for x in grid[:-1]
        for y in grid[:-1]
    ]
    block = box((0.3, 0.3, 0.3), (0.35, 0.35, 0.0), inward=False)[1:]
    polygons = [*floor, *box()[1:], *block]
    emission = np.zeros((len(polygons), 3))
    emission[len(floor)] = 1
    scene = Scene.from_polygons(polygons, 0.5, emission)
    result = lit(scene)
    at = scene.vertices[scene.corner_vertex]
    under = np.abs(at - (0.5, 0.5, 0)).max(axis=1) < 1e-9
    open_floor = (np.abs(at[:, 2]) < 1e-9) & (scene.corner_normals[:, 2] > 0.9) & ~under
    assert under.sum() == 4
    assert result.corner_radiance[under].min() > 0.1 * result.corner_radiance[open_floor].mean()


def test_corners_stand_a_little_inside_their_faces(cube):
    scene = cube()
    corners = corner_receivers(scene)
    assert len(corners.group) == 24 and corners.group.max() == len(corners.point) - 1
    apart = corners.point[corners.group] - scene.vertices[scene.corner_vertex]
    length = np.linalg.norm(apart, axis=1)
    assert ((length > 0) & (length < 0.03)).all()
    assert np.abs((apart * scene.corner_normals).sum(axis=1)).max() < 1e-12
    assert corners.normal[corners.group] == pytest.approx(scene.corner_normals)


def hollow(steps):
    """Return a scene with a smooth trough of strips of unequal width under a lamp."""
    y = np.cumsum([0, *steps])
    z = 0.1 * (y - y[-1] / 2) ** 2
    x = np.linspace(0, 1, 5)
    vertices = np.array([(a, b, c) for b, c in zip(y, z, strict=True) for a in x])
    rows, across = len(y), len(x)
    faces = [
        (across * i + j, across * i + j + 1, across * (i + 1) + j + 1, across * (i + 1) + j)
        for i in range(rows - 1)
        for j in range(across - 1)
    ]
    slope = 0.2 * (y - y[-1] / 2)
    normals = np.repeat(np.column_stack((0 * y, -slope, 1 + 0 * y)), across, axis=0)
    lamp = len(vertices) + np.arange(4)
    vertices = np.vstack((vertices, [(0, 0, 2), (0, y[-1], 2), (1, y[-1], 2), (1, 0, 2)]))
    normals = np.vstack((normals, [(0, 0, -1)] * 4))
    corner_vertex = np.array([*np.ravel(faces), *lamp])
    emission = np.zeros((len(faces) + 1, 3))
    emission[-1] = 1
    start = 4 * np.arange(len(faces) + 2)
    rho = np.full((len(faces) + 1, 3), 0.5)
    return Scene(vertices, corner_vertex, start, rho, emission, corner_normals=normals[corner_vertex])


def test_corners_of_hollow_surfaces_do_not_lie_behind_them():
    steps = [0.02, 0.3, 0.02, 0.3, 0.02]
    scene = hollow(steps)
    corners = corner_receivers(scene)
    above = (corners.point[corners.group] - scene.vertices[scene.corner_vertex]) * scene.face_normal[scene.corner_face]
    assert above.sum(axis=1).min() > -1e-12
    radiance = lit(scene).corner_radiance[:-4, 0]
    assert radiance.min() > 0.5 * np.median(radiance)


def test_a_roof_in_the_sun_does_not_make_the_rooms_below_look_unimportant(box):
    # A lamp under the ceiling lights a block; what the sun does to a roof that sees nothing of the room is bright only.
    room = [*box(), *box((0.25, 0.5, 0.25), (0.25, 0.25, 0.0), inward=False)]
    roof = np.array([(-2, -2, 2), (3, -2, 2), (3, 3, 2), (-2, 3, 2)], float)
    emission = np.zeros((len(room) + 1, 3))
    emission[1] = 1
    divisions = np.full(len(room) + 1, 4)
    alone = Scene.from_polygons(room, 0.5, emission[:-1], divisions=divisions[:-1])
    sun = SunLamp("Sun", np.full(3, 1000.0), np.array((0.0, 0.0, 1.0)), 0.0)
    below = Scene.from_polygons([*room, roof], 0.5, emission, divisions=divisions, lamps=(sun,))
    expected, found = surfaces(lit(alone)), surfaces(lit(below))
    assert found[-1] == pytest.approx(500, rel=1e-3)
    assert found[:-1] == pytest.approx(expected, rel=0.02)


def test_the_day_outside_does_not_shine_through_single_sheets(box):
    room, things = box((5, 6, 2.7)), [((0.4, 0.4, 0.1), (2.3, 2.8, 2.5)), ((1.2, 1, 0.05), (1.5, 2, 0.4))]
    polygons = [*room, *(face for size, at in things for face in box(size, at, inward=False))]
    emission = np.zeros((len(polygons), 3))
    emission[6:12] = 5 * np.pi
    sides = np.where(np.arange(len(polygons)) < 6, BOTH, FRONT)
    night = Scene.from_polygons(polygons, 0.8, emission, sides=sides)
    day = replace(night, lamps=(SkyLamp("World", np.full((1, 1, 3), 50.0)),))
    lights = []
    for scene in (night, day):
        result = lit(scene, quality="preview", max_edge=0.35)
        patches, solution = result.patches, result.solution
        outside = ((patches.centre - (2.5, 3, 1.35)) * patches.normal).sum(axis=1) > 0
        outside &= patches.face < 6
        lights.append((patches.area @ np.where(outside, 0, solution.irradiance[:, 0]), result.corner_irradiance))
        assert solution.irradiance[outside] == pytest.approx(np.pi * 50 * (scene is day), rel=1e-3)
    (inside, corners), (by_day, corners_by_day) = lights
    assert by_day == pytest.approx(inside, rel=0.03)
    assert corners_by_day.mean() == pytest.approx(corners.mean(), rel=0.03)
