# SPDX-License-Identifier: GPL-3.0-or-later
"""Where new objects stand."""

import bpy
import numpy as np
from mathutils import Matrix


def place(obj: bpy.types.Object, matrix: Matrix) -> None:
    """Let an object and its mesh stand where a matrix says.

    Parameters
    ----------
    obj : bpy.types.Object
        A mesh object without parent; its mesh has no other user.
    matrix : Matrix
        Object space to world space.
    """
    obj.matrix_world = matrix
    location, rotation, scale = matrix.decompose()
    error = np.abs(np.array(Matrix.LocRotScale(location, rotation, scale)) - np.array(matrix)).max()
    # A stretched parent shears its children, which no location, rotation and scale can say.
    if error > 1e-5 * max(1.0, *(abs(s) for s in scale)):
        obj.matrix_world = Matrix.Identity(4)
        obj.data.transform(matrix)
        if matrix.determinant() < 0.0:
            obj.data.flip_normals()
