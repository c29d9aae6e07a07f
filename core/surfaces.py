# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces that block light, as few polygons as they can be told in (T14)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .meshing import Patches
    from .scene import Scene


@dataclass(frozen=True, eq=False)
class Occluding:
    """Triangles that block light, whatever the meshing for light is.

    Attributes
    ----------
    vertices : ndarray of shape (v, 3)
        World space [m].
    triangles : ndarray of shape (t, 3)
        Indices into `vertices`.
    triangle_face : ndarray of shape (t,)
        A face of the scene that each triangle stands for.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    triangle_face: NDArray[np.int64]


def occluder_polygons(scene: Scene, patches: Patches) -> Occluding:
    """Return the triangles that block light in a scene.

    Parameters
    ----------
    scene : Scene
    patches : Patches
        What lights and is lit; they lie on the faces of `scene`.

    Returns
    -------
    Occluding
    """
    # A patch's second triangle has no area when the patch is a triangle itself.
    corners = patches.corners
    triangles = np.arange(4 * len(corners)).reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    face = np.repeat(patches.face, 2)
    real = ~np.tile([False, True], len(corners)) | np.repeat((corners[:, 2] != corners[:, 3]).any(axis=1), 2)
    return Occluding(corners.reshape(-1, 3), triangles[real], face[real])
