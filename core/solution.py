# SPDX-License-Identifier: GPL-3.0-or-later
"""What every solver returns."""

from dataclasses import dataclass

from .arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Solution:
    """Light on every patch.

    Attributes
    ----------
    radiosity : ndarray of shape (n, 3)
        Radiant exitance B of each of n patches, emitted and reflected [W/m^2].
    irradiance : ndarray of shape (n, 3)
        What arrives at each patch, H [W/m^2]: B = E + rho H (T1).
    iterations : int
        Sweeps (gathering) or shots (shooting) that were made.
    converged : bool
        Whether the tolerance was met before the iterations ran out.
    residual : float
        Gathering: largest relative change of radiosity in the last sweep. Shooting: unshot over emitted energy.
    direct : ndarray of shape (n, 3) or None
        The part of the irradiance that comes straight from what emits [W/m^2], where the solver was asked for it.
    """

    radiosity: FloatArray
    irradiance: FloatArray
    iterations: int
    converged: bool
    residual: float
    direct: FloatArray | None = None
