# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of the matrix of form factors by hemicubes at the patches' centres (T4); no rays are needed."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import IntArray, SingleArray
from ..hemicube import Hemicube
from ..meshing import Patches


@dataclass(frozen=True, eq=False)
class Views:
    """What hemicubes look at.

    Attributes
    ----------
    patches : Patches
    shown : ndarray of shape (m,)
        Patches that stand for the surfaces: all but the backs of those that radiate on both sides.
    behind : ndarray of shape (m,)
        The patch on the other side of each of them; -1 where none is.
    hemicube : Hemicube
    """

    patches: Patches
    shown: IntArray
    behind: IntArray
    hemicube: Hemicube = field(default_factory=Hemicube)


def hemicube_views(patches: Patches) -> Views:
    """Sort out which patches are two sides of one surface.

    Parameters
    ----------
    patches : Patches
        The fronts of a face come before its backs, both in the same order.

    Returns
    -------
    Views
    """
    front, back = patches.side > 0, patches.side < 0
    two_sided = np.intersect1d(patches.face[front], patches.face[back])
    of_two = np.isin(patches.face, two_sided)
    shown = np.flatnonzero(~(back & of_two))
    other = np.full(len(front), -1)
    other[front & of_two] = np.flatnonzero(back & of_two)
    return Views(patches, shown, other[shown])


def hemicube_rows(views: Views, members: IntArray) -> SingleArray:
    """Return the form factors from some patches to all.

    Parameters
    ----------
    views : Views
    members : ndarray of shape (k,)
        Patches at whose centres hemicubes stand.

    Returns
    -------
    ndarray of shape (k, n), float32
        F_ij; no row sums to more than 1.
    """
    patches, cube = views.patches, views.hemicube
    polygons = patches.corners[views.shown]
    rows = np.zeros((len(members), len(patches.area)), dtype=np.float32)
    for row, member in zip(rows, members, strict=True):
        if patches.area[member] > 0.0:
            polygon, front = cube.seen(patches.centre[member], patches.normal[member], polygons)
            seen = np.where(polygon < 0, -1, np.where(front, views.shown[polygon], views.behind[polygon]))
            lit = seen >= 0
            row += np.bincount(seen[lit], cube.deltas[lit], minlength=len(row)).astype(np.float32)
    return rows
