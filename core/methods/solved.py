# SPDX-License-Identifier: GPL-3.0-or-later
"""What every method hands back."""

from dataclasses import dataclass

from ..arrays import FloatArray
from ..report import Energy
from ..solution import Solution
from ..translucence import LightBehind


@dataclass(frozen=True, eq=False)
class Solved:
    """What a method hands back.

    Attributes
    ----------
    solution : Solution
        On the n patches.
    corner_irradiance, corner_direct : ndarray of shape (c, 3)
        What arrives at the scene's c corners, and the part of it that is direct light [W/m^2].
    row_sums : ndarray of shape (n,)
        Share of each patch's light that meets a patch, as the form factors say; NaN where not known.
    energy : Energy
    reciprocity : float or None
        How far the form factors are from A_i F_ij = A_j F_ji, relative to their sum; None where not known.
    links, rays : int
        Pairs that exchange light, and segments tested for visibility.
    seconds : dict
        Time of each stage: form_factors, solve, shade, and what they are made of.
    behind : LightBehind or None
        What arrives on the other side at corners of translucent faces; None where there are none.
    """

    solution: Solution
    corner_irradiance: FloatArray
    corner_direct: FloatArray
    row_sums: FloatArray
    energy: Energy
    reciprocity: float | None
    links: int
    rays: int
    seconds: dict[str, float]
    behind: LightBehind | None = None
