# SPDX-License-Identifier: GPL-3.0-or-later
"""Which faces block where materials let a part of the light through.

All light is dimmed by what does not block, but who that is costs time to find: where there are very many such faces, as
of leaves, each of them blocks wholly or not at all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..sequences import GOLDEN

if TYPE_CHECKING:
    from ..scene import Scene

# What lets less light through blocks.
_DENSE = 0.05
# Shares of light between which very many faces take turns; below all of them block, above none does.
TURNS = (0.2, 0.8)
_MANY = 512
# Reflectance of what lets light through that is not worth following.
_FAINT = 0.1


def blocking(passed: FloatArray) -> BoolArray:
    """Choose the faces that block, of very many as large a share as of the light.

    Parameters
    ----------
    passed : ndarray of shape (f,)
        Share of light that goes on behind each face, 0 to 1.

    Returns
    -------
    ndarray of shape (f,)
    """
    partly = np.flatnonzero((passed > TURNS[0]) & (passed < TURNS[1]))
    if len(partly) < _MANY:
        return passed < _DENSE
    blocks = passed < 0.5
    # Every stretch of faces is filled evenly.
    blocks[partly] = passed[partly] <= (GOLDEN * np.arange(len(partly))) % 1.0
    return blocks


def tints(passed: FloatArray, blocks: BoolArray) -> FloatArray:
    """Return what light takes on that goes through faces.

    Parameters
    ----------
    passed : ndarray of shape (f, 3)
        Share of light that goes on behind each face, 0 to 1.
    blocks : ndarray of shape (f,)
        From `blocking` of the means of that.

    Returns
    -------
    ndarray of shape (f, 3)
        1 where a face blocks. Where faces take turns, what is lost is lost already: only the hue is left.
    """
    mean = passed.mean(axis=1)
    partly = (mean > TURNS[0]) & (mean < TURNS[1])
    lost = np.where(partly & (np.count_nonzero(partly) >= _MANY), np.maximum(mean, 1e-9), 1.0)
    return np.where(blocks[:, None], 1.0, passed / lost[:, None])


def unnoticed(scene: Scene) -> BoolArray:
    """Return the faces that light does not meet, shape (f,): they block nothing, emit nothing and hardly reflect.

    What is seen through them fills their place; counted beside it, there would be more around than there is.
    """
    bright = (scene.reflectance + scene.transmittance).max(axis=1, initial=0.0)
    dark = ~scene.reflects | (bright <= _FAINT)
    dark &= ~(scene.emits & scene.emission.any(axis=1))
    clear: BoolArray = dark & ~scene.occludes & ~scene.shades
    # Where there is nothing else, there is something to look at.
    return clear & ~clear.all(where=scene.live)
