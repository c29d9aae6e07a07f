# SPDX-License-Identifier: GPL-3.0-or-later
"""How light runs on within an element that fills much of what a receiver sees: on a slope that its corners tell.

An element has one radiosity. Where half of it is in the shade, a receiver in the same shade sees the dark half, near
by; one outside sees the bright one. The corners of the mesh know the light at either end, so the element's light is
taken to change evenly along it, and what counts is where on it the receiver looks (in the spirit of the higher-order
radiosity of Zatz 1993, at the final gather only).
"""

from dataclasses import dataclass

import numpy as np

from ..meshing import Patches
from ..runs import counted
from ..scene import Scene
from .elements import Elements
from .glances import Corners
from .sights import Sights
from .tree import Float, Int
from .vectors import dots

# A slope leads no further than from one end of an element to the other.
_FURTHEST = 1.0


@dataclass(frozen=True, eq=False)
class Slopes:
    """What receivers see of elements beyond their mean, in terms of the light at the corners of those.

    Attributes
    ----------
    receiver, element : ndarray of shape (k,)
    corner : ndarray of shape (k,)
        A receiver that stands for a corner of the element.
    share : ndarray of shape (k,)
        How much of the irradiance there is added, times the element's reflectance; those of an element add up to zero.
    """

    receiver: Int
    element: Int
    corner: Int
    share: Float


def find_slopes(sights: Sights, scene: Scene, corners: Corners, elements: Elements, patches: Patches) -> Slopes:
    """Find out by how much each corner of what receivers see changes their light.

    Parameters
    ----------
    sights : Sights
        Of elements that the receivers see much of.
    scene : Scene
    corners : Corners
        Its receivers.
    elements : Elements
        Those that are a whole patch with all its corners in the mesh have a slope.
    patches : Patches

    Returns
    -------
    Slopes
    """
    order = np.argsort(patches.touch_patch, kind="stable")
    first = np.searchsorted(patches.touch_patch[order], np.arange(len(patches.area) + 1))
    touching = np.diff(first)
    pieces = np.bincount(elements.patch, minlength=len(patches.area))
    sights = sights.pick((pieces == 1)[elements.patch[sights.element]])
    shape = 3 + (elements.corners[sights.element, 2] != elements.corners[sights.element, 3]).any(axis=1)
    sights = sights.pick(touching[elements.patch[sights.element]] == shape)
    found, of = np.unique(sights.element, return_inverse=True)
    # The corners of each element in question, side by side.
    patch = elements.patch[found]
    count = touching[patch]
    pair, touch = counted(count, first[patch])
    corner = patches.touch_corner[order[touch]]
    gradient = _gradients(pair, scene.vertices[scene.corner_vertex[corner]], elements, found)
    # ... and again for each that sees it.
    sight, entry = counted(count[of], (np.cumsum(count) - count)[of])
    along = (sights.place - elements.centre[sights.element])[sight]
    share = np.clip(dots(gradient[entry], along), -_FURTHEST, _FURTHEST) * sights.weight[sight]
    return Slopes(sights.receiver[sight], sights.element[sight], corners.group[corner[entry]], share)


def _gradients(pair: Int, point: Float, elements: Elements, found: Int) -> Float:
    """Return by what each corner of an element weighs in the gradient of what its corners tell, shape (k, 3) [1/m].

    The plane through the values at n points has the gradient M^-1 sum (x - mean) value, with M their second moments.
    """
    count = np.bincount(pair, minlength=len(found))
    mean = np.stack([np.bincount(pair, axis, len(found)) for axis in point.T], axis=1) / count[:, None]
    arm = point - mean[pair]
    moments = np.zeros((len(found), 3, 3))
    for i in range(3):
        for j in range(3):
            moments[:, i, j] = np.bincount(pair, arm[:, i] * arm[:, j], len(found))
    trace = np.trace(moments, axis1=1, axis2=2)[:, None, None]
    normal = elements.normal[found]
    # Along the normal nothing changes; a sliver has no slope across.
    moments += trace * (normal[:, :, None] * normal[:, None] + 1e-4 * np.eye(3)) + 1e-300 * np.eye(3)
    gradient: Float = (np.linalg.inv(moments)[pair] @ arm[:, :, None])[:, :, 0]
    return gradient
