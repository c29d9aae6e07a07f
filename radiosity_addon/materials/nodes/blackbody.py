# SPDX-License-Identifier: GPL-3.0-or-later
"""The color of what glows, as Cycles approximates it: curves fitted to Planck's law in Rec. 709, piece by piece."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Where the pieces begin [K].
_PIECES = np.array([965.0, 1167.0, 1449.0, 1902.0, 3315.0, 6365.0])
# a / T + b T + c
_RED = np.array(
    [
        [1.61919106e03, -2.05010916e-03, 5.02995757e00],
        [2.48845471e03, -1.11330907e-03, 3.22621544e00],
        [3.34143193e03, -4.86551192e-04, 1.76486769e00],
        [4.09461742e03, -1.27446582e-04, 7.25731635e-01],
        [4.67028036e03, 2.91258199e-05, 1.26703442e-01],
        [4.59509185e03, 2.87495649e-05, 1.50345020e-01],
        [3.78717450e03, 9.35907826e-06, 3.99075871e-01],
    ]
)
_GREEN = np.array(
    [
        [-4.88999748e02, 6.04330754e-04, -7.55807526e-02],
        [-7.55994277e02, 3.16730098e-04, 4.78306139e-01],
        [-1.02363977e03, 1.20223470e-04, 9.36662319e-01],
        [-1.26571316e03, 4.87340896e-06, 1.27054498e00],
        [-1.42529332e03, -4.01150431e-05, 1.43972784e00],
        [-1.17554822e03, -2.16378048e-05, 1.30408023e00],
        [-5.00799571e02, -4.59832026e-06, 1.09098763e00],
    ]
)
# ((a T + b) T + c) T + d
_BLUE = np.array(
    [
        [5.96945309e-11, -4.85742887e-08, -9.70622247e-05, -4.07936148e-03],
        [2.40430366e-11, 5.55021075e-08, -1.98503712e-04, 2.89312858e-02],
        [-1.40949732e-11, 1.89878968e-07, -3.56632824e-04, 9.10767778e-02],
        [-3.61460868e-11, 2.84822009e-07, -4.93211319e-04, 1.56723440e-01],
        [-1.97075738e-11, 1.75359352e-07, -2.50542825e-04, -2.22783266e-02],
        [-1.61997957e-13, -1.64216008e-08, 3.86216271e-04, -7.38077418e-01],
        [6.72650283e-13, -2.73078809e-08, 4.24098264e-04, -7.52335691e-01],
    ]
)
_COLDEST, _HOTTEST = 800.0, 12000.0
_COLD, _HOT = np.array([5.41329449, -0.20319390, -0.08225352]), np.array([0.82629548, 0.99450805, 1.56630771])


def blackbody(temperature: Array) -> Array:
    """Return the color of a temperature, of luminance 1.

    Parameters
    ----------
    temperature : ndarray of shape (..., 1)
        [K].

    Returns
    -------
    ndarray of shape (..., 3)
        Not below 0.
    """
    T = temperature[..., 0].clip(_COLDEST, _HOTTEST)
    piece = np.searchsorted(_PIECES, T, side="right")
    red, green = (table[piece] for table in (_RED, _GREEN))
    blue = _BLUE[piece]
    color = np.stack(
        [
            red[..., 0] / T + red[..., 1] * T + red[..., 2],
            green[..., 0] / T + green[..., 1] * T + green[..., 2],
            ((blue[..., 0] * T + blue[..., 1]) * T + blue[..., 2]) * T + blue[..., 3],
        ],
        axis=-1,
    )
    color = np.where(temperature < _COLDEST, _COLD, np.where(temperature >= _HOTTEST, _HOT, color))
    return np.maximum(color, 0.0)
