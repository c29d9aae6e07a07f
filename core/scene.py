# SPDX-License-Identifier: GPL-3.0-or-later
"""The polygons that exchange light: `Scene`, in world space and metres, checked when it is built.

Faces are kept like Blender's: corners in one long list, each with its vertex, and the first corner of every face.
What can be put right becomes a warning that names the object (`mending`); everything else raises `RadiosityError`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import BoolArray, FloatArray, IntArray, indices, table
from .errors import RadiosityError
from .mending import BRIGHTEST, FARTHEST, faces_with, mended_light, mended_positions
from .paint.paint import Paint

if TYPE_CHECKING:
    from .lighting.lamps import Lamp

__all__ = ["AUTO", "BACK", "BOTH", "FLAT", "FRONT", "SMALLEST", "BoolArray", "FloatArray", "IntArray"]
__all__ += ["Scene"]

AUTO, FRONT, BACK, BOTH = 0, 1, 2, 3

# A closed scene that loses nothing has no solution, and one that loses little needs endless bounces.
REFLECTANCE_LIMIT = 0.99
# Area over squared extent below which a face is a line: Blender's single precision cannot tell the two apart.
FLAT = 1e-7
# Products of lengths must not vanish [m].
SMALLEST = 1e-30


@dataclass(frozen=True, eq=False, init=False)
class Scene:
    """Polygons with reflectance and emission.

    All arrays are copied and read-only; `dataclasses.replace` makes a changed scene and checks it again.

    Attributes
    ----------
    vertices : ndarray of shape (v, 3)
        Positions in world space [m].
    corner_vertex : ndarray of shape (c,)
        Vertex of each face corner; the corners of a face run counter-clockwise seen from its front.
    face_start : ndarray of shape (f + 1,)
        First corner of each face; the last entry is c.
    reflectance : ndarray of shape (f, 3)
        Diffuse reflectance rho of red, green and blue, 0 to 0.99; more is capped with a warning.
    emission : ndarray of shape (f, 3)
        Radiant exitance E that a face emits by itself [W/m^2]; radiance is E / pi.
    corner_normals : ndarray of shape (c, 3)
        Unit shading normals; where none is given, the face's normal (flat shading).
    face_object : ndarray of shape (f,)
        Index into `object_names`.
    object_names : tuple of str
        Names for messages and reports.
    sides : ndarray of shape (f,)
        Which sides radiate and receive: FRONT, BACK or BOTH; AUTO leaves it to the bake, and is FRONT elsewhere. Every
        face blocks light from both sides.
    divisions : ndarray of shape (f,)
        Patches along one row of the face (n of T12).
    max_edge : ndarray of shape (f,)
        Longest edge of the face's patches [m], in place of the bake's; NaN leaves it to the bake.
    occludes, shades : ndarray of shape (f,)
        Whether the face blocks the light of other faces and of lamps, and that of the sky.
    reflects, emits : ndarray of shape (f,)
        Whether what the face reflects and emits lights others; its own colours show it anyway.
    lamps : tuple of Lamp
        Lamps and sky: light that comes from no face.
    paint : Paint or None
        How reflectance and emission vary inside faces, whose means are those above.
    warnings : tuple of str
        What was put right or left out, one line each, without repeats.
    """

    vertices: FloatArray
    corner_vertex: IntArray
    face_start: IntArray
    reflectance: FloatArray
    emission: FloatArray
    corner_normals: FloatArray
    face_object: IntArray
    object_names: tuple[str, ...]
    sides: NDArray[np.uint8]
    divisions: IntArray
    max_edge: FloatArray
    occludes: BoolArray
    shades: BoolArray
    reflects: BoolArray
    emits: BoolArray
    lamps: tuple["Lamp", ...]
    paint: Paint | None
    warnings: tuple[str, ...]

    def __init__(
        self,
        vertices: ArrayLike,
        corner_vertex: ArrayLike,
        face_start: ArrayLike,
        reflectance: ArrayLike,
        emission: ArrayLike,
        *,
        corner_normals: ArrayLike | None = None,
        face_object: ArrayLike | None = None,
        object_names: Sequence[str] = ("Scene",),
        sides: ArrayLike | None = None,
        divisions: ArrayLike | None = None,
        max_edge: ArrayLike | None = None,
        occludes: ArrayLike | None = None,
        shades: ArrayLike | None = None,
        reflects: ArrayLike | None = None,
        emits: ArrayLike | None = None,
        lamps: Sequence["Lamp"] = (),
        paint: Paint | None = None,
        warnings: Sequence[str] = (),
    ) -> None:
        """Check and keep the arrays; see the class for their meaning.

        Raises
        ------
        RadiosityError
            When shapes or indices do not fit, or a choice is none.
        """
        # Topology first: it says how long everything else has to be, and which object to name.
        self._keep("vertices", table("vertices", vertices, None))
        self._keep("corner_vertex", indices("corner_vertex", corner_vertex, None))
        self._keep("face_start", indices("face_start", face_start, None))
        starts, n_corners = self.face_start, len(self.corner_vertex)
        if len(starts) < 1 or starts[0] != 0 or starts[-1] != n_corners or np.any(np.diff(starts) < 0):
            raise RadiosityError(f"face_start must run from 0 up to the number of corners, {n_corners}")
        n_faces = len(starts) - 1
        self._keep("object_names", tuple(object_names))
        self._keep("face_object", indices("face_object", _or(face_object, np.zeros(n_faces)), n_faces))
        if np.any((self.face_object < 0) | (self.face_object >= len(self.object_names))):
            raise RadiosityError(f"face_object must index the {len(self.object_names)} object names")
        self._check_faces()
        vertices, corner_vertex, lost = mended_positions(self.vertices, self.corner_vertex, starts)
        self._keep("vertices", vertices)
        self._keep("corner_vertex", corner_vertex)

        # Surfaces, face by face.
        notes = list(warnings)
        # A limit that came through single precision is not worth a warning.
        self._keep("reflectance", self._mended("reflectance", reflectance, REFLECTANCE_LIMIT, 1e-6, notes))
        self._keep("emission", self._mended("emission", emission, BRIGHTEST, 0.0, notes))
        shown = indices("sides", _or(sides, np.full(n_faces, FRONT)), n_faces)
        self._refuse((shown < AUTO) | (shown > BOTH), "sides must be 0 (auto), 1 (front), 2 (back) or 3 (both)")
        self._keep("sides", shown.astype(np.uint8))
        self._keep("divisions", indices("divisions", _or(divisions, np.ones(n_faces)), n_faces))
        self._keep("lamps", tuple(lamps))
        self._keep("paint", paint.checked(n_faces, n_corners, REFLECTANCE_LIMIT) if paint is not None else None)
        self._refuse(self.divisions < 1, "divisions must be 1 or more")
        self._keep("max_edge", _one_each("max_edge", _or(max_edge, np.full(n_faces, np.nan)), n_faces))
        self._refuse(~(np.isnan(self.max_edge) | (self.max_edge > 0)), "max_edge must be a length above zero")
        for name, part in {"occludes": occludes, "shades": shades, "reflects": reflects, "emits": emits}.items():
            self._keep(name, _one_each(name, _or(part, np.ones(n_faces)), n_faces).astype(np.bool_))
        self._keep("corner_normals", self._mended_normals(corner_normals, notes))
        for what, bad in {
            f"with a vertex at no finite place within {FARTHEST:g} m": lost,
            "without area": ~self.live & ~lost,
        }.items():
            for name, count in self._per_object(bad):
                line = f"Object '{name}': {_faces(count)} {what} {'is' if count == 1 else 'are'} skipped"
                # A changed scene has been told of when it was built: there its lost faces have no area.
                if not any(_skips(told, name) for told in warnings):
                    notes.append(line)
        self._keep("warnings", tuple(dict.fromkeys(notes)))

    @classmethod
    def from_polygons(
        cls,
        polygons: Sequence[ArrayLike],
        reflectance: ArrayLike = 0.0,
        emission: ArrayLike = 0.0,
        **fields: Any,
    ) -> "Scene":
        """Build a scene from loose polygons; those that share a point share a vertex.

        Parameters
        ----------
        polygons : sequence of ndarray of shape (k, 3)
            Corners [m], counter-clockwise seen from the front; k may differ.
        reflectance, emission : array_like
            One value, one colour, or a colour for each polygon (f, 3).
        **fields
            The keyword arguments of `Scene`.

        Returns
        -------
        Scene
            One face for each polygon, in order.
        """
        points = [table(f"polygon {index}", polygon, None) for index, polygon in enumerate(polygons)]
        corners = np.concatenate([*points, np.zeros((0, 3))])
        vertices, corner_vertex = np.unique(corners, axis=0, return_inverse=True)
        start = np.cumsum([0, *(len(outline) for outline in points)])
        try:
            rho, exitance = (np.broadcast_to(np.asarray(x, float), (len(points), 3)) for x in (reflectance, emission))
        except ValueError as error:
            raise RadiosityError("reflectance and emission: one value, one colour, or one colour a polygon") from error
        return cls(vertices, corner_vertex.reshape(-1), start, rho, exitance, **fields)

    @cached_property
    def corner_face(self) -> IntArray:
        """Return the face of each corner, shape (c,)."""
        return np.repeat(np.arange(len(self.face_start) - 1), np.diff(self.face_start))

    @property
    def corner_reflectance(self) -> FloatArray:
        """Return the reflectance at each corner, shape (c, 3)."""
        if self.paint is not None:
            return self.paint.corner_reflectance.astype(np.float64)
        return np.asarray(self.reflectance[self.corner_face])

    @property
    def corner_emission(self) -> FloatArray:
        """Return the exitance at each corner, shape (c, 3) [W/m^2]."""
        if self.paint is not None:
            return self.paint.corner_emission.astype(np.float64)
        return np.asarray(self.emission[self.corner_face])

    @cached_property
    def area_vector(self) -> FloatArray:
        """Return Newell's vector area of each face, shape (f, 3) [m^2]: exact for any shape, planar or not."""
        # Relative to the face's own first corner, so that a face far from the origin keeps its digits.
        arm = self._arms
        following = np.arange(1, len(arm) + 1)
        following[self.face_start[1:] - 1] = self.face_start[:-1]
        twice = np.add.reduceat(np.cross(arm, arm[following]), self.face_start[:-1], axis=0)
        return np.asarray(0.5 * twice)

    @cached_property
    def face_area(self) -> FloatArray:
        """Return the area of each face, shape (f,) [m^2]; of a non-planar one, as seen along its normal."""
        return np.asarray(np.linalg.norm(self.area_vector, axis=1))

    @cached_property
    def face_extent(self) -> FloatArray:
        """Return the diagonal of each face's bounding box, shape (f,) [m]."""
        arm, first = self._arms, self.face_start[:-1]
        span = np.maximum.reduceat(arm, first, axis=0) - np.minimum.reduceat(arm, first, axis=0)
        return np.asarray(np.linalg.norm(span, axis=1))

    @cached_property
    def live(self) -> BoolArray:
        """Return which faces have an area, shape (f,); the others keep their corners but get no patches."""
        return (self.face_area > FLAT * self.face_extent**2) & (self.face_extent > SMALLEST)

    @cached_property
    def face_normal(self) -> FloatArray:
        """Return the unit normal of each face, shape (f, 3); zero for a face without area."""
        size = np.where(self.live, self.face_area, np.inf)
        return np.asarray(self.area_vector / size[:, None])

    @property
    def _arms(self) -> FloatArray:
        """Return each corner as seen from the first corner of its face, shape (c, 3) [m]."""
        position = self.vertices[self.corner_vertex]
        return np.asarray(position - position[self.face_start[self.corner_face]])

    def _keep(self, name: str, value: Any) -> None:
        """Set a field of the frozen dataclass; arrays become read-only."""
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
        object.__setattr__(self, name, value)

    def _per_object(self, bad: BoolArray) -> list[tuple[str, int]]:
        """Return (object name, number of faces) for the objects that have faces marked."""
        objects, counts = np.unique(self.face_object[bad], return_counts=True)
        return [(self.object_names[index], int(count)) for index, count in zip(objects, counts, strict=True)]

    def _refuse(self, bad: BoolArray, what: str) -> None:
        """Raise for the first object with a marked face."""
        for name, count in self._per_object(bad):
            raise RadiosityError(f"Object '{name}': {what} ({_faces(count)})")

    def _check_faces(self) -> None:
        """Refuse faces with fewer than three corners or with corners that are not vertices."""
        self._refuse(np.diff(self.face_start) < 3, "a face needs three corners or more")
        outside = (self.corner_vertex < 0) | (self.corner_vertex >= len(self.vertices))
        self._refuse(faces_with(outside, self.face_start), f"a corner lies outside the {len(self.vertices)} vertices")

    def _mended(self, what: str, values: ArrayLike, most: float, slack: float, notes: list[str]) -> FloatArray:
        """Return reflectance or emission as it can be computed with, and note what was not."""
        given = table(what, values, len(self.face_object))
        mended, none, _ = mended_light(given, most)
        _, _, above = mended_light(given, most + slack)
        for bad, how in (
            (none, "that is negative or not a finite number is taken as 0"),
            (above, f"above {most:g} is taken as {most:g}"),
        ):
            for name, count in self._per_object(bad):
                notes.append(f"Object '{name}': {what} {how} ({_faces(count)})")
        return mended

    def _mended_normals(self, corner_normals: ArrayLike | None, notes: list[str]) -> FloatArray:
        """Return unit corner normals; the face's own where none, a zero one or no number is given."""
        flat = self.face_normal[self.corner_face]
        if corner_normals is None:
            return flat
        normals = table("corner_normals", corner_normals, len(flat))
        # Neither overflows nor vanishes.
        with np.errstate(invalid="ignore", over="ignore"):
            normals = normals / np.maximum(np.abs(normals).max(axis=1, initial=0.0), SMALLEST)[:, None]
            length = np.linalg.norm(normals, axis=1, keepdims=True)
        bad = ~np.isfinite(length[:, 0])
        for name, count in self._per_object(faces_with(bad & self.live[self.corner_face], self.face_start)):
            notes.append(
                f"Object '{name}': normals that are not finite numbers are replaced by the face's ({_faces(count)})"
            )
        usable = (length > 0) & ~bad[:, None]
        return np.where(usable, normals / np.where(usable, length, 1.0), flat)


def _faces(count: int) -> str:
    """Return a count of faces in words."""
    return f"{count} face" if count == 1 else f"{count} faces"


def _skips(line: str, name: str) -> bool:
    """Return whether a warning tells that faces of an object are skipped."""
    return line.startswith(f"Object '{name}': ") and line.endswith("skipped")


def _one_each(name: str, values: ArrayLike, length: int) -> FloatArray:
    """Return one number for each face; NaN is one, too."""
    numbers = np.array(values, dtype=np.float64)
    if numbers.shape != (length,):
        raise RadiosityError(f"{name} must have one value for each of the {length} faces")
    return numbers


def _or(values: ArrayLike | None, default: ArrayLike) -> ArrayLike:
    """Return the values, or the default when there are none."""
    return default if values is None else values
