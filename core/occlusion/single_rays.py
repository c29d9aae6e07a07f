# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is asked for single rays: Blender's tree where there is a Blender, every surface one by one elsewhere."""

from .blender_tree import BVHOccluders, in_blender
from .brute_force import BruteForceOccluders
from .surfaces import Occluding

SingleRays = BVHOccluders | BruteForceOccluders


def single_rays(occluding: Occluding) -> SingleRays:
    """Return who tells what single segments and rays meet.

    Parameters
    ----------
    occluding : Occluding
        Surfaces that block.

    Returns
    -------
    BVHOccluders or BruteForceOccluders
    """
    return BVHOccluders(occluding) if in_blender() else BruteForceOccluders(occluding)
