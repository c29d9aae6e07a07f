# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that run on behind a wall, into the dark: what is looked at of them is the part that is in the light.

The ground under a house has corners inside of it. It is dark there, and black that fades out over half a face would
show along the foot of the house. So such a corner has the light of those on this side of the wall.
"""

import numpy as np
from numpy.typing import NDArray

from ..visibility import Surroundings
from .glances import Corners
from .probes import points_among_dark
from .tree import Float, Int

# A corner with less than this share of its neighbour's light is in the dark.
_BLACK = 0.02
# How far towards the neighbour a wall has to be: corners of rooms end at their walls. And how high above the face that
# is looked for, both as shares of the way.
_SHORT, _LIFT = 0.9, 0.02


def past_walls(
    corners: Corners,
    edges: tuple[Int, Int],
    arriving: Float,
    sides: NDArray[np.uint8] | None,
    occluders: Surroundings,
) -> tuple[Int, Int]:
    """Find corners in the dark that a wall parts from neighbours in the light.

    Parameters
    ----------
    corners : Corners
    edges : tuple of two ndarrays of shape (e,)
        Who is a neighbour of whom, see `filter.mesh_edges`.
    arriving : ndarray of shape (q, 3)
        What arrives at each [W/m^2].
    sides : ndarray of shape (f,) or None
        Which sides of all faces that block have light, see `Scene`: a dark room, whose walls could have some, is not
        the inside of a wall.
    occluders : Surroundings

    Returns
    -------
    dark, bright : ndarray of shape (k,)
        Such corners and their neighbours, pair by pair.
    """
    light = arriving.mean(axis=1)
    one, other = (np.concatenate(ends) for ends in (edges, edges[::-1]))
    apart = light[one] < _BLACK * light[other]
    dark, bright = one[apart], other[apart]
    way = corners.point[bright] - corners.point[dark]
    high = _LIFT * np.sqrt((way * way).sum(axis=1))[:, None] * corners.normal[dark]
    start = corners.point[dark] + high
    parted = occluders.blocked(start, start + _SHORT * way)
    dark, bright = dark[parted], bright[parted]
    asked, which = np.unique(dark, return_inverse=True)
    buried = points_among_dark(corners.point[asked], corners.normal[asked], sides, occluders)[which.ravel()]
    return dark[buried], bright[buried]


def with_light_outside(light: Float, pairs: tuple[Int, Int]) -> Float:
    """Give corners in the dark the mean of their neighbours in the light.

    Parameters
    ----------
    light : ndarray of shape (q, k)
        [W/m^2].
    pairs : tuple of two ndarrays
        From `past_walls`.

    Returns
    -------
    ndarray of shape (q, k)
    """
    dark, bright = pairs
    count = np.bincount(dark, minlength=len(light))
    mean = np.stack([np.bincount(dark, channel[bright], len(light)) for channel in light.T], axis=1)
    return np.where(count[:, None] > 0, mean / np.maximum(count, 1)[:, None], light)
