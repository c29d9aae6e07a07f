# SPDX-License-Identifier: GPL-3.0-or-later
"""Who lights whom, as the solvers see it, and the whole matrix of form factors F (T13) once it is there.

F_ij is the share of the light from i that reaches j, and by reciprocity (A_i F_ij = A_j F_ji) what i receives from j:
H = F B. The factors from a patch should add up to 1 in a closed room; their errors may make it a little more. What is
above `MOST_SENT` is taken out, so that light always dies away and the solvers always converge.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .arrays import FloatArray, SingleArray

# Rows and columns of the squares that the matrix is compared with its transpose by.
TILE = 1024
# Share of its light that a patch may send out: times the highest reflectance, 0.99, that is still below 1.
MOST_SENT = 1.01


class Transport(Protocol):
    """What a solver asks."""

    @property
    def area(self) -> FloatArray:
        """Areas of the n patches, shape (n,) [m^2]."""
        ...

    def gather(self, radiosity: FloatArray) -> FloatArray:
        """Return the irradiance H = F B, shape (n, k), for radiosities B of shape (n, k) [W/m^2]."""
        ...

    def column(self, j: int) -> FloatArray:
        """Return F_ij of all patches i for one j, shape (n,)."""
        ...

    def row_sums(self) -> FloatArray:
        """Return for each patch the share of its light that meets a patch, shape (n,); NaN where not known."""
        ...


@dataclass(frozen=True, eq=False)
class DenseTransport:
    """The whole matrix of form factors (T13), in single precision.

    Attributes
    ----------
    matrix : ndarray of shape (n, n), float32
        F.
    area : ndarray of shape (n,)
        [m^2].
    sums : ndarray of shape (n,)
        Share of each patch's light that meets a patch, as computed; what exceeds `MOST_SENT` has been taken out of
        `matrix`.
    links : int
        Factors above zero.
    rays : int
        Segments that were tested for visibility.
    """

    matrix: SingleArray
    area: FloatArray
    sums: FloatArray
    links: int
    rays: int

    def gather(self, radiosity: FloatArray) -> FloatArray:
        """Return the irradiance H = F B of all patches; see `Transport`."""
        return self.gather_rows(slice(None), radiosity)

    def gather_rows(self, rows: slice, radiosity: FloatArray) -> FloatArray:
        """Return the irradiance of some patches only."""
        # Scaled to 1, so that the light of any scene fits into single precision.
        scale = float(np.abs(radiosity).max(initial=0.0)) or 1.0
        gathered = self.matrix[rows] @ (radiosity / scale).astype(np.float32)
        return gathered.astype(np.float64) * scale

    def column(self, j: int) -> FloatArray:
        """Return F_ij of all patches i."""
        return self.matrix[:, j].astype(np.float64)

    def row_sums(self) -> FloatArray:
        """Return for each patch the share of its light that meets a patch."""
        return self.sums


def reciprocity_error(transport: DenseTransport) -> float:
    """Return the mean difference of A_i F_ij and A_j F_ji over their mean.

    Parameters
    ----------
    transport : DenseTransport

    Returns
    -------
    float
        0 for factors that are reciprocal, at most 2.
    """
    F, A = transport.matrix, transport.area.astype(np.float32)
    difference = total = 0.0
    for first in range(0, len(A), TILE):
        for second in range(first, len(A), TILE):
            i, j = slice(first, first + TILE), slice(second, second + TILE)
            there, back = A[i, None] * F[i, j], (A[j, None] * F[j, i]).T
            # A square off the diagonal stands for its mirror image too.
            count = 1.0 if first == second else 2.0
            difference += count * float(np.abs(there - back).sum(dtype=np.float64))
            total += count * float((there + back).sum(dtype=np.float64))
    return 2.0 * difference / total if total else 0.0


def inverse(area: FloatArray) -> FloatArray:
    """Return 1 / A, and 0 for patches without area, which send and receive nothing."""
    return np.divide(1.0, area, out=np.zeros_like(area), where=area > 0.0)


def limited(sums: FloatArray) -> FloatArray:
    """Return what to multiply columns with, so that no patch sends out more than `MOST_SENT`."""
    return np.asarray(1.0 / np.maximum(sums / MOST_SENT, 1.0))
