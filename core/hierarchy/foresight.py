# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory told in advance: what links will take, from those of a few groups, before any is kept."""

import numpy as np

from ..errors import RadiosityError
from ..memory import available_memory
from .quality import Detail
from .receivers import Receivers
from .scenery import Scenery, links_to
from .thickets import rays_of

# Groups that tell what all will take: they differ by half, so that so many are an eighth off.
_ASKED = 16
# A link keeps its node, and one weight for each receiver of its group [bytes].
_NODE, _WEIGHT = 8, 4
# What a patch takes besides, with its corners, at the least that was measured: of millions of leaves [bytes].
_PATCH = 4096


def links_memory(receivers: Receivers, scenery: Scenery, detail: Detail) -> int:
    """Estimate what the links of all groups will take, without a ray.

    Parameters
    ----------
    receivers : Receivers
    scenery : Scenery
    detail : Detail

    Returns
    -------
    int
        Rather too much than too little: links that no ray gets through are counted, on curved meshes
        about half [bytes].
    """
    count = np.diff(receivers.first)
    if not len(count):
        return 0
    # From the middle of as many equal parts of the list, which is sorted by place.
    groups = np.unique(((np.arange(_ASKED) + 0.5) / _ASKED * len(count)).astype(np.int64))
    links = links_to(scenery, receivers, groups, detail)
    held = _NODE * len(links.group) + _WEIGHT * int(count[links.group].sum())
    # In thickets each ray may meet something else.
    within = count[groups[links.thick]]
    held += rays_of(detail) * int((within * (_NODE + _WEIGHT * within)).sum())
    return round(held * count.sum() / count[groups].sum())


def refuse_beyond_memory(needed: float, held: float = 0) -> None:
    """Refuse links that will not fit.

    Parameters
    ----------
    needed : float
        What all links will take [bytes].
    held : float
        What those that are there already take of it [bytes].

    Raises
    ------
    RadiosityError
        With both figures, and the ways out.
    """
    free = available_memory()
    if needed - held > free:
        raise RadiosityError(
            f"The links need {needed / 2**30:.1f} GiB of memory, and {(held + free) / 2**30:.1f} GiB are "
            "free: take a lower quality, or larger patches"
        )


def refuse_too_many(patches: int) -> None:
    """Refuse what will not fit however few links it gets.

    Parameters
    ----------
    patches : int
        How many there are, or at least will be.

    Raises
    ------
    RadiosityError
        With both figures, and the ways out.
    """
    needed, free = _PATCH * patches, available_memory()
    if needed > free:
        raise RadiosityError(
            f"To light {patches:,} patches takes {needed / 2**30:.1f} GiB of memory at least, and {free / 2**30:.1f} "
            "GiB are free: leave out or simplify what has most faces, as grass and leaves have, or take larger patches"
        )
