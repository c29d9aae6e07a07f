# SPDX-License-Identifier: GPL-3.0-or-later
"""What blocks light is the union of the faces, in as few polygons as it takes."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.meshing import mesh
from core.occlusion.joining import components
from core.occlusion.surfaces import Occluding, occluder_polygons
from core.occlusion.trapezoids import trapezoids
from core.scene import BACK, BOTH, Scene

RIGHT = np.array([1.0, 0.0, 0.0])
TURN = np.array([[2, 1, 2], [-2, 2, 1], [-1, -2, 2]]) / 3  # a rotation without any axis left in place


def cells(mask, height=lambda x, y: 0.0 * x, size=1.0):
    """Return the unit squares of a mask as quads, shape (n, 4, 3)."""
    corner = np.argwhere(mask)[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    x, y = size * corner[..., 0], size * corner[..., 1]
    return np.stack([x, y, height(x, y)], axis=2)


def surfaces(polygons, max_edge=None, **fields):
    scene = Scene.from_polygons(polygons, **fields)
    return occluder_polygons(scene, mesh(scene, max_edge=max_edge))


def area(occluding):
    a, b, c = (occluding.vertices[occluding.triangles[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def covered(occluding, points):
    """Return how many triangles each point (m, 2) of the plane z = 0 lies in."""
    corners = occluding.vertices[occluding.triangles][:, :, :2]
    inside = np.ones((len(points), len(corners)), dtype=bool)
    for k in range(3):
        edge, arm = corners[:, (k + 1) % 3] - corners[:, k], points[:, None] - corners[:, k]
        inside &= edge[:, 0] * arm[..., 1] - edge[:, 1] * arm[..., 0] > 0
    return inside.sum(axis=1)


def mask_of(text):
    return np.array([[cell == "#" for cell in row] for row in text.split()])


SHAPES = {
    "wall": ("#### #### ####", 2),
    "strip": ("####", 2),
    "corner": ("##### ##### ###.. ###..", 4),
    "window": ("##### ##### ##.## ##### #####", 8),
    "two windows": ("####### ####### ##.#.## ####### #######", 10),
    "steps": ("#... ##.. ###. ####", 8),
    "cross": ("..##.. ..##.. ###### ###### ..##.. ..##..", 6),
    "islands": ("##.## ##.##", 4),
    "frame with island": ("####### #.....# #.###.# #.###.# #.###.# #.....# #######", 10),
}


@pytest.mark.parametrize(("text", "triangles"), SHAPES.values(), ids=SHAPES)
@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["level", "turned"])
def test_flat_faces_become_few(text, triangles, turn):
    mask = mask_of(text)
    found = surfaces(cells(mask) @ turn.T + [3.0, -2.0, 5.0])
    assert len(found.triangles) == triangles
    assert area(found) == pytest.approx(mask.sum(), rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.data())
def test_union_stays_the_same(width, height, data):
    mask = np.array(data.draw(st.lists(st.booleans(), min_size=width * height, max_size=width * height)))
    mask = mask.reshape(width, height)
    mask[0, 0] = True
    found = surfaces(cells(mask))
    # Off the diagonals along which quads are halved.
    middles = np.stack(np.meshgrid(np.arange(width), np.arange(height), indexing="ij"), axis=-1).reshape(-1, 2)
    for nudge in ([0.513, 0.4811], [0.017, 0.9837], [0.9921, 0.0311]):
        np.testing.assert_array_equal(covered(found, middles + nudge), mask.reshape(-1))
    assert area(found) == pytest.approx(mask.sum(), rel=1e-12)
    assert len(found.triangles) <= 2 * mask.sum()


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.floats(0.5, 3.0), st.booleans()), min_size=6, max_size=14))
def test_slanted_outlines_stay_the_same(spokes):
    # A star of rings with gaps: triangles about a middle, some left out.
    angle = np.linspace(0, 2 * np.pi, len(spokes), endpoint=False)
    radius = np.array([spoke for spoke, _ in spokes])
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    rings = [0.0, 0.3, 0.6, 1.0]
    polygons = []
    for k, (_, there) in enumerate(spokes):
        one, two = rim[k], rim[(k + 1) % len(rim)]
        polygons += [np.array([a * one, b * one, b * two, a * two]) for a, b in pairwise(rings) if a]
        if there:
            polygons.append(np.array([0.0 * one, rings[1] * one, rings[1] * two]))
    alone = [surfaces([polygon]) for polygon in polygons]
    found = surfaces(polygons)
    points = np.random.default_rng(len(spokes)).uniform(-3, 3, (500, 2))
    np.testing.assert_array_equal(covered(found, points), sum(covered(one, points) for one in alone))
    assert area(found) == pytest.approx(sum(area(one) for one in alone), rel=1e-9)
    assert len(found.triangles) <= sum(len(one.triangles) for one in alone)


def test_finely_meshed_slanted_shapes_become_few():
    fine = np.indices((30, 30)).sum(axis=0) < 30
    triangles = [quad[[0, 1, 3]] for quad in cells(np.indices((30, 30)).sum(axis=0) == 29)]
    below = list(cells(np.indices((30, 30)).sum(axis=0) < 29))
    found = surfaces(below + triangles)
    assert fine.sum() == len(below) + len(triangles)
    assert len(found.triangles) == 1
    # With a window in it.
    found = surfaces([quad for quad in below if not np.all(abs(quad.mean(axis=0)[:2] - 8) < 3)] + triangles)
    assert len(found.triangles) <= 10
    assert area(found) == pytest.approx(450 - 36, rel=1e-12)


def test_n_gons():
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    disc = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    assert len(surfaces([disc]).triangles) == 10
    arrow = np.array([[0, 0, 0], [2, 1, 0], [0, 2, 0], [1, 1, 0]], float)
    found = surfaces([arrow])
    np.testing.assert_array_equal(covered(found, np.array([[0.5, 1.01], [1.2, 1.03]])), [0, 1])
    assert area(found) == pytest.approx(1.0)
    corner = np.array([[0, 0, 0], [3, 0, 0], [3, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]], float)
    found = surfaces([corner])
    assert area(found) == pytest.approx(4.0)


def test_curved_meshes_pass_through():
    quads = cells(np.ones((20, 20)), lambda x, y: 0.3 * np.sin(x / 4) * np.cos(y / 3))
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    found = surfaces(triangles)
    assert len(found.triangles) == len(triangles)
    assert set(found.triangle_face) == set(range(len(triangles)))
    assert np.all(found.slack == 0)


def test_gentle_curves_are_not_flattened():
    # Each face is coplanar with the next to tolerance, yet the strip bends.
    strip = cells(np.ones((2000, 1)), lambda x, y: 4e-9 * x**2, size=1.0)
    found = surfaces(strip)
    corners = found.vertices[found.triangles]
    middle = corners.mean(axis=1)
    assert np.abs(middle[:, 2] - 4e-9 * middle[:, 0] ** 2).max() < 3e-7 * 2000
    assert area(found) == pytest.approx(2000, rel=1e-6)


def test_bent_quads_block_as_their_patches():
    bent = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.2], [0, 1, 0]])
    for sides in (1, BACK, BOTH):
        found = surfaces([bent], max_edge=0.3, sides=[sides])
        assert len(found.triangles) == 2 * 4 * 4
        corners = found.vertices[found.triangles]
        # On the surface z = 0.2 x y, and facing the way the face does.
        np.testing.assert_allclose(corners[..., 2], 0.2 * corners[..., 0] * corners[..., 1], atol=1e-12)
        assert np.all(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0)
        # The slack is how far the middle of a patch is from its diagonal.
        np.testing.assert_allclose(found.slack, 0.2 / 16 / 4, rtol=1e-9)


def test_faces_without_area_block_nothing():
    line = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], float)
    square = np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    found = surfaces([line, square])
    assert set(found.triangle_face) == {1}
    assert len(surfaces([line]).triangles) == 0
    assert len(occluder_polygons(Scene.from_polygons([]), mesh(Scene.from_polygons([]))).triangles) == 0


def test_only_what_is_one_surface_is_joined():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    beside = square + RIGHT
    assert len(surfaces([square, beside]).triangles) == 2
    # Objects and materials do not matter, nor vertices that are double.
    found = surfaces([square, beside + 1e-9], face_object=[0, 1], object_names=("a", "b"))
    assert len(found.triangles) == 2
    # Backs, folds and gaps do.
    for other in (beside[::-1], beside @ np.diag([1, 1, 0]) + [0, 0, 1e-3], beside + 0.001 * RIGHT):
        assert len(surfaces([square, other]).triangles) == 4
    folded = np.array([[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]], float)
    assert len(surfaces([square, folded]).triangles) == 4


def test_overlapping_faces_stay_apart():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    beside = square + RIGHT
    for polygons in ([square, square, beside], [square, beside, beside[[0, 1, 2]], beside + RIGHT]):
        found = surfaces(polygons)
        assert set(np.flatnonzero(covered(found, np.array([[0.5, 0.4], [1.5, 0.4], [5, 5]])))) == {0, 1}
    # A winding ramp in one plane that comes to lie over its own beginning, without sharing an edge with it.
    ring = [np.array([[3 * k, 0, 0], [3 * k + 3, 0, 0], [3 * k + 3, 3, 0], [3 * k, 3, 0]], float) for k in range(2)]
    ring += [np.array([[3, 3, 0], [6, 3, 0], [6, 6, 0], [3, 6, 0]], float)]
    ring += [np.array([[-1, 3, 0], [3, 3, 0], [3, 6, 0], [-1, 6, 0]], float)]
    ring += [np.array([[-1, 1, 0], [1, 1, 0], [1, 3, 0], [-1, 3, 0]], float)]
    found = surfaces(ring)
    assert np.all(covered(found, np.array([[0.51, 2.03], [4.4, 1.01], [4.4, 4.01], [1.1, 4.01], [-0.5, 2.01]])) >= 1)


def test_pinched_outlines_stay_apart():
    mask = mask_of("##### #.### ##.## #####")
    found = surfaces(cells(mask))
    assert area(found) == pytest.approx(mask.sum())
    points = np.argwhere(np.ones_like(mask)) + np.array([0.51, 0.47])
    np.testing.assert_array_equal(covered(found, points), mask.reshape(-1))


def test_components_of_long_chains():
    a = np.random.default_rng(1).permutation(999)
    np.testing.assert_array_equal(components(1002, a, a + 1), [0] * 1000 + [1000, 1001])


def test_trapezoids_follow_the_longest_border():
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    corners = np.array([[0, 0], [5, 0], [5, 1], [2, 1], [2, 3], [0, 3.0]]) @ turn
    cut = trapezoids(corners, np.roll(corners, -1, axis=0), 1e-9)
    assert len(cut) == 2
    lengths = np.sort(np.linalg.norm(np.roll(cut, -1, axis=1) - cut, axis=2).reshape(-1))
    np.testing.assert_allclose(lengths, [1, 1, 2, 2, 2, 2, 5, 5])


def test_diagonal():
    assert Occluding(np.array([[0, 0, 0], [3, 4, 12.0]]), np.zeros((0, 3), int), np.zeros(0, int)).diagonal == 13
    assert Occluding(np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros(0, int)).diagonal == 1
