# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's rectangles: what a line of a scene file says, whether it can be lit, and a scene made of them."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray
from .errors import RadiosityError
from .mending import FARTHEST
from .polygons import FLAT, SMALLEST
from .scene import Scene

SURFACE, EMITTER = "R", "E"

# More divisions a side than this are a slip of the keyboard: a million patches from one rectangle.
MOST_DIVISIONS = 1000
# Brighter light than this is a slip too, and its squares must stay finite [W/m^2].
BRIGHTEST = 1e12
# Distance of a corner from the plane, over the size: what rounding to three digits does.
NOT_FLAT = 1e-3
# Cosine between the normal in the file and the rectangle's own: 8 degrees.
ASKEW = 0.99


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


def check_rectangle(rectangle: Rectangle, where: str) -> None:
    """Refuse a rectangle that cannot be lit.

    Parameters
    ----------
    rectangle : Rectangle
        Read from a file or about to be written.
    where : str
        How messages begin: the line or the number of the rectangle.

    Raises
    ------
    RadiosityError
        Says what was expected and what was found.
    """
    if rectangle.kind not in (SURFACE, EMITTER):
        raise RadiosityError(f"{where}: expected the kind R or E, found {quoted(rectangle.kind)}")
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


def quoted(text: str) -> str:
    """Return what was found as a message shows it: between quotes, shortened, or the end of the line."""
    if not text:
        return "the end of the line"
    return repr(text if len(text) <= 40 else text[:37] + "...")
