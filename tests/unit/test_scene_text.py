# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's scene file: read as people write it, refused with the line's number, written back bit by bit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from core.errors import RadiosityError
from core.meshing import mesh
from core.scene_text import Rectangle, parse_scene_text, read_scene_text, rectangles_to_scene, write_scene_text

ROOM = Path(__file__).parents[2] / "example_blends" / "thesis_room.txt"
LINE = "R 2 (0,0,0) (1,0,0) (1,1,0) (0,1,0) (0,0,1) (1.0,1.0,1.0,0.5)"


def same(one, other):
    """Tell whether two rectangles hold the same bits."""
    return (one.kind, one.divisions, one.factor) == (other.kind, other.divisions, other.factor) and all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in ("corners", "normal", "colour")
    )


@pytest.mark.parametrize("factor, patches", [(1, 656), (2, 2624), (3, 5904), (4, 10496), (5, 16400)])
def test_the_thesis_room_has_the_patches_of_table_1(factor, patches):
    rectangles = read_scene_text(ROOM)
    assert len(mesh(rectangles_to_scene(rectangles, subdivide=factor)).area) == patches
    assert len(mesh(rectangles_to_scene(rectangles), subdivide=factor).area) == patches


def test_the_thesis_room_is_a_closed_cube_with_two_boxes_and_a_lamp():
    scene = rectangles_to_scene(read_scene_text(ROOM))
    assert scene.warnings == ()
    assert scene.object_names[:8] == ("R1", "R2", "R3", "R4", "R5", "R6", "E7", "R8")
    np.testing.assert_allclose(scene.area_vector[:6].sum(axis=0), 0, atol=1e-15)
    assert np.flatnonzero(scene.emission.any(axis=1)).tolist() == [6]
    np.testing.assert_allclose(scene.emission[6], [12, 12, 10.8])
    np.testing.assert_array_equal(scene.reflectance[6], 0)
    np.testing.assert_allclose(scene.reflectance[4], [0.63, 0.063, 0.0504])


@pytest.mark.parametrize(
    "text",
    [
        LINE,
        "\ufeff" + LINE,
        "# a comment\r\n\r\n" + LINE + "   # another\r\n",
        LINE.replace(",", ", "),
        LINE.replace(",", " , ").replace(" ", "\t"),
        LINE.replace(",", " "),
        LINE.replace(" ", ","),
        LINE.replace(" (", "("),
        LINE.replace("(", "(  ").replace(")", "  )"),
        "\n \t\n" + LINE + "\r\r",
        LINE.replace("0.5", "+5.0e-1").replace("1.0,", "1.,").replace("(0,", "(-.0E+05,"),
    ],
)
def test_writing_habits_do_not_matter(text):
    (found,) = parse_scene_text(text)
    (plain,) = parse_scene_text(LINE)
    assert (found.kind, found.divisions, found.factor) == ("R", 2, 0.5)
    for name in ("corners", "normal", "colour"):
        np.testing.assert_array_equal(getattr(found, name), getattr(plain, name))


@pytest.mark.parametrize(
    "line, message",
    [
        ("Q 2 (0,0,0)", "expected R or E, found 'Q'"),
        ("r 2 (0,0,0)", "expected R or E, found 'r'"),
        ("(0,0,0)", r"expected R or E, found '\(0,0,0\)'"),
        ("R", "expected the number of patches along a side, found the end of the line"),
        ("R (0,0,0)", r"expected the number of patches along a side, found '\(0,0,0\)'"),
        (LINE.replace(" 2 ", " 2.5 "), "number of patches along a side, found '2.5'"),
        (LINE.replace(" 2 ", " -2 "), "number of patches along a side, found '-2'"),
        (LINE.replace(" 2 ", " 0 "), "expected 1 to 1000 patches along a side, found 0"),
        (LINE.replace(" 2 ", " 1001 "), "expected 1 to 1000 patches along a side, found 1001"),
        (LINE.replace(" 2 ", " " + "9" * 400 + " "), "number of patches along a side, found '9999.*\\.\\.\\.'"),
        ("R 2 (0,0,0) (1,0,0)", r"expected a point \(x, y, z\) as corner 3, found the end of the line"),
        (LINE.replace("(1,1,0)", "(1,1)"), r"expected a point \(x, y, z\) as corner 3, found '\(1,1\)'"),
        (LINE.replace("(1,1,0)", "(1,,0)"), r"corner 3, found '\(1,,0\)'"),
        (LINE.replace("(1,1,0)", "(1,1,0"), "corner 3, found "),
        (LINE.replace("(1,1,0)", "(1,1,nan)"), r"corner 3, found '\(1,1,nan\)'"),
        (LINE.replace("(1,1,0)", "(1,1,0_0)"), r"corner 3, found '\(1,1,0_0\)'"),
        (LINE.replace("(1,1,0)", "(1,1,1e999)"), r"expected coordinates within 1e\+12 m of the origin"),
        (LINE.replace("(0,0,1)", "(0,0)"), r"expected a normal \(x, y, z\), found '\(0,0\)'"),
        (LINE.replace("(1.0,1.0,1.0,0.5)", "(1,1,1)"), r"expected a material \(r, g, b, k\), found '\(1,1,1\)'"),
        (LINE.replace("0.5", "-0.5"), "expected a material of numbers from 0 to"),
        (LINE.replace("0.5", "1e300"), "expected a material of numbers from 0 to"),
        (LINE + " (1,2,3)", r"expected the end of the line after the material, found '\(1,2,3\)'"),
        (LINE.replace("(0,1,0)", "(0,1,0.1)"), "expected four corners in one plane, found one that is 0.0.* m off it"),
        (LINE.replace("(1,1,0) (0,1,0)", "(0,1,0) (1,1,0)"), "found a shape that encloses none"),
        (LINE.replace("(1,1,0) (0,1,0)", "(0,1,0) (2,1,0)"), "found a shape that crosses itself"),
        (LINE.replace("(1,1,0) (0,1,0)", "(2,0,0) (3,0,0)"), "found a shape that encloses none"),
        (LINE.replace("(0,0,1)", "(1,0,0)"), r"expected a normal at right angles .* found \(1, 0, 0\)"),
        (LINE.replace("(0,0,1)", "(0,0,0)"), r"expected a normal at right angles .* found \(0, 0, 0\)"),
        (LINE.replace("(0,0,1)", "(0,1,1)"), "expected a normal at right angles"),
    ],
)
def test_a_bad_line_is_named_with_what_was_expected_and_found(line, message):
    text = f"# first\r\n{LINE}\r\n\r{line}\n{LINE}\n"
    with pytest.raises(RadiosityError, match=f"^Line 4: .*{message}"):
        parse_scene_text(text)


@pytest.mark.parametrize("text, line", [("", 1), ("\n# nothing here\n", 3)])
def test_a_text_without_rectangles_is_refused(text, line):
    with pytest.raises(RadiosityError, match=f"Line {line}: expected a rectangle, R or E, found the end of the text"):
        parse_scene_text(text)


def test_the_normal_decides_the_side_and_the_numbers_stay():
    for text, up in [(LINE, 1.0), (LINE.replace("(0,0,1)", "(0,0,-3)"), -1.0)]:
        rectangles = parse_scene_text(text)
        np.testing.assert_array_equal(rectangles_to_scene(rectangles).face_normal, [[0, 0, up]])
        np.testing.assert_array_equal(rectangles[0].corners, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])


@pytest.mark.parametrize(
    "corners, area", [("(0,0,0) (3,0,0) (2,1,0) (1,1,0)", 2.0), ("(0,0,0) (2,1,0) (0,2,0) (.5,1,0)", 1.5)]
)
def test_any_flat_quadrilateral_is_accepted(corners, area):
    scene = rectangles_to_scene(parse_scene_text(f"R 3 {corners} (0,0,1) (1,1,1,.5)"))
    np.testing.assert_allclose(mesh(scene).area.sum(), area)


def test_a_surface_that_reflects_everything_is_capped_with_a_warning():
    scene = rectangles_to_scene(parse_scene_text(LINE + "\n" + LINE.replace("0.5)", "1.0)")))
    assert scene.warnings == ("Object 'R2': reflectance above 0.99 is taken as 0.99 (1 face)",)


def test_files_with_marks_and_foreign_comments_are_read(tmp_path):
    path = tmp_path / "room.txt"
    for data in (LINE.encode("utf-8-sig"), LINE.encode("utf-16"), b"# rasvjeta \xe8\xe6\n" + LINE.encode()):
        path.write_bytes(data)
        assert same(*read_scene_text(path), *parse_scene_text(LINE))


def test_a_file_at_fault_is_named_with_its_line(tmp_path):
    path = tmp_path / "room.txt"
    path.write_text(LINE + "\nR 0", encoding="utf-8")
    with pytest.raises(RadiosityError, match=r"Scene file '.*room\.txt': Line 2: expected"):
        read_scene_text(path)
    with pytest.raises(RadiosityError, match=r"Cannot read the scene file '.*missing\.txt': No such file"):
        read_scene_text(tmp_path / "missing.txt")
    with pytest.raises(RadiosityError, match="Cannot read the scene file"):
        read_scene_text(tmp_path)


def test_only_what_can_be_read_back_is_written():
    (good,) = parse_scene_text(LINE)
    for bad in (
        replace(good, kind="X"),
        replace(good, divisions=0),
        replace(good, factor=np.nan),
        replace(good, normal=np.array([0, np.nan, 1])),
        replace(good, corners=good.corners[[0, 2, 1, 3]]),
    ):
        with pytest.raises(RadiosityError, match="Rectangle 2: expected"):
            write_scene_text([good, bad])


def test_nothing_is_written_as_nothing():
    assert write_scene_text([]) == ""
    assert len(rectangles_to_scene([]).face_area) == 0


numbers = st.floats(-1e6, 1e6, allow_nan=False)
amounts = st.floats(0, 1e6)


@given(
    st.sampled_from("RE"),
    st.integers(1, 1000),
    st.lists(numbers, min_size=9, max_size=9),
    st.lists(amounts, min_size=4, max_size=4),
    st.floats(1e-3, 1e3),
    st.booleans(),
)
def test_a_round_trip_keeps_every_bit(kind, divisions, frame, material, length, flip):
    origin, first, second = np.array(frame).reshape(3, 3)
    normal = np.cross(first, second)
    assume(np.linalg.norm(normal) > 1e-3 * (np.linalg.norm(first) + np.linalg.norm(second)) ** 2)
    assume(np.linalg.norm(first) > 1e-6 * np.linalg.norm(origin))
    assume(np.linalg.norm(second) > 1e-6 * np.linalg.norm(origin))
    normal *= (-1 if flip else 1) * length / np.linalg.norm(normal)
    corners = origin + np.array([0 * first, first, first + second, second])
    written = Rectangle(kind, divisions, corners, normal, np.array(material[:3]), material[3])
    assert same(*parse_scene_text(write_scene_text([written])), written)
    # The scene shows the side that the normal points to.
    assert float(rectangles_to_scene([written]).face_normal[0] @ normal) > 0


corner_words = ["(0,0,0)", "(1,0,0)", "(1,1,0)", "(0,1,0)", "(0,0,1)", "(1,1,1,.5)", "(1e-200,0,0)", "(1e11,0,1)"]
odd_words = ["(", ")", ",", "#", "\n", "-1", "1e400", "nan", "١", "\x00", "\u2028", "\ufeff", "0x1"]
words = st.sampled_from(["R", "E", "2", *corner_words, *odd_words])


@given(st.one_of(st.text(), st.lists(words).map(" ".join)))
@example(LINE.replace("(1,0,0)", "(1e-200,0,0)").replace("(0,1,0)", "(0,1e-200,0)").replace("(1,1,0)", "(0,0,0)"))
@example(LINE.replace("1", "1e11"))
@example(LINE.replace("0.5", "1e12"))
def test_any_text_is_read_or_refused_with_a_line(text):
    try:
        rectangles = parse_scene_text(text)
    except RadiosityError as error:
        assert str(error).startswith("Line ")
    else:
        assert len(rectangles_to_scene(rectangles).face_area) == len(rectangles)
        again = parse_scene_text(write_scene_text(rectangles))
        assert all(same(one, other) for one, other in zip(rectangles, again, strict=True))
