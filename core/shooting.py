# SPDX-License-Identifier: GPL-3.0-or-later
"""The shooting solver (T8): the patch with the most unshot energy lights all others, again and again.

Each shot needs one column of form factors only, so that memory grows with the number of patches, not its square, and
the light can be shown after every shot. What is shown early on is lifted by an estimate of the light that is still on
its way; it vanishes as that is shot, and never enters the solution.

References
----------
M. F. Cohen, S. E. Chen, J. R. Wallace, D. P. Greenberg, A progressive refinement approach to fast radiosity image
generation, SIGGRAPH 1988.
"""

from collections.abc import Generator

import numpy as np

from .arrays import FloatArray
from .progress import Progress
from .solution import Solution
from .translucence import Translucence, scattered
from .transport import Transport

STAGE = "Shooting light"


def shooting(
    transport: Transport,
    emission: FloatArray,
    reflectance: FloatArray,
    *,
    iterations: int,
    tolerance: float,
    own: FloatArray | None = None,
    through: Translucence | None = None,
) -> Generator[Progress, None, Solution]:
    """Solve for the light on n patches by shooting.

    Parameters
    ----------
    transport : Transport
        Who lights whom; asked for one column a shot.
    emission : ndarray of shape (n, 3)
        E [W/m^2].
    reflectance : ndarray of shape (n, 3)
        rho.
    iterations : int
        Shots at most.
    tolerance : float
        The shooting ends when the unshot energy is not more than this share of the emitted.
    own : ndarray of shape (n, 3), optional
        The part of E that is direct light where it arrives, and not light of lamps reflected [W/m^2]; all of it when
        not given.
    through : Translucence, optional
        Which patches have light from their other side.

    Yields
    ------
    Progress
        After every shot; its radiosity has the ambient estimate added.

    Returns
    -------
    Solution
    """
    area = transport.area
    emitted = float((area[:, None] * emission).sum())
    amplified = _ambient_factor(area, reflectance)
    B, unshot, H = emission.copy(), emission.copy(), np.zeros_like(emission)
    own, direct = (emission if own is None else own).copy(), np.zeros_like(emission)
    left, shots = 1.0 if emitted else 0.0, 0
    while shots < iterations and left > tolerance:
        shots += 1
        j = int(np.argmax(area * unshot.sum(axis=1)))
        column = transport.column(j)[:, None]
        arriving = column * unshot[j]
        if own[j].any():
            direct += column * own[j]
            own[j] = 0.0
        unshot[j] = 0.0
        reflected = scattered(reflectance, arriving, through)
        H += arriving
        B += reflected
        unshot += reflected
        on_its_way = area @ unshot
        left = float(on_its_way.sum()) / emitted
        shown = B + reflectance * (on_its_way * amplified)
        done = max(shots / iterations, float(np.log(max(left, 1e-30)) / np.log(max(tolerance, 1e-30))))
        yield Progress(STAGE, min(max(done, 0.0), 1.0), shots, unshot=left, radiosity=shown)
    return Solution(B, H, shots, left <= tolerance, left, direct)


def _ambient_factor(area: FloatArray, reflectance: FloatArray) -> FloatArray:
    """Return the ambient irradiance for each watt unshot, shape (3,) [1/m^2]: spread evenly, reflected for ever."""
    total = float(area.sum())
    mean = area @ reflectance / total if total else np.zeros(3)
    return np.asarray(1.0 / (1.0 - mean) / (total or 1.0))
