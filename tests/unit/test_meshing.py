# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches: they tile their faces, keep to the length asked for, and know the mesh corners that they touch."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.meshing import mesh
from core.scene import BACK, BOTH, FRONT, Scene
from tests.unit.flat_shapes import ARROW, ELL, FLAT, LINE, NEEDLE, SQUARE, TRIANGLE

seeds = st.integers(0, 2**32 - 1)
cuts = st.one_of(
    st.builds(lambda n: {"subdivide": n}, st.integers(1, 4)),
    st.builds(lambda edge: {"max_edge": edge}, st.floats(0.05, 3)),
)


@st.composite
def outlines(draw):
    """Draw a plane polygon of 3 to 8 corners, often concave, of some size, somewhere in space, and its plane."""
    rng = np.random.default_rng(draw(seeds))
    corners = draw(st.integers(3, 8))
    angle = 2 * np.pi * (np.arange(corners) + rng.uniform(0.1, 0.9, corners)) / corners
    flat = rng.uniform(0.2, 1, corners)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # Some are long and thin.
    flat *= draw(st.sampled_from([1.0, 0.1, 0.01]))
    flat[:, 0] *= 1 / np.max(np.abs(flat))
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return flat @ frame[:2], np.cross(frame[0], frame[1])


def edges(corners):
    """Return the lengths of all edges."""
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def beyond(points, polygon, normal):
    """Return how far points of its plane lie outside a polygon; 0 inside."""
    start, along = polygon, np.roll(polygon, -1, axis=0) - polygon
    arm = points[:, None] - start
    share = np.clip(np.sum(arm * along, axis=2) / np.sum(along * along, axis=1), 0, 1)
    gap = np.min(np.linalg.norm(arm - share[:, :, None] * along, axis=2), axis=1)
    # The angle that the outline turns around a point is a full turn inside and none outside.
    following = np.roll(arm, -1, axis=1)
    turn = np.arctan2(np.cross(arm, following) @ normal, np.sum(arm * following, axis=2)).sum(axis=1)
    return np.where(np.abs(turn) > np.pi, 0, gap)


@given(outlines(), cuts)
def test_patches_tile_a_plane_polygon(outline, cut):
    polygon, normal = outline
    scene = Scene.from_polygons([polygon])
    patches = mesh(scene, **cut)
    # As much area as the face, none of it outside and none turned over: so nothing is missing and nothing is double.
    np.testing.assert_allclose(patches.area.sum(), scene.face_area[0], rtol=1e-9)
    assert np.all(patches.area > 0)
    np.testing.assert_allclose(patches.normal, np.broadcast_to(normal, patches.normal.shape), atol=1e-6)
    points = np.concatenate([patches.corners.reshape(-1, 3), patches.centre])
    assert np.max(np.abs((points - polygon[0]) @ normal)) < 1e-12
    assert np.max(beyond(points, polygon, normal)) < 1e-9


@given(outlines(), cuts)
def test_every_corner_of_a_polygon_touches_the_patches_around_it_and_no_other(outline, cut):
    polygon, _ = outline
    scene = Scene.from_polygons([polygon])
    patches = mesh(scene, **cut)
    position = scene.vertices[scene.corner_vertex]
    # Bit by bit the same place, found by looking at all patches.
    meets = np.all(patches.corners[None] == position[:, None, None], axis=3).any(axis=2)
    assert [(c, p) for c, p in np.argwhere(meets)] == list(zip(patches.touch_corner, patches.touch_patch, strict=True))
    assert set(patches.touch_corner) == set(range(len(polygon)))


@given(outlines(), st.floats(0.03, 3))
def test_no_edge_is_longer_than_asked_for(outline, max_edge):
    patches = mesh(Scene.from_polygons([outline[0]]), max_edge=max_edge)
    assert np.max(edges(patches.corners)) <= max_edge * (1 + 2e-9)


@pytest.mark.parametrize("n", [1, 2, 3, 7])
@pytest.mark.parametrize(
    "polygon, parts",
    [(SQUARE, 1), (TRIANGLE, 1), (NEEDLE, 1), (ARROW, 2), (ELL, 4)],
    ids=["quad", "tri", "thin", "arrow", "L"],
)
def test_n_cuts_every_piece_into_n_squared(polygon, parts, n):
    assert len(mesh(Scene.from_polygons([polygon], divisions=[n])).area) == parts * n**2
    assert len(mesh(Scene.from_polygons([polygon], divisions=[2]), subdivide=n).area) == parts * (2 * n) ** 2


@given(seeds, st.integers(1, 5))
def test_the_patches_of_a_bent_quad_lie_on_its_bilinear_surface(seed, n):
    rng = np.random.default_rng(seed)
    a, b, c, d = quad = SQUARE + rng.uniform(-0.2, 0.2, (4, 3))
    scene = Scene.from_polygons([quad], divisions=[n])
    patches = mesh(scene)
    u, v = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n, indexing="ij")
    u, v = u[..., None], v[..., None]
    surface = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    grid = np.stack([surface[:-1, :-1], surface[1:, :-1], surface[1:, 1:], surface[:-1, 1:]], axis=2)
    np.testing.assert_allclose(patches.corners, grid.reshape(-1, 4, 3), atol=1e-14)
    np.testing.assert_allclose(patches.centre, patches.corners.mean(axis=1), atol=1e-14)
    # Whatever the surface does in between, its outline fixes the sum of the vector areas.
    np.testing.assert_allclose(patches.area @ patches.normal, scene.area_vector[0], atol=1e-14)


def test_rows_of_similar_triangles_turn_like_their_triangle():
    patches = mesh(Scene.from_polygons([TRIANGLE], divisions=[3]))
    np.testing.assert_array_equal(patches.corners[:, 2], patches.corners[:, 3])
    np.testing.assert_allclose(patches.area, 0.5 / 9)
    np.testing.assert_allclose(patches.normal, np.tile([0, 0, 1], (9, 1)), atol=1e-14)
    np.testing.assert_allclose(patches.centre, patches.corners[:, :3].mean(axis=1))


def test_long_quads_get_square_patches():
    patches = mesh(Scene.from_polygons([SQUARE * (5, 0.5, 1)]), max_edge=0.25)
    assert len(patches.area) == 20 * 2
    np.testing.assert_allclose(edges(patches.corners), 0.25)


@pytest.mark.parametrize("thin", [NEEDLE, NEEDLE[[1, 2, 0]], NEEDLE[[0, 2, 1]], FLAT, FLAT[[1, 2, 0]], FLAT[[2, 1, 0]]])
def test_thin_triangles_are_cut_across(thin):
    scene = Scene.from_polygons([thin])
    patches = mesh(scene, max_edge=0.1)
    assert len(patches.area) < 500 < 100**2
    np.testing.assert_allclose(patches.area.sum(), scene.face_area[0], rtol=1e-12)
    assert np.max(edges(patches.corners)) <= 0.1 * (1 + 1e-8)
    repeated = np.all(patches.corners[:, 2] == patches.corners[:, 3], axis=1)
    distinct = np.array([len(np.unique(corners, axis=0)) for corners in patches.corners])
    np.testing.assert_array_equal(distinct, np.where(repeated, 3, 4))


def test_an_edge_that_is_a_multiple_gains_no_patch_by_rounding():
    for parts in range(1, 60):
        width = parts * 0.1  # often a little above or below the multiple
        assert len(mesh(Scene.from_polygons([SQUARE * (width, 0.05, 1)]), max_edge=0.1).area) == parts


def test_neighbours_cut_a_shared_edge_alike():
    left, right = SQUARE * (2, 0.7, 1), SQUARE * (0.4, 0.7, 1) + np.array([2, 0, 0])
    patches = mesh(Scene.from_polygons([left, right]), max_edge=0.1)
    on_edge = [np.unique(corners[corners[..., 0] == 2], axis=0) for corners in np.split(patches.corners, [20 * 7])]
    np.testing.assert_allclose(on_edge[0], on_edge[1], rtol=1e-15)
    assert len(on_edge[0]) == 8


@pytest.mark.parametrize("polygon", [SQUARE, TRIANGLE, ELL, NEEDLE], ids=["quad", "triangle", "L", "fan"])
@pytest.mark.parametrize("cut", [{}, {"subdivide": 2}, {"max_edge": 0.3}], ids=["whole", "n", "edge"])
def test_a_back_is_the_front_turned_over(polygon, cut):
    front, back, both = (
        mesh(Scene.from_polygons([polygon], 0.5, [1, 2, 3], sides=[sides]), **cut) for sides in (FRONT, BACK, BOTH)
    )
    n = len(front.area)
    np.testing.assert_array_equal(back.normal, -front.normal)
    np.testing.assert_array_equal(back.centre, front.centre)
    np.testing.assert_array_equal(both.area, np.tile(front.area, 2))
    np.testing.assert_array_equal(both.corners, np.concatenate([front.corners, back.corners]))
    np.testing.assert_array_equal(both.normal, np.concatenate([front.normal, back.normal]))
    assert both.side.tolist() == [1] * n + [-1] * n and both.side.dtype == np.int8
    np.testing.assert_array_equal(both.emission, np.tile([1, 2, 3], (2 * n, 1)))
    # Seen from where the normal points, every patch turns left, triangles repeat their last corner.
    for patches in (front, back):
        a, b, c, d = np.moveaxis(patches.corners, 1, 0)
        assert np.all(np.sum(np.cross(c - a, d - b) * patches.normal, axis=1) > 0)
        np.testing.assert_array_equal(np.all(c == d, axis=1), [len(np.unique(x, axis=0)) == 3 for x in patches.corners])
    # Both sides show the front, a back shows itself.
    for patches in (back, both):
        np.testing.assert_array_equal(patches.touch_corner, front.touch_corner)
        np.testing.assert_array_equal(patches.touch_patch, front.touch_patch)


def test_patches_follow_the_faces_front_before_back():
    polygons = [ELL, SQUARE, LINE, TRIANGLE, SQUARE]
    rho = np.arange(5)[:, None] * [0.1, 0.1, 0.1]
    sides = [BACK, BOTH, FRONT, BOTH, FRONT]
    scene = Scene.from_polygons(polygons, rho, 2 * rho, sides=sides, divisions=[1, 2, 1, 2, 1])
    patches = mesh(scene)
    assert patches.face.tolist() == [0] * 4 + [1] * 8 + [3] * 8 + [4]
    assert patches.side.tolist() == [-1] * 4 + [1] * 4 + [-1] * 4 + [1] * 4 + [-1] * 4 + [1]
    np.testing.assert_array_equal(patches.reflectance, rho[patches.face])
    np.testing.assert_array_equal(patches.emission, 2 * rho[patches.face])
    # Corners of all faces but the one without area, each on its own face and on the side that is shown.
    assert set(patches.touch_corner) == set(range(20)) - {10, 11, 12}
    np.testing.assert_array_equal(scene.corner_face[patches.touch_corner], patches.face[patches.touch_patch])
    shown = np.array([-1, 1, 1, 1, 1])
    np.testing.assert_array_equal(patches.side[patches.touch_patch], shown[patches.face[patches.touch_patch]])


def test_corners_at_one_place_touch_patches_at_that_place():
    doubled = SQUARE[[0, 1, 1, 2, 3, 3]]
    patches = mesh(Scene(doubled, range(6), [0, 6], [[0, 0, 0]], [[0, 0, 0]]), subdivide=2)
    np.testing.assert_allclose(patches.area.sum(), 1)
    assert set(patches.touch_corner) == set(range(6))
    meets = np.all(patches.corners[patches.touch_patch] == doubled[patches.touch_corner][:, None], axis=2)
    assert np.all(np.any(meets, axis=1))


def test_the_tip_of_a_spike_takes_the_patches_of_its_neighbour():
    spiked = np.array([(0, 0, 0), (1, 0, 0), (3, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
    patches = mesh(Scene(spiked, range(6), [0, 6], [[0, 0, 0]], [[0, 0, 0]]))
    np.testing.assert_allclose(patches.area.sum(), 1)
    assert set(patches.touch_corner) == set(range(6))


@pytest.mark.parametrize("polygon", [SQUARE, TRIANGLE, ELL])
def test_far_from_the_origin_areas_and_normals_keep_their_digits(polygon):
    size = 2.0**-6  # so that the corners themselves lose nothing
    near, far = (mesh(Scene.from_polygons([polygon * size + place]), subdivide=3) for place in (0.0, 1e6))
    np.testing.assert_allclose(far.area, near.area, rtol=1e-12)
    np.testing.assert_allclose(far.normal, near.normal, atol=1e-12)
    np.testing.assert_allclose(far.corners - 1e6, near.corners, atol=2e-10)


@pytest.mark.parametrize("width", [0, 1e-16, 1e-13, 1e-11, 1e-10, 1e-8])
def test_slivers_are_cut_into_patches_that_face_the_front_or_are_left_out(width):
    spiked = np.array([(0, 0, 0), (1, 0, 0), (3, 0, 0), (1, width, 0), (1, 1, 0), (0, 1, 0)])
    for seed in range(5):
        frame = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        scene = Scene.from_polygons([spiked @ frame])
        patches = mesh(scene, subdivide=100)
        np.testing.assert_allclose(patches.area.sum(), scene.face_area[0], rtol=1e-9)
        assert np.all(patches.normal @ scene.face_normal[0] > 0.9)
        assert set(patches.touch_corner) == set(range(6))


def test_a_scene_without_live_faces_has_no_patches():
    for polygons in ([], [LINE]):
        patches = mesh(Scene.from_polygons(polygons), max_edge=0.1)
        assert patches.corners.shape == (0, 4, 3) and patches.normal.shape == (0, 3)
        assert patches.touch_corner.shape == patches.touch_patch.shape == (0,)
