# SPDX-License-Identifier: GPL-3.0-or-later
"""From scene-referred radiance to what a screen can show: exposure in stops, then [0, 1] (T10)."""

import numpy as np

from .arrays import BoolArray, FloatArray

# Relative luminance of linear Rec. 709 primaries, Blender's own.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# The automatic exposure shows this percentile of what is lit as this luminance.
PERCENTILE, SHOWN_AS = 95.0, 0.9
# A lamp with many corners may fill that percentile: never darken the median below this share of what is shown.
MEDIAN_SHARE = 1.0 / 16.0


def expose(radiance: FloatArray, stops: float = 0.0) -> FloatArray:
    """Return colours that a screen can show.

    Parameters
    ----------
    radiance : ndarray of shape (..., 3)
        Linear, scene-referred [W/(m^2 sr)].
    stops : float
        Exposure; one more doubles the brightness.

    Returns
    -------
    ndarray of shape (..., 3)
        Linear, in [0, 1]: too bright is 1, negative is 0, not a number is 0; nothing wraps.
    """
    return np.minimum(scaled(radiance, stops), 1.0)


def scaled(radiance: FloatArray, stops: float = 0.0) -> FloatArray:
    """Return exposed light that may still be brighter than a screen can show.

    Parameters
    ----------
    radiance : ndarray of shape (..., 3)
        Linear, scene-referred [W/(m^2 sr)].
    stops : float
        Exposure; one more doubles the brightness.

    Returns
    -------
    ndarray of shape (..., 3)
        Linear, not below 0: negative is 0, not a number is 0; at most what single precision holds.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        exposed = np.asarray(radiance, dtype=np.float64) * np.exp2(np.float64(stops))
    return np.clip(np.where(np.isnan(exposed), 0.0, exposed), 0.0, np.finfo(np.float32).max)


def automatic_exposure(radiance: FloatArray, emitting: BoolArray | None = None) -> float:
    """Return an exposure that shows nearly all of what is lit below white.

    Parameters
    ----------
    radiance : ndarray of shape (n, 3)
        Linear, scene-referred [W/(m^2 sr)].
    emitting : ndarray of shape (n,), optional
        Which of them are lamps themselves; these do not count, unless there is nothing else.

    Returns
    -------
    float
        Stops for `expose`; 0 when nothing is lit.
    """
    luminance = np.asarray(radiance, dtype=np.float64) @ LUMINANCE
    lit = np.isfinite(luminance) & (luminance > 0.0)
    if emitting is not None and (lit & ~emitting).any():
        lit &= ~emitting
    if not lit.any():
        return 0.0
    middle, high = np.percentile(luminance[lit], (50.0, PERCENTILE))
    return float(np.log2(SHOWN_AS / min(high, middle / MEDIAN_SHARE)))
