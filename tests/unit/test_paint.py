# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that vary inside faces: points, means, rasters, corners, and light among them."""

from dataclasses import replace

import numpy as np
import pytest

from core.errors import RadiosityError
from core.meshing import mesh
from core.paint.averages import Triangles, face_means
from core.paint.paint import join_paint
from core.paint.samples import paint_samples
from core.scene import BOTH, Scene
from tests.unit.painted_faces import SQUARE, furnace, halves, painted

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])  # a rotation


@pytest.mark.parametrize("parts", [1, 2, 5])
def test_points_integrate_what_is_curved_like_a_parabola(parts):
    corners = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0]], float)
    triangles = Triangles(corners[None], np.arange(3)[None], np.zeros(1, int))
    samples = paint_samples(np.array([parts]))
    x, y, _ = (samples.share @ corners).T
    assert len(x) == 3 * parts**2 and (samples.share > 0).all()
    # The integrals of x^2, y^2 and x y over a right triangle, over its area.
    mean = face_means(samples, np.stack([x**2, y**2, x * y], axis=1), triangles, 1)
    np.testing.assert_allclose(mean, [[4 / 6, 9 / 6, 6 / 12]], rtol=1e-12)


def test_a_face_and_its_patches_have_their_own_means():
    scene = painted(SQUARE, halves, parts=17)
    np.testing.assert_allclose(scene.reflectance, [[0.4, 0.4, 0.0]], atol=1e-9)
    np.testing.assert_allclose(mesh(scene).reflectance, scene.reflectance)
    cut = mesh(scene, subdivide=4)
    expected = halves(cut.centre)[:, :3]
    np.testing.assert_allclose(cut.reflectance, expected, atol=0.02)


def test_backs_look_like_fronts():
    scene = painted(SQUARE, halves, parts=17, sides=[BOTH])
    cut = mesh(scene, subdivide=2)
    np.testing.assert_allclose(cut.reflectance, halves(cut.centre)[:, :3], atol=0.02)
    assert set(cut.side) == {1, -1}


def test_paint_moves_with_its_faces():
    scene = painted(SQUARE, halves)
    offset = np.array([5.0, -3.0, 2.0])
    # Sheared too, as instances may be.
    linear = TURN @ [[2.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]
    order = np.array([3, 2, 1, 0])
    paint = scene.paint.moved(linear, offset, order)
    pieces = mesh(scene, subdivide=2).corners
    known, moved, _ = paint.means(pieces @ linear.T + offset, np.zeros(4, int))
    assert known.all()
    np.testing.assert_allclose(moved, scene.paint.means(pieces, np.zeros(4, int))[1], atol=1e-6)
    np.testing.assert_array_equal(paint.corner_reflectance, scene.paint.corner_reflectance[order])


def test_corners_stand_for_what_is_around_them():
    scene = painted(SQUARE, halves)
    np.testing.assert_allclose(scene.corner_reflectance, halves(scene.vertices[scene.corner_vertex])[:, :3], atol=1e-9)
    np.testing.assert_array_equal(scene.corner_emission, 0.0)


def grid(size):
    at = np.arange(size) / size
    square = np.array(SQUARE[0], float) / size
    return [square + (x, y, 0) for y in at for x in at]


def test_a_chessboard_stays_crisp_and_a_gradient_smooth():
    def chess(points):
        white = (np.floor(4 * points[:, :2]).sum(axis=1) % 2)[:, None]
        return np.repeat(0.8 * white, 6, axis=1)

    board = painted(grid(4), chess, parts=2)
    np.testing.assert_allclose(board.corner_reflectance, board.reflectance[board.corner_face], atol=1e-6)

    slope = painted(grid(4), lambda points: np.repeat(points[:, :1] * 0.5, 6, axis=1), parts=2)
    place = slope.vertices[slope.corner_vertex][:, :2]
    inner = ((place > 0) & (place < 1)).all(axis=1)
    expected = np.repeat(0.5 * place[inner, :1], 3, axis=1)
    np.testing.assert_allclose(slope.corner_reflectance[inner], expected, rtol=1e-6)


@pytest.mark.parametrize("method", ["hierarchical", "gathering", "shooting"])
def test_a_painted_furnace_is_even(box, light, method):
    scene = painted(box(), furnace, divisions=np.full(6, 3))
    result = light(scene, method, tolerance=1e-5)
    # Patches of a mean reflectance are what is not exact: half a percent.
    np.testing.assert_allclose(result.solution.radiosity, 1.0, rtol=0.02)
    np.testing.assert_allclose(result.corner_radiance * np.pi, 1.0, rtol=0.02)
    assert result.report.energy.error < 5e-3


def test_a_floor_of_two_colors_bleeds_on_both_walls(box, light):
    def color(points):
        values = np.repeat([[0.5, 0.5, 0.5, 0.0, 0.0, 0.0]], len(points), axis=0)
        floor, ceiling = points[:, 2] < 1e-9, points[:, 2] > 1 - 1e-9
        values[floor] = halves(points[floor])
        values[ceiling] = (0, 0, 0, 1, 1, 1)
        return values

    polygons = box()
    result = light(painted(polygons, color, parts=17), "hierarchical")
    left, right = (result.patches.normal[:, 0] == turn for turn in (1, -1))
    B = result.solution.radiosity
    assert (B[left, 0] > 1.04 * B[left, 1]).all() and (B[right, 1] > 1.04 * B[right, 0]).all()
    # The same with a face for each color.
    floor = [np.array([(x, 0, 0), (x + 0.5, 0, 0), (x + 0.5, 1, 0), (x, 1, 0)]) for x in (0, 0.5)]
    values = color(np.array([polygon.mean(axis=0) for polygon in [*floor, *polygons[1:]]]))
    apart = light(Scene.from_polygons([*floor, *polygons[1:]], values[:, :3], values[:, 3:]), "hierarchical")
    np.testing.assert_allclose(B[1:], apart.solution.radiosity[2:], rtol=0.01)


def test_paints_are_joined_with_plain_meshes(box):
    one = painted(SQUARE, halves)
    joined = join_paint(
        [
            (np.full((2, 3), 0.25), np.ones((2, 3)), np.array([0, 0, 0, 1, 1, 1]), None),
            (one.reflectance, one.emission, one.corner_face, one.paint),
        ]
    )
    assert joined.face.tolist() == [2]
    np.testing.assert_array_equal(joined.corner_reflectance[:6], 0.25)
    np.testing.assert_array_equal(joined.corner_emission[:6], 1.0)
    np.testing.assert_array_equal(joined.corner_reflectance[6:], one.corner_reflectance)
    assert join_paint([(one.reflectance, one.emission, one.corner_face, None)]) is None


def test_bad_paint_is_refused_and_bright_paint_is_capped():
    scene = painted(SQUARE, halves)
    with pytest.raises(RadiosityError, match="paint does not fit"):
        replace(scene, paint=join_paint([(scene.reflectance, scene.emission, scene.corner_face, scene.paint)] * 2))
    bad = replace(scene.paint, emission=np.full_like(scene.paint.emission, np.nan))
    with pytest.raises(RadiosityError, match="not a finite number"):
        replace(scene, paint=bad)
    white = replace(scene.paint, reflectance=np.ones_like(scene.paint.reflectance))
    assert replace(scene, paint=white).paint.reflectance.max() == np.float32(0.99)
