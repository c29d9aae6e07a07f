# SPDX-License-Identifier: GPL-3.0-or-later
"""The polygons that exchange light: `Scene`, in world space and metres, checked when it is built.

What can be put right becomes a warning that names the object (`mending`); everything else raises `RadiosityError`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import BoolArray, FloatArray, IntArray, indices, one_each, table
from .errors import RadiosityError
from .lighting.kinds import Lamp
from .mending import BRIGHTEST, faces_with, mended_light, mended_normals, mended_polygons, skipped_faces
from .owners import Owners
from .paint.paint import Paint
from .polygons import Polygons, checked_polygons

AUTO, FRONT, BACK, BOTH = 0, 1, 2, 3

# A closed scene that loses nothing has no solution, and one that loses little needs endless bounces.
REFLECTANCE_LIMIT = 0.99


@dataclass(frozen=True, eq=False, init=False)
class Scene(Polygons):
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
    transmittance : ndarray of shape (f, 3)
        Share tau of what arrives on one side that leaves on the other; where it is not 0 both radiate and receive.
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
    tint : ndarray of shape (f, 3)
        What light is multiplied with that goes through the face, where it does not block; 1 else.
    ior : ndarray of shape (f,)
        Index of refraction of such a face, which reflects a part of that light; 1 where it does not.
    reflects, emits : ndarray of shape (f,)
        Whether what the face reflects and emits lights others; its own colours show it anyway.
    lamps : tuple of Lamp
        Lamps and sky: light that comes from no face.
    paint : Paint or None
        How reflectance and emission vary inside faces, whose means are those above.
    warnings : tuple of str
        What was put right or left out, one line each, without repeats.
    """

    reflectance: FloatArray
    emission: FloatArray
    transmittance: FloatArray
    corner_normals: FloatArray
    face_object: IntArray
    object_names: tuple[str, ...]
    sides: NDArray[np.uint8]
    divisions: IntArray
    max_edge: FloatArray
    occludes: BoolArray
    shades: BoolArray
    tint: FloatArray
    ior: FloatArray
    reflects: BoolArray
    emits: BoolArray
    lamps: tuple[Lamp, ...]
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
        transmittance: ArrayLike | None = None,
        corner_normals: ArrayLike | None = None,
        face_object: ArrayLike | None = None,
        object_names: Sequence[str] = ("Scene",),
        sides: ArrayLike | None = None,
        divisions: ArrayLike | None = None,
        max_edge: ArrayLike | None = None,
        occludes: ArrayLike | None = None,
        shades: ArrayLike | None = None,
        tint: ArrayLike | None = None,
        ior: ArrayLike | None = None,
        reflects: ArrayLike | None = None,
        emits: ArrayLike | None = None,
        lamps: Sequence[Lamp] = (),
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
        given = checked_polygons(vertices, corner_vertex, face_start)
        n_faces = len(given.face_start) - 1
        self._keep("object_names", tuple(object_names))
        self._keep("face_object", indices("face_object", _or(face_object, np.zeros(n_faces)), n_faces))
        if np.any((self.face_object < 0) | (self.face_object >= len(self.object_names))):
            raise RadiosityError(f"face_object must index the {len(self.object_names)} object names")
        polygons, lost = mended_polygons(given, self.owners)
        for name in ("vertices", "corner_vertex", "face_start"):
            self._keep(name, getattr(polygons, name))

        notes = list(warnings)
        self._keep_surfaces(reflectance, emission, transmittance, sides, divisions, max_edge, paint, notes)
        for name, part in {"occludes": occludes, "shades": shades, "reflects": reflects, "emits": emits}.items():
            self._keep(name, one_each(name, _or(part, np.ones(n_faces)), n_faces).astype(np.bool_))
        self._keep("tint", table("tint", _or(tint, np.ones((n_faces, 3))), n_faces))
        self._keep("ior", one_each("ior", _or(ior, np.ones(n_faces)), n_faces))
        self._keep("lamps", tuple(lamps))
        self._keep_normals(corner_normals, notes)
        notes.extend(skipped_faces(self.owners, lost, ~self.live & ~lost, told=warnings))
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

    @property
    def owners(self) -> Owners:
        """Return which object each face belongs to, for messages."""
        return Owners(self.object_names, self.face_object)

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

    def _keep(self, name: str, value: Any) -> None:
        """Set a field of the frozen dataclass; arrays become read-only."""
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
        object.__setattr__(self, name, value)

    def _keep_surfaces(
        self,
        reflectance: ArrayLike,
        emission: ArrayLike,
        transmittance: ArrayLike | None,
        sides: ArrayLike | None,
        divisions: ArrayLike | None,
        max_edge: ArrayLike | None,
        paint: Paint | None,
        notes: list[str],
    ) -> None:
        """Keep what there is of each face, and note what was put right."""
        n_faces, owners = len(self.face_object), self.owners
        self._keep("reflectance", self._light("reflectance", reflectance, REFLECTANCE_LIMIT, notes))
        self._keep("emission", self._light("emission", emission, BRIGHTEST, notes))
        given = self._light("transmittance", _or(transmittance, np.zeros((n_faces, 3))), 1.0, notes)
        self._keep("transmittance", np.minimum(given, REFLECTANCE_LIMIT - self.reflectance))
        shown = indices("sides", _or(sides, np.full(n_faces, FRONT)), n_faces)
        owners.refuse((shown < AUTO) | (shown > BOTH), "sides must be 0 (auto), 1 (front), 2 (back) or 3 (both)")
        self._keep("sides", shown.astype(np.uint8))
        self._keep("divisions", indices("divisions", _or(divisions, np.ones(n_faces)), n_faces))
        n_corners = len(self.corner_vertex)
        self._keep("paint", paint.checked(n_faces, n_corners, REFLECTANCE_LIMIT) if paint is not None else None)
        owners.refuse(self.divisions < 1, "divisions must be 1 or more")
        self._keep("max_edge", one_each("max_edge", _or(max_edge, np.full(n_faces, np.nan)), n_faces))
        owners.refuse(~(np.isnan(self.max_edge) | (self.max_edge > 0)), "max_edge must be a length above zero")

    def _light(self, what: str, values: ArrayLike, most: float, notes: list[str]) -> FloatArray:
        """Return reflectance or emission as it can be computed with, and note what was not."""
        mended, lines = mended_light(what, table(what, values, len(self.face_object)), most, self.owners)
        notes.extend(lines)
        return mended

    def _keep_normals(self, corner_normals: ArrayLike | None, notes: list[str]) -> None:
        """Keep unit corner normals; the face's own where none, a zero one or no number is given."""
        normals = self.face_normal[self.corner_face]
        if corner_normals is not None:
            normals, none = mended_normals(table("corner_normals", corner_normals, len(normals)), normals)
            bad = faces_with(none & self.live[self.corner_face], self.face_start)
            what = "normals that are not finite numbers are replaced by the face's"
            notes.extend(self.owners.lines(bad, what))
        self._keep("corner_normals", normals)


def _or(values: ArrayLike | None, default: ArrayLike) -> ArrayLike:
    """Return the values, or the default when there are none."""
    return default if values is None else values
