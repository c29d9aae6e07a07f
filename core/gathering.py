# SPDX-License-Identifier: GPL-3.0-or-later
"""The gathering solver (T5): every patch collects the light of all others, again and again, until nothing changes.

B = E + rho H with H = F B (T1), and what comes through from the other side. It starts with B = E, so that the first
sweep is direct light only (T6).
A sweep is either Jacobi's, all patches from the light of the sweep before, or in place (Gauss-Seidel): patches use
what the patches before them have just become. In place is done by blocks of rows, so that each step is one product of
matrices; within a block it is Jacobi's, which costs little of the faster convergence. The first sweep is Jacobi's
anyway, or else it would not be direct light.
Where bounces need not be told apart, Jacobi's sweeps are accelerated: they then end sooner, with the same light.
"""

from collections.abc import Generator

import numpy as np

from .acceleration import Mixture
from .arrays import FloatArray
from .progress import Progress
from .solution import Solution
from .translucence import Translucence, scattered
from .transport import DenseTransport, Transport

# Blocks of an in-place sweep.
BLOCKS = 16
STAGE = "Gathering light"


def gathering(
    transport: Transport,
    emission: FloatArray,
    reflectance: FloatArray,
    *,
    iterations: int = 200,
    tolerance: float = 1e-4,
    sweep: str = "in-place",
    start: FloatArray | None = None,
    through: Translucence | None = None,
) -> Generator[Progress, None, Solution]:
    """Solve for the light on n patches by gathering.

    Parameters
    ----------
    transport : Transport
        Who lights whom.
    emission : ndarray of shape (n, 3)
        E [W/m^2].
    reflectance : ndarray of shape (n, 3)
        rho.
    iterations : int
        Sweeps at most.
    tolerance : float
        The sweep that changes no radiosity by more than this, relative to it, is the last.
    sweep : {"in-place", "jacobi", "accelerated"}
        In place needs rows: a transport that is not dense is swept by Jacobi's. Only those tell bounces apart.
    start : ndarray of shape (n, 3), optional
        Radiosity to begin with, such as a solution under other light; E when not given [W/m^2].
    through : Translucence, optional
        Which patches have light from their other side.

    Yields
    ------
    Progress
        After every sweep; `unshot` is the energy that the sweep changed, over what is emitted.

    Returns
    -------
    Solution
    """
    in_place = sweep == "in-place" and isinstance(transport, DenseTransport)
    area = transport.area[:, None]
    emitted = float((area * emission).sum())
    B, H = (emission if start is None else start).copy(), np.zeros_like(emission)
    mixture = Mixture(transport.area) if sweep == "accelerated" else None
    residual, iteration, begin = np.inf, 0, B
    while iteration < iterations and residual > tolerance:
        iteration += 1
        before = begin
        if in_place and iteration > 1 and isinstance(transport, DenseTransport):
            B = B.copy()
            _sweep_in_place(transport, emission, reflectance, through, B, H)
        else:
            H = transport.gather(before)
            B = emission + scattered(reflectance, H, through)
        begin = mixture.next(before, B) if mixture else B
        change = np.abs(B - before)
        residual = float(np.divide(change, B, out=np.zeros_like(B), where=B > 0.0).max(initial=0.0))
        unshot = float((area * change).sum()) / emitted if emitted else 0.0
        done = max(iteration / iterations, _closeness(residual, tolerance))
        yield Progress(STAGE, done, iteration, residual, unshot, B)
    return Solution(B, H, iteration, residual <= tolerance, residual)


def _sweep_in_place(
    transport: DenseTransport,
    emission: FloatArray,
    reflectance: FloatArray,
    through: Translucence | None,
    B: FloatArray,
    H: FloatArray,
) -> None:
    """Update B and H block by block, each from the newest B."""
    step = max(1, -(-len(B) // BLOCKS))
    for first in range(0, len(B), step):
        rows = slice(first, first + step)
        H[rows] = transport.gather_rows(rows, B)
        B[rows] = emission[rows] + reflectance[rows] * H[rows]
        if through is not None:
            B[rows] += through.leaving(H)[rows]


def _closeness(residual: float, tolerance: float) -> float:
    """Return how far a residual that shrinks by a factor a sweep has come on its way to the tolerance, 0 to 1."""
    if residual <= tolerance:
        return 1.0
    return float(np.clip(np.log(residual) / np.log(tolerance), 0.0, 1.0)) if tolerance > 0.0 else 0.0
