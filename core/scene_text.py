# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's scene file (T11), read and written: one rectangle a line.

    R <n> <p1> <p2> <p3> <p4> <normal> <material>      a surface
    E <n> <p1> <p2> <p3> <p4> <normal> <material>      an emitter

n is the number of patches along one side. Points [m] and the normal are written `(x, y, z)`, the material
`(r, g, b, k)`: reflectance is rgb * k; for an emitter, radiant exitance is rgb * k [W/m^2] and reflectance zero.
Blanks, tabs and commas between the parts do not matter; `#` starts a comment. Any flat quadrilateral will do, and it
radiates to the side that the normal points to, in whichever order the corners come.
"""

import codecs
import re
from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from .errors import RadiosityError
from .scene import FARTHEST, FLAT, SMALLEST, FloatArray, Scene

SURFACE, EMITTER = "R", "E"

# More divisions a side than this are a slip of the keyboard: a million patches from one rectangle.
MOST_DIVISIONS = 1000
# Brighter light than this is a slip too, and its squares must stay finite [W/m^2].
BRIGHTEST = 1e12
# Distance of a corner from the plane, over the size: what rounding to three digits does.
NOT_FLAT = 1e-3
# Cosine between the normal in the file and the rectangle's own: 8 degrees.
ASKEW = 0.99

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_PARTS = (
    ("a point (x, y, z) as corner 1", 3),
    ("a point (x, y, z) as corner 2", 3),
    ("a point (x, y, z) as corner 3", 3),
    ("a point (x, y, z) as corner 4", 3),
    ("a normal (x, y, z)", 3),
    ("a material (r, g, b, k)", 4),
)


@dataclass(frozen=True, eq=False)
class Rectangle:
    """One line of a scene file, with the numbers as they stand there.

    Attributes
    ----------
    kind : str
        "R", a surface, or "E", an emitter.
    divisions : int
        Patches along one side.
    corners : ndarray of shape (4, 3)
        Corners one after the other around the quadrilateral [m].
    normal : ndarray of shape (3,)
        Points to the side that radiates; of any length.
    colour : ndarray of shape (3,)
        Red, green and blue.
    factor : float
        Reflectance is colour * factor; of an emitter, radiant exitance is [W/m^2].
    """

    kind: str
    divisions: int
    corners: FloatArray
    normal: FloatArray
    colour: FloatArray
    factor: float


def read_scene_text(path: str | PathLike[str]) -> tuple[Rectangle, ...]:
    """Read a scene file.

    Parameters
    ----------
    path : path-like
        A text file in UTF-8, or in UTF-16 with its mark.

    Returns
    -------
    tuple of Rectangle
        The rectangles in the order of the file.

    Raises
    ------
    RadiosityError
        When the file cannot be read, or a line cannot be understood; names the file and the line.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise RadiosityError(f"Cannot read the scene file '{path}': {error.strerror or error}") from error
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    # Letters of other encodings can only stand in comments; elsewhere the line is refused anyway.
    text = data.decode("utf-16" if wide else "utf-8", errors="replace")
    try:
        return parse_scene_text(text)
    except RadiosityError as error:
        raise RadiosityError(f"Scene file '{path}': {error}") from error


def parse_scene_text(text: str) -> tuple[Rectangle, ...]:
    """Read the text of a scene file.

    Parameters
    ----------
    text : str
        Lines of T11.

    Returns
    -------
    tuple of Rectangle
        The rectangles in order.

    Raises
    ------
    RadiosityError
        At the first line that cannot be understood: its number, what was expected and what was found.
    """
    lines = re.split(r"\r\n|\r|\n", text.removeprefix("\ufeff"))
    rectangles = []
    for number, line in enumerate(lines, start=1):
        content = line.partition("#")[0].strip()
        if content:
            rectangles.append(_rectangle(content, f"Line {number}"))
    if not rectangles:
        raise RadiosityError(f"Line {len(lines)}: expected a rectangle, R or E, found the end of the text")
    return tuple(rectangles)


def write_scene_text(rectangles: Iterable[Rectangle]) -> str:
    """Write a scene file's text; reading it gives the same numbers, bit by bit.

    Parameters
    ----------
    rectangles : iterable of Rectangle
        What to write.

    Returns
    -------
    str
        One line a rectangle.

    Raises
    ------
    RadiosityError
        When a rectangle could not be read back; names its number.
    """
    lines = []
    for number, rectangle in enumerate(rectangles, start=1):
        _check(rectangle, f"Rectangle {number}")
        tuples = [*rectangle.corners, rectangle.normal, [*rectangle.colour, rectangle.factor]]
        parts = ("(" + ", ".join(repr(float(value)) for value in values) + ")" for values in tuples)
        lines.append(" ".join([rectangle.kind, str(rectangle.divisions), *parts]) + "\n")
    return "".join(lines)


def rectangles_to_scene(rectangles: Iterable[Rectangle], subdivide: int = 1) -> Scene:
    """Build a scene in which every rectangle is an object of its own.

    Parameters
    ----------
    rectangles : iterable of Rectangle
        Surfaces and emitters.
    subdivide : int
        Factor on the divisions (T19).

    Returns
    -------
    Scene
        Objects "R1", "R2", "E3" ... numbered in order; emitters reflect nothing.
    """
    items = tuple(rectangles)
    light = np.array([rectangle.colour * rectangle.factor for rectangle in items]).reshape(-1, 3)
    emits = np.array([rectangle.kind == EMITTER for rectangle in items], dtype=bool)[:, None]
    return Scene.from_polygons(
        [_towards_normal(rectangle) for rectangle in items],
        np.where(emits, 0.0, light),
        np.where(emits, light, 0.0),
        face_object=np.arange(len(items)),
        object_names=[f"{rectangle.kind}{number}" for number, rectangle in enumerate(items, start=1)],
        divisions=[rectangle.divisions * subdivide for rectangle in items],
    )


def _rectangle(content: str, where: str) -> Rectangle:
    """Return the rectangle that a line describes."""
    kind, rest = _word(content)
    if kind not in (SURFACE, EMITTER):
        raise RadiosityError(f"{where}: expected R or E, found {_quoted(kind or rest)}")
    count, rest = _word(rest)
    if not re.fullmatch(r"\+?\d{1,18}", count, re.ASCII):
        raise RadiosityError(f"{where}: expected the number of patches along a side, found {_quoted(count or rest)}")
    groups = []
    for what, length in _PARTS:
        values, rest = _group(rest, length, f"{where}: expected {what}, found")
        groups.append(values)
    if rest:
        raise RadiosityError(f"{where}: expected the end of the line after the material, found {_quoted(rest)}")
    *corners, normal, material = groups
    rectangle = Rectangle(kind, int(count), np.stack(corners), normal, material[:3], float(material[3]))
    _check(rectangle, where)
    return rectangle


def _word(text: str) -> tuple[str, str]:
    """Return the text up to the next separator or bracket, and what follows the separator."""
    match = re.match(r"[^\s,(]*", text)
    word = match[0] if match else ""
    return word, _after_separator(text[len(word) :])


def _group(text: str, length: int, expected: str) -> tuple[FloatArray, str]:
    """Return the numbers of a bracket, and what follows it and its separator."""
    match = re.match(r"\(([^()]*)\)", text)
    if not match:
        raise RadiosityError(f"{expected} {_quoted(text)}")
    words = re.split(r"\s*,\s*|\s+", match[1].strip())
    if len(words) != length or not all(_NUMBER.fullmatch(word) for word in words):
        raise RadiosityError(f"{expected} {_quoted(match[0])}")
    return np.array([float(word) for word in words]), _after_separator(text[match.end() :])


def _after_separator(text: str) -> str:
    """Return the text without blanks and at most one comma in front."""
    return text.lstrip().removeprefix(",").lstrip()


def _quoted(text: str) -> str:
    """Return what was found, short enough for a message."""
    if not text:
        return "the end of the line"
    return repr(text if len(text) <= 40 else text[:37] + "...")


def _check(rectangle: Rectangle, where: str) -> None:
    """Refuse a rectangle that cannot be lit."""
    if rectangle.kind not in (SURFACE, EMITTER):
        raise RadiosityError(f"{where}: expected the kind R or E, found {_quoted(rectangle.kind)}")
    if not 1 <= rectangle.divisions <= MOST_DIVISIONS:
        raise RadiosityError(
            f"{where}: expected 1 to {MOST_DIVISIONS} patches along a side, found {rectangle.divisions}"
        )
    light = np.array([*rectangle.colour, rectangle.factor])
    if not np.all((light >= 0) & (light <= BRIGHTEST)):
        raise RadiosityError(f"{where}: expected a material of numbers from 0 to {BRIGHTEST:g}, found {_listed(light)}")
    corners, normal = np.asarray(rectangle.corners), np.asarray(rectangle.normal)
    if not np.all(np.abs([*corners, normal]) <= FARTHEST):
        raise RadiosityError(f"{where}: expected coordinates within {FARTHEST:g} m of the origin")
    _check_shape(corners, where)
    _check_normal(rectangle, where)


def _check_shape(corners: FloatArray, where: str) -> None:
    """Refuse quadrilaterals that cross themselves, enclose nothing or are not flat."""
    vector = _area_vector(corners)
    size = float(np.max(np.linalg.norm(corners - corners[0], axis=1)))
    area = float(np.linalg.norm(vector))
    sides = np.roll(corners, -1, axis=0) - corners
    turns = np.cross(np.roll(sides, 1, axis=0), sides) @ vector
    if size <= SMALLEST or area <= FLAT * size**2 or np.count_nonzero(turns < 0) > 1:
        raise RadiosityError(
            f"{where}: expected four corners one after the other around an area, found a shape that "
            f"{'crosses itself' if np.count_nonzero(turns < 0) > 1 else 'encloses none'}"
        )
    height = float(np.ptp((corners - corners[0]) @ (vector / area)))
    if height > NOT_FLAT * size:
        raise RadiosityError(f"{where}: expected four corners in one plane, found one that is {height:g} m off it")


def _check_normal(rectangle: Rectangle, where: str) -> None:
    """Refuse normals that do not stand on the rectangle."""
    vector = _area_vector(rectangle.corners)
    length = float(np.linalg.norm(rectangle.normal)) * float(np.linalg.norm(vector))
    if abs(float(vector @ rectangle.normal)) <= ASKEW * length:
        unit = vector / np.linalg.norm(vector)
        raise RadiosityError(
            f"{where}: expected a normal at right angles to the rectangle, {_listed(unit)} or its opposite, "
            f"found {_listed(rectangle.normal)}"
        )


def _area_vector(corners: FloatArray) -> FloatArray:
    """Return the vector area of a quadrilateral [m^2]."""
    return np.asarray(0.5 * np.cross(corners[2] - corners[0], corners[3] - corners[1]))


def _towards_normal(rectangle: Rectangle) -> FloatArray:
    """Return the corners counter-clockwise as seen from where the normal points."""
    against = float(_area_vector(rectangle.corners) @ rectangle.normal) < 0
    return rectangle.corners[::-1] if against else rectangle.corners


def _listed(values: FloatArray) -> str:
    """Return numbers as they are written in the file, rounded."""
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
