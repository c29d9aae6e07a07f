# SPDX-License-Identifier: GPL-3.0-or-later
"""What the exchange of light between patches is computed from: points, groups, and the surfaces that block."""

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray, IntArray
from ..meshing import Patches
from ..occlusion.surfaces import Occluding
from ..visibility import Occluders
from .quadrature import turned_points
from .shafts import Blockers, as_blockers, compact_groups

# Centre distance over the sum of both radii below which eight pairs of points are not enough.
NEAR = 3.0
# Heights above a plane up to this share of the scene's size are single precision's rounding.
ROUNDING = 2e-7

# Which of the four points round either patch meet: half of all sixteen pairs, those of unlike parity, by which every
# product of up to three coordinates is still averaged exactly (a fractional factorial design of resolution IV). The
# same pairs meet whichever patch comes first.
OF_I = np.array([0, 0, 1, 1, 2, 2, 3, 3])
OF_J = np.array([1, 3, 0, 2, 1, 3, 0, 2])


@dataclass(frozen=True, eq=False)
class Exchange:
    """All that a block of A F is computed from.

    Attributes
    ----------
    patches : Patches
    points : ndarray of shape (n, q, 3)
        What stands for each patch [m]: its centre, or four points round it.
    weights : ndarray of shape (n, q)
        Area that each point stands for [m^2].
    of_i, of_j : ndarray of shape (s,)
        Which points of two patches meet.
    radius : ndarray of shape (n,)
        Distance from a patch's centre to its farthest corner [m].
    near : float
        Pairs closer than this times their radii get the exact factor; 0 for none.
    occluders : Occluders or None
        Who casts rays; None when nothing blocks.
    blockers : Blockers or None
        The surfaces that block, where known.
    groups : list of ndarray
        Patches that are close together and look the same way.
    size : float
        The scene's diagonal [m].
    """

    patches: Patches
    points: FloatArray
    weights: FloatArray
    of_i: IntArray
    of_j: IntArray
    radius: FloatArray
    near: float
    occluders: Occluders | None
    blockers: Blockers | None
    groups: list[IntArray]
    size: float


def exchange(
    patches: Patches, occluders: Occluders | None, surfaces: Occluding | None, *, exact: bool = True
) -> Exchange:
    """Prepare to compute who lights whom.

    Parameters
    ----------
    patches : Patches
    occluders : Occluders or None
        Who casts rays; None when nothing blocks.
    surfaces : Occluding or None
        The same surfaces as triangles, which save most of the rays; None when they are not known.
    exact : bool
        Factors between areas (T3); else between centres (T2), one ray a pair (T14).

    Returns
    -------
    Exchange
    """
    points, share = patches.centre[:, None], np.ones((len(patches.area), 1))
    if exact:
        points, share = turned_points(patches.corners)
    reach = np.linalg.norm(patches.corners - patches.centre[:, None], axis=2).max(axis=1, initial=0.0)
    span = np.ptp(patches.corners.reshape(-1, 3), axis=0) if len(reach) else np.zeros(3)
    return Exchange(
        patches=patches,
        points=points,
        weights=share * patches.area[:, None],
        of_i=OF_I if exact else np.zeros(1, dtype=np.int64),
        of_j=OF_J if exact else np.zeros(1, dtype=np.int64),
        radius=reach,
        near=NEAR if exact else 0.0,
        occluders=occluders,
        blockers=None if surfaces is None or occluders is None else as_blockers(surfaces),
        groups=compact_groups(patches.centre, patches.normal),
        size=float(np.linalg.norm(span)) or 1.0,
    )


def meeting(x: Exchange, members: IntArray, which: IntArray) -> FloatArray:
    """Return the points of patches that meet.

    Parameters
    ----------
    x : Exchange
    members : ndarray of shape (m,)
        Patches.
    which : ndarray of shape (s,)
        `x.of_i` or `x.of_j`.

    Returns
    -------
    ndarray of shape (s, m, 3)
        [m].
    """
    return x.points[members].transpose(1, 0, 2)[which]
