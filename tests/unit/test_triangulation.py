# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces in pieces: nothing lost, nothing outside, every corner used, and Delaunay where that can be had."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from core.scene import Scene
from core.triangulation import pieces, triangulate

seeds = st.integers(0, 2**32 - 1)

COMB = [(-1, -1), (10, -1), *((9 - i, 0 if i % 2 else 5) for i in range(10))]
SPIRAL = [(0, 0), (5, 0), (5, 5), (1, 5), (1, 2), (3, 2), (3, 3), (2, 3), (2, 4), (4, 4), (4, 1), (0, 1)]
ON_EDGES = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 3), (2, 3), (0, 3), (0, 2), (0, 1)]
WITH_HOLE = [(0, 0), (3, 0), (3, 3), (0, 3), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)]


def shoelace(outline):
    """Return the area of a plane polygon."""
    x, y = np.asarray(outline, dtype=float).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def star(seed, corners):
    """Return a random polygon around the origin, concave as a rule."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(corners) + rng.uniform(0.1, 0.9, corners)) / corners
    return rng.uniform(0.2, 0.5, corners)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def areas(points, triangles):
    """Return the signed areas of plane triangles."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


@given(seeds, st.integers(3, 12), st.integers(1, 4))
def test_polygons_of_one_size_are_tiled_by_triangles_that_turn_left(seed, corners, count):
    outlines = np.stack([star(seed + i, corners) for i in range(count)])
    triangles, polygon = triangulate(outlines)
    assert polygon.tolist() == sorted(polygon)
    for index, outline in enumerate(outlines):
        mine = triangles[polygon == index]
        assert set(mine.ravel().tolist()) == set(range(corners))
        assert np.all(areas(outline, mine) > 0)
        np.testing.assert_allclose(areas(outline, mine).sum(), shoelace(outline), rtol=1e-12)


@pytest.mark.parametrize("outline", [COMB, SPIRAL, ON_EDGES, WITH_HOLE], ids=["comb", "spiral", "on edges", "hole"])
def test_awkward_outlines_are_cut_without_loss(outline):
    points = np.array(outline, dtype=float) / 16
    for start in range(len(points)):
        turned = np.roll(points, start, axis=0)
        triangles, _ = triangulate(turned[None])
        assert np.all(areas(turned, triangles) > 0)
        np.testing.assert_allclose(areas(turned, triangles).sum(), shoelace(turned), rtol=1e-12)
        met = {tuple(point) for point in turned[triangles].reshape(-1, 2).tolist()}
        assert met == {tuple(point) for point in turned.tolist()}


# One polygon alone, of which one edge at a time can be flipped, more often than it has corners.
@example(10055, 9)
@given(seeds, st.integers(4, 10))
def test_no_circle_around_a_triangle_holds_another_corner_of_a_convex_outline(seed, corners):
    angle = np.sort(np.random.default_rng(seed).uniform(0, 2 * np.pi, corners))
    points = 0.5 * np.stack([np.cos(angle), 0.3 * np.sin(angle)], axis=1)
    triangles, _ = triangulate(points[None])
    for a, b, c in points[triangles]:
        centre = np.linalg.solve(2 * np.array([b - a, c - a]), [b @ b - a @ a, c @ c - a @ a])
        radius = np.linalg.norm(a - centre)
        assert np.all(np.linalg.norm(points - centre, axis=1) >= radius * (1 - 1e-6))


def test_an_outline_that_crosses_itself_still_ends():
    crossed = np.array([(0, 0), (1, 0.2), (0.1, 1), (1, 1), (0.5, -0.3)]) * 0.9
    triangles, polygon = triangulate(crossed[None])
    assert 1 <= len(triangles) == len(polygon) <= 3
    assert np.all(areas(crossed, triangles) > 0)


def test_triangles_and_convex_quads_stay_whole_and_keep_the_order_of_faces():
    concave = [(0, 0, 0), (2, 1, 0), (0, 2, 0), (0.5, 1, 0)]
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    bent = [(0, 0, 0), (1, 0, 0.2), (1, 1, 0), (0, 1, 0.2)]
    line = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
    pentagon = [(0, 0, 0), (2, 0, 0), (3, 1, 0), (1, 3, 0), (-1, 1, 0)]
    parts = pieces(Scene.from_polygons([concave, square, line, pentagon, bent, square[:3]]))
    assert parts.face.tolist() == [0, 0, 1, 3, 3, 3, 4, 5]
    assert parts.triangle.tolist() == [True, True, False, True, True, True, False, True]
    assert parts.corner[[2, 6, 7]].tolist() == [[4, 5, 6, 7], [16, 17, 18, 19], [20, 21, 22, 22]]


def test_the_only_cut_through_a_concave_quad_starts_at_its_notch():
    for start in range(4):
        arrow = np.roll([(0, 0, 0), (2, 1, 0), (0, 2, 0), (0.5, 1, 0)], start, axis=0)
        notch = (3 + start) % 4
        parts = pieces(Scene.from_polygons([arrow]))
        assert all({notch, (notch + 2) % 4} <= set(corner.tolist()) for corner in parts.corner)


def test_a_scene_without_faces_has_no_pieces():
    parts = pieces(Scene.from_polygons([]))
    assert parts.corner.shape == (0, 4) and parts.face.shape == (0,)
