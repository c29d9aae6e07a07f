# SPDX-License-Identifier: GPL-3.0-or-later
"""Elements: the pieces of patches that are each given one radiosity, finer where light changes within a patch.

A lamp that hangs a finger's width under a ceiling lights it brightly, but only where the lamp itself hides it. One
value for a patch half behind the lamp would shine into the room what never leaves the gap. So patches are split, and
split again, until the light that direct illumination could misplace within an element is a negligible share of all
light (two-level hierarchy of patches and elements: Cohen, Greenberg, Immel, Brock 1986).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..lighting.kinds import Lamp
from ..meshing import Patches
from ..occlusion.core_part import core_part
from ..translucence import piece_translucence
from ..visibility import Occluders
from .overhangs import hung_over, shown_middles, stood_on
from .pieces import centres, flat_measures, quarters
from .tree import Float, Int
from .unblocked import Unblocked, unblocked_light

_DEEPEST = 6
# Splits where something stands on a patch.
_CONTACT_DEPTH = 2
# ... and how large it has to be for that, as a share of the largest element's area: blades of grass stand on nothing.
_CONTACT = 1 / 256
# Elements with less than this share of the largest one's area are fine enough, whatever hangs over them.
_WORTH_HALVING = 0.25
# No more elements than this many times the patches, whatever the lamps; but so many may always be.
_MOST, _FEW = 4, 4000
# So many pieces, in shares of the patches, are kept for where light straight from lamps changes, however large the
# other elements are: half a patch under a lamp that hangs close to it would shine into the room with all that it gets.
_FOR_LAMPS = 0.25


@dataclass(frozen=True, eq=False)
class Elements:
    """Pieces of patches.

    Attributes
    ----------
    corners : ndarray of shape (n, 4, 3)
        Counter-clockwise seen from the radiating side; a triangle repeats its last corner [m].
    centre, normal : ndarray of shape (n, 3)
        In the middle, or of what shows where something hangs right over an end [m]; unit length.
    area : ndarray of shape (n,)
        Of what is solid [m^2].
    patch : ndarray of shape (n,)
        The patch that each is a piece of.
    reflectance, emission : ndarray of shape (n, 3)
        Means over the element: rho, and exitance E [W/m^2].
    solid : ndarray of shape (n,)
        Share of what the corners enclose that is solid: less than 1 for screens.
    """

    corners: Float
    centre: Float
    normal: Float
    area: Float
    patch: Int
    reflectance: Float
    emission: Float
    solid: Float

    def pick(self, index: Int) -> "Elements":
        """Return some of the elements."""
        return Elements(*(getattr(self, field.name)[index] for field in fields(self)))

    def __len__(self) -> int:
        return len(self.area)


def split_patches(
    patches: Patches, occluders: Occluders, *, tolerance: float, size: float, lamps: Sequence[Lamp] = ()
) -> Elements:
    """Split patches that are large, where direct light changes within them, and where other surfaces stand on them.

    Parameters
    ----------
    patches : Patches
    occluders : Occluders
    tolerance : float
        Power that a single element may misplace, as a share of all emitted power.
    size : float
        Side of the largest square element, as a share of the diagonal of the scene's core, and of the way to it.
    lamps : sequence of Lamp, optional
        That shine beside what emits.

    Returns
    -------
    Elements
        In the order of the patches.
    """
    patch = np.arange(len(patches.area))
    shining = unblocked_light(patches, lamps, tolerance)
    done = []
    corners, room, apart = patches.corners, max(_MOST * len(patch), _FEW), _FEW
    kept = max(int(_FOR_LAMPS * len(patch)), _FEW)
    # Of what arrives at one side of a sheet, what leaves on the other counts as well.
    passed_on = (patches.reflectance + patches.transmittance).mean(axis=1)
    core = core_part(corners.min(axis=1), corners.max(axis=1))
    for depth in range(_DEEPEST + 1):
        area = patches.area[patch] / 4**depth
        # What is far away may be as much larger.
        extent = area / (size * core.size * (1.0 + core.away(corners))) ** 2
        deeper, urgency, misplaced = _DEEPEST - depth, extent.copy(), np.zeros(len(patch))
        if len(patch) and shining.power > 0:
            misplaced = 3 * passed_on[patch] * _spread(corners, shining) * area / (tolerance * shining.power)
            urgency = np.maximum(urgency, misplaced)
        if len(patch) and depth < _CONTACT_DEPTH:
            large = np.flatnonzero(extent > _CONTACT)
            stood = large[stood_on(corners[large], occluders)]
            urgency[stood] = np.maximum(urgency[stood], extent[stood] / _CONTACT)
        large = np.flatnonzero((extent > _WORTH_HALVING) & (urgency <= 1))
        hung = large[hung_over(corners[large], occluders)]
        urgency[hung] = 1.0 + extent[hung]
        coarse = (urgency > 1) & (depth < _DEEPEST)
        both = piece_translucence(corners, patch, patches)
        if both is None:
            wanted = coarse.copy()
            room = _afforded(coarse, np.arange(len(patch)), urgency, extent, deeper, room)
            more = _most_urgent(np.where(wanted & ~coarse, misplaced, 0.0), kept // (8 if deeper > 1 else 4))
            coarse, kept = coarse | more, kept - 4 * int(more.sum())
        else:
            # What shines through is cut alike on both sides, and finely however many other patches there are.
            coarse[both.piece] |= coarse[both.other]
            room = _afforded(coarse, np.flatnonzero(patches.opposite[patch] < 0), urgency, extent, deeper, room)
            apart = _afforded(coarse, both.piece, urgency, extent, deeper, apart)
            coarse[both.piece] &= coarse[both.other]
        # What had to stay whole may be split when all is done.
        waiting = np.where((patches.opposite[patch] < 0) & (depth < _DEEPEST), urgency, 0.0)
        done.append((corners[~coarse], patch[~coarse], waiting[~coarse]))
        corners, patch = quarters(corners[coarse]), np.repeat(patch[coarse], 4)
    corners, patch, waiting = (np.concatenate(parts) for parts in zip(*done, strict=True))
    late = _most_urgent(waiting, room // 4)
    corners = np.concatenate((corners[~late], quarters(corners[late])))
    patch = np.concatenate((patch[~late], np.repeat(patch[late], 4)))
    order = np.argsort(patch, kind="stable")
    return _measured(corners[order], patch[order], patches, occluders)


def _afforded(coarse: NDArray[np.bool_], which: Int, urgency: Float, extent: Float, deeper: int, room: int) -> int:
    """Of some pieces that are to be split leave those that there is room for; return what room is left.

    A thousand small pieces must not leave a large one whole: first there is room for all the splits, down to `deeper`
    levels, of pieces that are too large, the largest first. What is left goes to the most urgent of the others, and
    where it does not suffice half of it is kept back for their parts.
    """
    wanted = which[coarse[which]]
    owed = _splits(extent[wanted], deeper)
    if owed.sum() + 4 * np.count_nonzero(owed == 0) > room:
        least = 1.0
        while owed.sum() > room:
            least *= 2
            owed = _splits(extent[wanted] / least, deeper)
        spare = (room - int(owed.sum())) // (2 if deeper > 1 else 1)
        rest = wanted[owed == 0]
        coarse[rest[np.argsort(-urgency[rest], kind="stable")[spare // 4 :]]] = False
    return room - 4 * int(coarse[which].sum())


def _most_urgent(urgency: Float, most: int) -> NDArray[np.bool_]:
    """Return which pieces are to be split, the most urgent of those that are to be."""
    chosen = np.zeros(len(urgency), bool)
    chosen[np.argsort(-urgency, kind="stable")[:most]] = True
    return chosen & (urgency > 1)


def _splits(extent: Float, deeper: int) -> Int:
    """Return how many pieces come about, at all levels, until none is larger than one, shape (n,)."""
    halvings = np.ceil(0.5 * np.log2(np.clip(extent, 1.0, 1e12))).clip(max=deeper).astype(np.int64)
    return np.asarray(4 * (4**halvings - 1) // 3)


def _spread(corners: Float, shining: Unblocked) -> Float:
    """Return how far the unblocked direct light of an element's quarters lies from their mean [W/m^2]."""
    # Quarters and the whole: a lamp may hang right below the middle.
    parts = np.concatenate((quarters(corners).reshape(-1, 4, 4, 3).transpose(1, 0, 2, 3), corners[None]))
    normal, area = flat_measures(parts.reshape(-1, 4, 3))
    point = centres(parts.reshape(-1, 4, 3)).reshape(5, -1, 3)
    five = shining.irradiance(point, normal.reshape(5, -1, 3), np.sqrt(area.reshape(5, -1)[4]))
    spread: Float = np.abs(five - five.mean(axis=0)).mean(axis=0)
    return spread


def _measured(corners: Float, patch: Int, patches: Patches, occluders: Occluders) -> Elements:
    """Return elements with their measures; one that is a whole patch keeps the patch's own."""
    normal, area = flat_measures(corners)
    whole = np.bincount(patch, minlength=len(patches.area))[patch] == 1
    area[whole], normal[whole] = patches.area[patch[whole]], patches.normal[patch[whole]]
    solid = patches.solid[patch]
    area[~whole] *= solid[~whole]
    surface = patches.surface(corners, patch)
    return Elements(corners, shown_middles(corners, occluders), normal, area, patch, *surface, solid)
