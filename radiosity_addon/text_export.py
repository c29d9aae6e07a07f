# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of quads as rectangles of the thesis's scene file (T11)."""

from math import isqrt

import numpy as np
from mathutils.kdtree import KDTree
from numpy.typing import NDArray

from ..core.errors import RadiosityError
from ..core.rectangles import EMITTER, SURFACE, Rectangle
from ..core.scene import Scene
from ..core.scene_text import write_scene_text
from .text_import import AXES

SAME_PLACE = 1e-3  # of a cell's size: how far off its place in the grid a face may be
DIGITS = 6  # what single precision, in which Blender keeps colors, is good for


def rectangles_from_scene(scene: Scene, up: str = 'Z') -> tuple[tuple[Rectangle, ...], tuple[str, ...]]:
    """Turn a scene's faces into rectangles.

    Parameters
    ----------
    scene : core.scene.Scene
        Quads; an object whose faces are the n x n grid of one quadrilateral becomes one rectangle with n divisions.
    up : {'Z', 'Y'}
        The file's axis for Blender's z; 'Z' keeps the coordinates as they are.

    Returns
    -------
    rectangles : tuple of Rectangle
        In the order of objects and faces.
    warnings : tuple of str
        What the file cannot hold.

    Raises
    ------
    RadiosityError
        For faces that are not flat quads; names the object.
    """
    rectangles: list[Rectangle] = []
    warnings = list(scene.warnings)
    for number, name in enumerate(scene.object_names):
        faces = np.flatnonzero((scene.face_object == number) & scene.live)
        others = np.count_nonzero(np.diff(scene.face_start)[faces] != 4)
        if others:
            raise RadiosityError(
                f"Object '{name}' has faces that are not quads ({others} of {len(faces)}), and the file holds "
                "rectangles only: make quads (Face > Tris to Quads) or hide the object in renders"
            )
        if (scene.emission[faces].any(axis=1) & scene.reflectance[faces].any(axis=1)).any():
            warnings.append(f"Object '{name}' emits and reflects; the file keeps only what it emits")
        found = _object_rectangles(scene, faces, AXES[up])
        try:
            write_scene_text(found)
        except RadiosityError as error:
            raise RadiosityError(f"Object '{name}' cannot be written: {error}") from error
        rectangles.extend(found)
    return tuple(rectangles), tuple(warnings)


def _object_rectangles(scene: Scene, faces: NDArray[np.int64], axes: NDArray[np.float64]) -> list[Rectangle]:
    """Return one rectangle for a grid, else one for each face."""
    if not len(faces):
        return []
    vertex = scene.corner_vertex[scene.face_start[faces][:, None] + np.arange(4)]
    quads = scene.vertices[vertex]
    light = np.concatenate([scene.reflectance[faces], scene.emission[faces]], axis=1)
    whole = _grid_outline(vertex, quads) if (light == light[0]).all() else None
    if whole is not None:
        return [_rectangle(whole, isqrt(len(faces)), scene.face_normal[faces[0]], light[0], axes)]
    return [
        _rectangle(quad, 1, normal, row, axes)
        for quad, normal, row in zip(quads, scene.face_normal[faces], light, strict=True)
    ]


def _grid_outline(vertex: NDArray[np.int64], quads: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the four corners of the quadrilateral that f quads divide evenly, or None when they do not.

    Parameters
    ----------
    vertex : ndarray of shape (f, 4)
        Vertices of the quads.
    quads : ndarray of shape (f, 4, 3)
        Their positions.
    """
    n = isqrt(len(quads))
    used, first, count = np.unique(vertex, return_index=True, return_counts=True)
    if n * n != len(quads) or len(used) != (n + 1) ** 2 or np.count_nonzero(count == 1) != 4:
        return None
    # The corners of the whole belong to one quad each; put them counter-clockwise, the first one first.
    corners = quads.reshape(-1, 3)[np.sort(first[count == 1])]
    diagonals = quads[0, 2] - quads[0, 0], quads[0, 3] - quads[0, 1]
    normal = np.cross(*diagonals)
    arms = corners - corners.mean(axis=0)
    angle = np.arctan2(np.cross(arms[0], arms) @ normal / np.linalg.norm(normal), arms @ arms[0])
    corners = corners[np.argsort(angle % (2.0 * np.pi))]

    middle = (np.arange(n) + 0.5) / n
    u, v = np.meshgrid(middle, middle)
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=-1).reshape(-1, 4)
    tree = KDTree(len(quads))
    for index, centre in enumerate(quads.mean(axis=1)):
        tree.insert(centre, index)
    tree.balance()
    places = [tree.find(place) for place in weights @ corners]
    near = SAME_PLACE * np.linalg.norm(corners[2] - corners[0]) / n
    matches = len({index for _, index, _ in places}) == len(quads) and all(away <= near for _, _, away in places)
    return corners if matches else None


def _rectangle(
    corners: NDArray[np.float64],
    divisions: int,
    normal: NDArray[np.float64],
    light: NDArray[np.float64],
    axes: NDArray[np.float64],
) -> Rectangle:
    """Write the numbers as short as their precision allows."""
    emits = bool(light[3:].any())
    values = light[3:] if emits else light[:3]
    factor = float(values.max())
    # The inverse of a rotation is its transpose; adding 0 turns -0 into 0.
    return Rectangle(
        EMITTER if emits else SURFACE,
        divisions,
        _short(corners @ axes + 0.0),
        np.round(normal @ axes, DIGITS) + 0.0,
        np.array([float(f"{value:.{DIGITS}g}") for value in values / (factor or 1.0)]),
        float(f"{factor:.{DIGITS}g}"),
    )


def _short(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shortest decimals that name the same numbers in single precision."""
    flat = [float(str(value)) for value in values.astype(np.float32).ravel()]
    return np.array(flat).reshape(values.shape)
