# SPDX-License-Identifier: GPL-3.0-or-later
"""Light where surfaces meet: at edges, in corners, and at the foot of what stands on something."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.form_factors import point_to_polygon
from core.hierarchy import meetings
from core.hierarchy.elements import Elements
from core.hierarchy.meetings import towards_middle
from core.hierarchy.nearness import draw_near, nearest_points
from core.hierarchy.sights import Sights
from core.scene import Scene
from core.sequences import PLASTIC

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
TRIANGLE = SQUARE[[0, 1, 2, 2]]
UP = np.array([0.0, 0.0, 1.0])
# Evenly spread pairs of numbers (Roberts 2018).
U, V = (np.arange(40_000)[:, None] * PLASTIC % 1).T
coordinate = st.floats(-1.5, 2.5)


def repeated(*arrays):
    return [np.repeat(np.asarray(array, float)[None], len(U), axis=0) for array in arrays]


@pytest.mark.parametrize("polygon", [SQUARE, TRIANGLE], ids=["square", "triangle"])
@pytest.mark.parametrize("height", [1.0, 0.1, 0.003])
@pytest.mark.parametrize(
    ("at", "normal"),
    [
        ((0.5, 0.4), (0, 0, -1)),
        ((0.5, 0.001), (0, 1, 0)),
        ((1, 0), (-0.6, 0, -0.8)),
        ((0.6, 0.05), (0, -1, 0)),
    ],
    ids=["above", "at an edge", "over a corner", "looking at a narrow end"],
)
def test_points_near_a_receiver_integrate_to_its_form_factor(polygon, height, at, normal):
    point, facing = np.array([*at, height]), np.array(normal, float)
    drawn, weight = draw_near(*repeated(point), U, V, *repeated(polygon, UP))
    assert nearest_points(drawn, *repeated(polygon, UP)) == pytest.approx(drawn, abs=1e-9)
    to = drawn - point
    cosines = np.maximum(to @ facing, 0) * np.maximum(-to @ UP, 0)
    area = 0.5 if polygon is TRIANGLE else 1.0
    factor = area * (weight * cosines / (to**2).sum(axis=1) ** 2).mean() / np.pi
    exact = point_to_polygon(point[None], facing[None], polygon[None])[0]
    assert factor == pytest.approx(exact, rel=0.03, abs=2e-4)


@given(st.tuples(coordinate, coordinate, coordinate))
@pytest.mark.parametrize("polygon", [SQUARE, TRIANGLE], ids=["square", "triangle"])
def test_no_point_of_a_polygon_is_nearer_than_the_nearest(polygon, point):
    side = np.linspace(0, 1, 41)
    u, v = (grid.ravel() for grid in np.meshgrid(side, side))
    if polygon is TRIANGLE:
        u, v = np.maximum(u, v), np.minimum(u, v)
    there = np.column_stack((u, v, 0 * u))
    nearest = nearest_points(np.array([point]), polygon[None], UP[None])[0]
    least = np.sqrt(((there - point) ** 2).sum(axis=1)).min()
    distance = np.sqrt(((nearest - point) ** 2).sum())
    assert distance <= least + 1e-12 and distance >= least - 0.02


@pytest.mark.parametrize("walls", [1, 2], ids=["at an edge", "in a corner"])
def test_how_far_off_the_other_wall_is_seen(walls):
    """Against many points of walls whose light rises evenly from where they meet the floor, and from each other."""
    stands = 0.02
    floor = np.array([0.5 if walls == 1 else stands, stands, 0.0])
    wall = SQUARE[::-1, [0, 2, 1]]
    drawn, weight = draw_near(*repeated(floor), U, V, *repeated(wall, (0, 1, 0)))
    to = drawn - floor
    seen = -weight * to[:, 2] * to[:, 1] / (to**2).sum(axis=1) ** 2
    # The way to the middle is half as far in each direction that light changes in.
    ways = drawn[:, 2] / 0.5 if walls == 1 else (drawn[:, 0] + drawn[:, 2])
    exact = (seen * ways).sum() / seen.sum()

    none = np.zeros((2, 3))
    normal = np.array([(0, 1, 0), (1, 0, 0)], float)
    both = np.stack((wall, SQUARE[:, [2, 0, 1]]))
    elements = Elements(both, both.mean(axis=1), normal, np.ones(2), np.arange(2), none, none, np.ones(2))
    which = np.arange(walls)
    sights = Sights(np.zeros(walls, np.int64), which, np.full(walls, 0.4), np.zeros((walls, 3)))
    found = towards_middle(sights, 1 + which, np.array([floor / meetings._NEARER] * 3), elements)
    assert found[0] == pytest.approx(exact, rel=0.15)


def room(box, divisions, *, block=None):
    """Return a bright box with one bright wall, and on request a block on its floor that no vertex of it touches."""
    polygons = [*box()]
    if block is not None:
        at, size = block
        polygons += box(size, at, inward=False)
    emission = np.zeros((len(polygons), 3))
    emission[5] = 1
    count = np.full(len(polygons), divisions)
    return Scene.from_polygons(polygons, 0.85, emission, divisions=count)


def test_the_corners_of_a_bright_room_do_not_depend_on_the_patches(box, light):
    coarse, fine = (
        light(room(box, divisions), "hierarchical", quality="high").corner_radiance[:, 0] for divisions in (3, 12)
    )
    assert coarse == pytest.approx(fine, rel=0.015)


def test_the_foot_of_a_block_does_not_depend_on_the_patches(box, light):
    block = ((0.31, 0.29, 0.0), (0.22, 0.26, 0.35))
    coarse, fine = (
        light(room(box, divisions, block=block), "hierarchical", quality="high").corner_radiance[28:, 0]
        for divisions in (4, 14)
    )
    assert coarse == pytest.approx(fine, rel=0.07)


@pytest.fixture
def behind_a_panel(box, light):
    """Return the light on the end that a lamp shines past of a panel 2 cm off a wall, by how finely that is cut."""

    def irradiance(divisions):
        panel, lamp = box((0.8, 0.05, 0.8), (0.2, 0.02, 0.5), inward=False), box((0.1, 0.1, 0.1), (1.25, 0.25, 0.85))
        polygons = [*box((2, 2, 2)), *panel, *(face[::-1] for face in lamp)]
        on_wall = [all(face[:, 1] == 0) for face in polygons]
        count = np.where(on_wall, divisions, np.repeat([6, 4, 1], 6))
        glow = np.repeat([[0.0], [20.0]], [12, 6], axis=0) * np.ones(3)
        scene = Scene.from_polygons(polygons, 0.7, glow, divisions=count)
        at, normal = scene.vertices[scene.corner_vertex], scene.face_normal[scene.corner_face]
        back = np.isclose(at[:, 1], 0.02) & np.isclose(at[:, 0], 1.0) & (normal[:, 1] < -0.5)
        assert back.sum() == 2
        return light(scene, "hierarchical").corner_irradiance[back].mean()

    return irradiance


@pytest.mark.parametrize("divisions", [8, 10, 11])
def test_across_a_narrow_gap_a_shadow_is_seen_where_it_falls(behind_a_panel, divisions):
    assert behind_a_panel(divisions) == pytest.approx(behind_a_panel(60), rel=0.12)


def cushion(sides=24):
    """Return a shallow bowl of narrow faces with a lid, 2 mm over the floor, and the height of its lower rims [m]."""
    turn = np.arange(sides) * 2 * np.pi / sides
    lowest, lower, upper = (
        np.column_stack((0.47 + radius * np.cos(turn), 0.53 + radius * np.sin(turn), np.full(sides, height)))
        for radius, height in ((0.05, 0.002), (0.08, 0.008), (0.17, 0.06))
    )
    rings = [
        np.stack((low, np.roll(low, -1, axis=0), np.roll(high, -1, axis=0), high), axis=1)
        for low, high in ((lowest, lower), (lower, upper))
    ]
    return [*rings[0], *rings[1], lowest[::-1], upper]


def test_what_nearly_touches_a_coarse_floor_is_dark_as_over_a_fine_one(box, light):
    faces = [*box(), *cushion()]
    glow = np.zeros((len(faces), 3))
    glow[5] = 1

    def at_rim(divisions):
        count = np.repeat([divisions, 1], [6, len(faces) - 6])
        scene = Scene.from_polygons(faces, 0.7, glow, divisions=count)
        rim = np.isclose(scene.vertices[scene.corner_vertex, 2], 0.002)
        sideways = scene.face_normal[scene.corner_face, 2] > -0.999
        return light(scene, "hierarchical").corner_irradiance[rim & sideways].mean()

    assert at_rim(3) == pytest.approx(at_rim(30), rel=0.07)
