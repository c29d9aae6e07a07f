# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene: what is measured, what is refused and what is put right, in words that name the object."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.errors import RadiosityError
from core.scene import BACK, BOTH, FRONT, Scene

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
LINE = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0)], dtype=float)
BESIDE = SQUARE + np.array([1, 0, 0])
BENT = np.array([(0, 0, 0), (1, 0, 1), (1, 1, 0), (0, 1, 1)], dtype=float)


def scene(**changes):
    """Return one square of an object called Wall, with some arguments replaced."""
    arguments = {
        "vertices": SQUARE,
        "corner_vertex": range(4),
        "face_start": [0, 4],
        "reflectance": [[0.5, 0.4, 0.3]],
        "emission": [[0, 0, 1]],
        "object_names": ["Wall"],
    }
    return Scene(**(arguments | changes))


def test_defaults_are_one_flat_front_side():
    square = scene()
    assert square.sides.tolist() == [FRONT] and square.sides.dtype == np.uint8
    assert square.divisions.tolist() == [1]
    assert square.face_object.tolist() == [0]
    assert square.warnings == ()
    np.testing.assert_array_equal(square.corner_normals, np.tile([0, 0, 1], (4, 1)))


def test_arrays_are_copies_that_cannot_be_written():
    given_vertices = SQUARE.copy()
    square = scene(vertices=given_vertices)
    given_vertices[0] = 7
    assert square.vertices[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        square.emission[0] = 1
    with pytest.raises(FrozenInstanceError):
        square.emission = square.reflectance


def test_replace_checks_again_and_keeps_each_warning_once():
    shiny = scene(reflectance=[[1, 1, 1]], warnings=["Object 'Wall': a colour socket is linked"])
    brighter = replace(shiny, emission=[[3, 3, 3]])
    assert brighter.emission.tolist() == [[3, 3, 3]]
    assert brighter.warnings == shiny.warnings
    with pytest.raises(RadiosityError):
        replace(shiny, sides=[7])


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e4])
@pytest.mark.parametrize("place", [0.0, 1e6])
def test_area_and_normal_keep_their_digits_at_any_size_and_place(size, place):
    size = 2.0 ** round(np.log2(size))  # representable beside 1e6, so that only the arithmetic is judged
    if size < 1 and place:
        size = 2.0**-20
    triangle = np.array([(0, 0, 0), (0, 3, 0), (0, 0, 5)]) * size + place
    measured = Scene.from_polygons([triangle])
    assert measured.live.all()
    np.testing.assert_allclose(measured.face_area, 7.5 * size**2, rtol=1e-14)
    np.testing.assert_allclose(measured.face_normal, [[1, 0, 0]], atol=1e-14)


def test_newell_measures_every_shape():
    concave = [(0, 0, 1), (2, 1, 1), (0, 2, 1), (0.5, 1, 1)]
    measured = Scene.from_polygons([SQUARE, SQUARE[::-1], concave, BENT])
    np.testing.assert_allclose(measured.face_area, [1, 1, 1.5, 1])
    np.testing.assert_allclose(measured.face_normal, [(0, 0, 1), (0, 0, -1), (0, 0, 1), (0, 0, 1)], atol=1e-15)
    np.testing.assert_allclose(measured.face_extent, np.sqrt([2, 2, 8, 3]))
    assert measured.corner_face.tolist() == [0] * 4 + [1] * 4 + [2] * 4 + [3] * 4


@given(st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_vector_area_is_that_of_a_fan_from_any_point(corners, seed):
    rng = np.random.default_rng(seed)
    polygon, apex = rng.normal(size=(corners, 3)), rng.normal(size=3)
    arm = polygon - apex
    fan = 0.5 * np.sum(np.cross(arm, np.roll(arm, -1, axis=0)), axis=0)
    np.testing.assert_allclose(Scene.from_polygons([polygon]).area_vector[0], fan, atol=1e-12)


def test_faces_without_area_keep_their_corners_and_are_counted():
    faces = [SQUARE, LINE, LINE + 5, SQUARE]
    dull = Scene.from_polygons(faces, face_object=[0, 1, 1, 1], object_names=["Floor", "Wall"])
    assert dull.live.tolist() == [True, False, False, True]
    assert dull.warnings == ("Object 'Wall': 2 faces without area are skipped",)
    assert len(dull.corner_vertex) == 14
    np.testing.assert_array_equal(dull.face_normal[1:3], 0)


def test_one_face_without_area_is_spoken_of_in_the_singular():
    assert Scene.from_polygons([LINE]).warnings == ("Object 'Scene': 1 face without area is skipped",)


@pytest.mark.parametrize("width, live", [(1e-6, True), (1e-8, False)])
def test_a_face_is_a_line_only_relative_to_its_own_size(width, live):
    strip = SQUARE * (1, width, 1)
    for scale in (1e-3, 1.0, 1e3):
        assert Scene.from_polygons([strip * scale]).live.tolist() == [live]


def test_reflectance_near_one_is_capped_with_a_warning():
    capped = Scene.from_polygons(
        [SQUARE] * 3,
        [[1, 0.5, 0], [0.99, 0.99, 0.99], [5, 0, 0]],
        face_object=[0, 1, 0],
        object_names=["Wall", "Floor"],
    )
    np.testing.assert_allclose(capped.reflectance, [[0.99, 0.5, 0], [0.99, 0.99, 0.99], [0.99, 0, 0]])
    assert capped.warnings == ("Object 'Wall': reflectance above 0.99 is taken as 0.99 (2 faces)",)


def test_the_cap_in_single_precision_is_no_warning():
    assert scene(reflectance=np.full((1, 3), 0.99, dtype=np.float32)).warnings == ()


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"vertices": SQUARE[:, :2]}, r"vertices must have the shape \(n, 3\), not \(4, 2\)"),
        ({"vertices": [["a", "b", "c"]]}, "vertices must be numbers"),
        ({"corner_vertex": [[0, 1, 2, 3]]}, r"corner_vertex must have the shape \(n,\), not \(1, 4\)"),
        ({"corner_vertex": [0, 1, 2, 0.5]}, "corner_vertex must be whole numbers"),
        ({"corner_vertex": ["a", 1, 2, 3]}, "corner_vertex must be whole numbers"),
        ({"corner_vertex": [0, 1, 2, 4]}, "Object 'Wall': a corner lies outside the 4 vertices"),
        ({"corner_vertex": [0, 1, 2, -1]}, "Object 'Wall': a corner lies outside"),
        ({"face_start": [0, 3]}, "face_start must run from 0 up to the number of corners, 4"),
        ({"face_start": [1, 4]}, "face_start must run from 0"),
        ({"face_start": []}, "face_start must run from 0"),
        ({"face_start": [0, 5, 4], "reflectance": np.zeros((2, 3)), "emission": np.zeros((2, 3))}, "face_start must"),
        ({"face_start": [0, 2, 4]}, r"Object 'Wall': a face needs three corners or more \(2 faces\)"),
        ({"reflectance": [0.5, 0.5, 0.5]}, r"reflectance must have the shape \(1, 3\), not \(3,\)"),
        ({"sides": [-1]}, "Object 'Wall': sides must be 0"),
        ({"sides": [4]}, "Object 'Wall': sides must be 0"),
        ({"sides": [257]}, "Object 'Wall': sides must be 0"),
        ({"sides": [1, 1]}, r"sides must have the shape \(1,\)"),
        ({"divisions": [0]}, "Object 'Wall': divisions must be 1 or more"),
        ({"divisions": [np.inf]}, "divisions must be whole numbers"),
        ({"face_object": [1]}, "face_object must index the 1 object names"),
        ({"face_object": [-1]}, "face_object must index"),
    ],
)
def test_what_cannot_be_lit_is_refused_in_plain_words(changes, message):
    with pytest.raises(RadiosityError, match=message):
        scene(**changes)


def test_the_object_at_fault_is_named_among_others():
    with pytest.raises(RadiosityError, match="Object 'Lamp'"):
        Scene.from_polygons([SQUARE] * 3, sides=[1, 9, 1], face_object=[0, 1, 2], object_names=["A", "Lamp", "B"])


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("what", ["reflectance", "emission"])
def test_what_is_no_light_is_taken_as_nothing(what, value):
    given = np.full((3, 3), 0.5)
    given[1, 2] = value
    mended = Scene.from_polygons(
        [SQUARE] * 3, face_object=[0, 1, 2], object_names=["A", "Lamp", "B"], **({"reflectance": 0.5} | {what: given})
    )
    np.testing.assert_array_equal(getattr(mended, what)[1], [0.5, 0.5, 0])
    line = f"Object 'Lamp': {what} that is negative or not a finite number is taken as 0 (1 face)"
    assert mended.warnings == (line,)
    assert replace(mended).warnings == mended.warnings


def test_light_beyond_all_bounds_is_bounded():
    lamp = scene(emission=[[1e30, 1e6, 0]])
    np.testing.assert_array_equal(lamp.emission, [[1e15, 1e6, 0]])
    assert lamp.warnings == ("Object 'Wall': emission above 1e+15 is taken as 1e+15 (1 face)",)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e13, 1e300])
def test_faces_with_a_vertex_nowhere_are_left_out(value):
    vertices = np.concatenate([SQUARE, SQUARE + (2, 0, 0), [(0, 0, value)]])
    vertices[6, 1] = value
    mended = Scene(
        vertices, range(8), [0, 4, 8], np.full((2, 3), 0.5), np.ones((2, 3)), face_object=[0, 1], object_names="AB"
    )
    assert mended.live.tolist() == [True, False]
    assert np.isfinite(mended.vertices).all() and np.abs(mended.vertices).max() <= 3
    # Its corners are at the one of its vertices that comes first and is somewhere.
    assert mended.corner_vertex[4:].tolist() == [4] * 4
    assert mended.warnings == ("Object 'B': 1 face with a vertex at no finite place within 1e+12 m is skipped",)
    again = replace(mended, emission=2 * mended.emission)
    assert again.live.tolist() == [True, False] and again.warnings == mended.warnings


def test_a_scene_that_is_nowhere_is_no_scene():
    lost = scene(vertices=np.full((4, 3), np.nan))
    assert not lost.live.any() and np.isfinite(lost.vertices).all()


def test_normals_that_are_no_numbers_are_those_of_the_face():
    given = np.array([[0, 0, np.nan], [0, 0, 1], [np.inf, 0, 0], [0, 1e300, 1e300]])
    mended = scene(corner_normals=given)
    np.testing.assert_allclose(mended.corner_normals, [[0, 0, 1]] * 3 + [[0, np.sqrt(0.5), np.sqrt(0.5)]])
    line = "Object 'Wall': normals that are not finite numbers are replaced by the face's (1 face)"
    assert mended.warnings == (line,)


def test_corner_normals_become_unit_and_missing_ones_flat():
    smooth = scene(corner_normals=[(0, 0, 2), (3, 0, 4), (0, 0, 0), (0, 0, 1)])
    np.testing.assert_allclose(smooth.corner_normals, [(0, 0, 1), (0.6, 0, 0.8), (0, 0, 1), (0, 0, 1)])


def test_polygons_that_share_points_share_vertices():
    pair = Scene.from_polygons([SQUARE, BESIDE], 0.5, [1, 2, 3], sides=[BACK, BOTH], divisions=[2, 3])
    assert len(pair.vertices) == 6
    np.testing.assert_array_equal(pair.vertices[pair.corner_vertex], np.concatenate([SQUARE, BESIDE]))
    np.testing.assert_array_equal(pair.emission, [[1, 2, 3]] * 2)
    np.testing.assert_array_equal(pair.reflectance, np.full((2, 3), 0.5))
    assert pair.sides.tolist() == [BACK, BOTH] and pair.divisions.tolist() == [2, 3]


def test_polygons_with_light_for_another_number_of_polygons_are_refused():
    with pytest.raises(RadiosityError, match="one colour a polygon"):
        Scene.from_polygons([SQUARE], np.zeros((2, 3)))
    with pytest.raises(RadiosityError, match=r"polygon 1 must have the shape \(n, 3\)"):
        Scene.from_polygons([SQUARE, [(1, 2), (3, 4), (5, 6)]])


def test_a_scene_without_faces_is_a_scene():
    empty = Scene.from_polygons([])
    assert empty.face_area.shape == (0,) and empty.face_normal.shape == (0, 3) and empty.live.shape == (0,)
    assert empty.warnings == ()
