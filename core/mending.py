# SPDX-License-Identifier: GPL-3.0-or-later
"""What strangers' scenes bring that no light can be computed with, put right before a scene is built.

Nothing is refused for one bad vertex among a million: its faces are left out, and a number that is none counts as zero.
Who asks gets told which faces those were.
"""

from collections.abc import Sequence

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .owners import Owners, faces
from .polygons import Polygons

# Products of lengths must not overflow [m].
FARTHEST = 1e12
# Radiant exitance that sums and products have room above [W/m^2].
BRIGHTEST = 1e15
# A limit that came through single precision is not worth a warning.
_SLACK = 1e-6
# Length of a normal below which it points nowhere.
_SHORTEST = 1e-30


def faces_with(corners: BoolArray, face_start: IntArray) -> BoolArray:
    """Return the faces that have a marked corner, shape (f,)."""
    marked = np.concatenate([[0], np.cumsum(corners)])
    return np.asarray(marked[face_start[1:]] > marked[face_start[:-1]])


def mended_polygons(polygons: Polygons, owners: Owners) -> tuple[Polygons, BoolArray]:
    """Refuse faces that are none, and take out the vertices that are nowhere.

    Parameters
    ----------
    polygons : Polygons
        In world space.
    owners : Owners
        Of the faces.

    Returns
    -------
    polygons : Polygons
        All vertices are finite.
    lost : ndarray of shape (f,)
        Faces that have no area any more.

    Raises
    ------
    RadiosityError
        Where a face has fewer than three corners, or one that is no vertex.
    """
    vertices, corner_vertex, face_start = polygons.vertices, polygons.corner_vertex, polygons.face_start
    owners.refuse(np.diff(face_start) < 3, "a face needs three corners or more")
    outside = (corner_vertex < 0) | (corner_vertex >= len(vertices))
    owners.refuse(faces_with(outside, face_start), f"a corner lies outside the {len(vertices)} vertices")
    vertices, corner_vertex, lost = mended_positions(vertices, corner_vertex, face_start)
    return Polygons(vertices, corner_vertex, face_start), lost


def mended_positions(
    vertices: FloatArray, corner_vertex: IntArray, face_start: IntArray
) -> tuple[FloatArray, IntArray, BoolArray]:
    """Take out the vertices that are nowhere, or too far away.

    Parameters
    ----------
    vertices : ndarray of shape (v, 3)
        [m].
    corner_vertex : ndarray of shape (c,)
    face_start : ndarray of shape (f + 1,)

    Returns
    -------
    vertices : ndarray of shape (v, 3)
        All finite: those that were not are where another vertex is.
    corner_vertex : ndarray of shape (c,)
        A face with such a vertex has shrunk to one of its others, and so has no area.
    lost : ndarray of shape (f,)
        Those faces.
    """
    with np.errstate(invalid="ignore"):
        bad = ~(np.abs(vertices) <= FARTHEST).all(axis=1)
    if not bad.any():
        return vertices, corner_vertex, np.zeros(len(face_start) - 1, dtype=np.bool_)
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[corner_vertex] = True
    # Of the faces' vertices if there is one, so that what is loose does not make the scene larger.
    there = np.flatnonzero(~bad & used)
    there = there if len(there) else np.flatnonzero(~bad)
    place = vertices[there[0]] if len(there) else np.zeros(3)
    lost = faces_with(bad[corner_vertex], face_start)
    face = np.repeat(np.arange(len(lost)), np.diff(face_start))
    corner = np.flatnonzero(lost[face])
    # The last one written stays: the face's first corner that is somewhere.
    anchor = corner_vertex[face_start[:-1]]
    somewhere = corner[~bad[corner_vertex[corner]]][::-1]
    anchor[face[somewhere]] = corner_vertex[somewhere]
    shrunk = corner_vertex.copy()
    shrunk[corner] = anchor[face[corner]]
    return np.where(bad[:, None], place, vertices), shrunk, lost


def mended_light(what: str, values: FloatArray, most: float, owners: Owners) -> tuple[FloatArray, list[str]]:
    """Take out what is no light, and tell whose it was.

    Parameters
    ----------
    what : str
        What the values are called.
    values : ndarray of shape (f, 3)
        Reflectance, or exitance [W/m^2].
    most : float
        Limit.
    owners : Owners
        Of the faces.

    Returns
    -------
    values : ndarray of shape (f, 3)
        From 0 to the limit; 0 for what is negative or no number.
    lines : list of str
        A line for each object and reason.
    """
    none = ~np.isfinite(values) | (values < 0)
    positive = np.where(none, 0.0, values)
    above = (positive > most + _SLACK).any(axis=1)
    lines = owners.lines(none.any(axis=1), f"{what} that is negative or not a finite number is taken as 0")
    lines += owners.lines(above, f"{what} above {most:g} is taken as {most:g}")
    return np.minimum(positive, most), lines


def mended_normals(normals: FloatArray, instead: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Bring normals to unit length, and take out those that have none.

    Parameters
    ----------
    normals : ndarray of shape (c, 3)
        Of any length.
    instead : ndarray of shape (c, 3)
        What to take for those that are zero or no numbers.

    Returns
    -------
    normals : ndarray of shape (c, 3)
    none : ndarray of shape (c,)
        Those that were not finite numbers.
    """
    # Neither overflows nor vanishes.
    with np.errstate(invalid="ignore", over="ignore"):
        normals = normals / np.maximum(np.abs(normals).max(axis=1, initial=0.0), _SHORTEST)[:, None]
        length = np.linalg.norm(normals, axis=1, keepdims=True)
    none = ~np.isfinite(length[:, 0])
    usable = (length > 0) & ~none[:, None]
    return np.where(usable, normals / np.where(usable, length, 1.0), instead), none


def skipped_faces(owners: Owners, lost: BoolArray, flat: BoolArray, told: Sequence[str]) -> list[str]:
    """Tell which objects have faces that get no light.

    Parameters
    ----------
    owners : Owners
        Of the faces.
    lost, flat : ndarray of shape (f,)
        Faces with a vertex that was nowhere, and other ones without area.
    told : sequence of str
        Warnings that there have been; who stands there is not told of again.

    Returns
    -------
    list of str
        A line for each object and reason.
    """
    lines = []
    for what, bad in {f"with a vertex at no finite place within {FARTHEST:g} m": lost, "without area": flat}.items():
        for name, count in owners.counts(bad):
            start, end = f"Object '{name}': ", "skipped"
            # A changed scene has been told of when it was built: there its lost faces have no area.
            if not any(line.startswith(start) and line.endswith(end) for line in told):
                lines.append(f"{start}{faces(count)} {what} {'is' if count == 1 else 'are'} {end}")
    return lines
