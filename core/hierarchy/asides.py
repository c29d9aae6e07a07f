# SPDX-License-Identifier: GPL-3.0-or-later
"""Points put aside: on a surface that a receiver stands beside, where the mesh itself has no corner."""

import numpy as np
from numpy.typing import NDArray

from ..meshing import Patches
from .elements import Elements
from .glances import Corners
from .sights import Sights
from .tree import Float, Int

# How far from an edge a point is put beside it, as a share of its element's size.
_ASIDE = 0.1
# Normals that differ by less are of one plane.
_SAME_PLANE = 1e-3


def foremost(sights: Sights, most: int) -> NDArray[np.bool_]:
    """Choose the sights of the receivers that see most of what they stand beside.

    Parameters
    ----------
    sights : Sights
    most : int
        Receivers that may be chosen.

    Returns
    -------
    ndarray of shape (k,)
        Which sights those are.
    """
    receiver, which = np.unique(sights.receiver, return_inverse=True)
    seen = np.bincount(which.ravel(), sights.weight, len(receiver))
    chosen = np.zeros(len(receiver), bool)
    chosen[np.argsort(-seen, kind="stable")[:most]] = True
    return chosen[which.ravel()]


def widths(corners: Corners, patches: Patches) -> Float:
    """Tell how wide the smallest patch at each receiver is.

    Parameters
    ----------
    corners : Corners
    patches : Patches

    Returns
    -------
    ndarray of shape (q,)
        [m]; infinite where there is none.
    """
    area = np.full(len(corners.point), np.inf)
    np.minimum.at(area, corners.group[patches.touch_corner], patches.area[patches.touch_patch])
    return np.sqrt(area)


def points_aside(
    sights: Sights, gap: NDArray[np.bool_], corners: Corners, elements: Elements, width: Float
) -> tuple[Int, Corners, Int]:
    """Put points on elements in front of receivers at their edge, one for each receiver and plane.

    Not so far that they no longer stand beside what the receiver stands for, of so much width. Across a gap, where it
    sees more than an end of them, each element has a point where the light comes from on the mean.

    Parameters
    ----------
    sights : Sights
        Of k elements that the receivers stand beside.
    gap : ndarray of shape (k,)
        Which of those are across a gap.
    corners : Corners
        The receivers.
    elements : Elements
    width : ndarray of shape (q,)
        See `widths`.

    Returns
    -------
    owner : ndarray of shape (p,)
        The receiver that each is put beside.
    points : Corners
    which : ndarray of shape (k,)
        The point of each pair.
    """
    normal = elements.normal[sights.element]
    plane = np.column_stack((sights.receiver, np.round(normal / _SAME_PLANE), np.where(gap, sights.element, -1)))
    _, first, which = np.unique(plane, axis=0, return_index=True, return_inverse=True)
    owner, element, normal, gap = sights.receiver[first], sights.element[first], normal[first], gap[first]
    at, forward = corners.point[owner], corners.normal[owner]
    height = ((at - elements.corners[element, 0]) * normal).sum(axis=1)[:, None]
    forward = forward - (forward * normal).sum(axis=1, keepdims=True) * normal
    forward /= np.maximum(np.sqrt((forward * forward).sum(axis=1, keepdims=True)), 1e-300)
    step = np.maximum(height, _ASIDE * np.minimum(np.sqrt(elements.area[element]), width[owner])[:, None])
    point = np.where(gap[:, None], sights.place[first], at - height * normal + step * forward)
    return owner, Corners(point, normal, np.arange(len(owner))), which.ravel()
