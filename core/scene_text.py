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
from os import PathLike
from pathlib import Path

import numpy as np

from .arrays import FloatArray
from .errors import RadiosityError
from .rectangles import EMITTER, SURFACE, Rectangle, check_rectangle, quoted, rectangles_to_scene

__all__ = [
    "EMITTER",
    "SURFACE",
    "Rectangle",
    "parse_scene_text",
    "read_scene_text",
    "rectangles_to_scene",
    "write_scene_text",
]

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_PARTS = (
    ("a point (x, y, z) as corner 1", 3),
    ("a point (x, y, z) as corner 2", 3),
    ("a point (x, y, z) as corner 3", 3),
    ("a point (x, y, z) as corner 4", 3),
    ("a normal (x, y, z)", 3),
    ("a material (r, g, b, k)", 4),
)


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
        check_rectangle(rectangle, f"Rectangle {number}")
        tuples = [*rectangle.corners, rectangle.normal, [*rectangle.colour, rectangle.factor]]
        parts = ("(" + ", ".join(repr(float(value)) for value in values) + ")" for values in tuples)
        lines.append(" ".join([rectangle.kind, str(rectangle.divisions), *parts]) + "\n")
    return "".join(lines)


def _rectangle(content: str, where: str) -> Rectangle:
    """Return the rectangle that a line describes."""
    kind, rest = _word(content)
    if kind not in (SURFACE, EMITTER):
        raise RadiosityError(f"{where}: expected R or E, found {quoted(kind or rest)}")
    count, rest = _word(rest)
    if not re.fullmatch(r"\+?\d{1,18}", count, re.ASCII):
        raise RadiosityError(f"{where}: expected the number of patches along a side, found {quoted(count or rest)}")
    groups = []
    for what, length in _PARTS:
        values, rest = _group(rest, length, f"{where}: expected {what}, found")
        groups.append(values)
    if rest:
        raise RadiosityError(f"{where}: expected the end of the line after the material, found {quoted(rest)}")
    *corners, normal, material = groups
    rectangle = Rectangle(kind, int(count), np.stack(corners), normal, material[:3], float(material[3]))
    check_rectangle(rectangle, where)
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
        raise RadiosityError(f"{expected} {quoted(text)}")
    words = re.split(r"\s*,\s*|\s+", match[1].strip())
    if len(words) != length or not all(_NUMBER.fullmatch(word) for word in words):
        raise RadiosityError(f"{expected} {quoted(match[0])}")
    return np.array([float(word) for word in words]), _after_separator(text[match.end() :])


def _after_separator(text: str) -> str:
    """Return the text without blanks and at most one comma in front."""
    return text.lstrip().removeprefix(",").lstrip()
