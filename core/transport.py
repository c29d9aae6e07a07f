# SPDX-License-Identifier: GPL-3.0-or-later
"""Who lights whom, as the solvers see it, and the whole matrix of form factors F (T13).

F_ij is the share of the light from i that reaches j, and by reciprocity (A_i F_ij = A_j F_ji) what i receives from j:
H = F B. The factors from a patch should add up to 1 in a closed room; their errors may make it a little more. What is
above `MOST_SENT` is taken out, so that light always dies away and the solvers always converge.
"""

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Protocol, TypeVar

import numpy as np

from .arrays import FloatArray, IntArray, SingleArray
from .dense.blocks import block
from .dense.exchange import Exchange, exchange
from .dense.hemicube_rows import Views, hemicube_rows, hemicube_views
from .dense.shafts import GROUP_SIZE
from .errors import RadiosityError
from .memory import available_memory
from .meshing import Patches
from .occlusion.surfaces import Occluding
from .progress import Progress
from .visibility import Occluders

S = TypeVar("S")
R = TypeVar("R")
# Patches j and A_i F_ij to each, then the number of segments tested for visibility.
Strip = tuple[list[tuple[IntArray, SingleArray]], int]

STAGE = "Form factors"
# Temporaries of one block of the exchange, for each of the threads [bytes].
BLOCK_BYTES = 48 * 2**20
# Rows and columns of the squares that the matrix is compared with its transpose by.
TILE = 1024
# Rows of hemicubes computed at a time.
HEMICUBES = 32
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


def dense_transport(
    patches: Patches,
    occluders: Occluders | None,
    *,
    kernel: str = "exact",
    surfaces: Occluding | None = None,
    executor: Executor | None = None,
) -> Generator[Progress, None, DenseTransport]:
    """Compute the whole matrix of form factors, in parallel (T15).

    Parameters
    ----------
    patches : Patches
    occluders : Occluders or None
        Who casts rays; None when nothing blocks.
    kernel : {"exact", "centre", "hemicube"}
        T3, T2 or T4.
    surfaces : Occluding, optional
        The surfaces that block; where given, most rays are saved.
    executor : concurrent.futures.Executor, optional
        Who computes; a thread for each processor when not given. The result does not depend on it, bit for bit.

    Yields
    ------
    Progress
        After every group of rows.

    Returns
    -------
    DenseTransport

    Raises
    ------
    RadiosityError
        When the matrix would not fit into memory; before anything is computed.
    """
    _check_memory(len(patches.area))
    yield Progress(STAGE, 0.0)
    with ExitStack() as stack:
        workers = executor or stack.enter_context(ThreadPoolExecutor(os.cpu_count()))
        if kernel == "hemicube":
            return (yield from _by_hemicubes(hemicube_views(patches), workers))
        return (yield from _by_blocks(exchange(patches, occluders, surfaces, exact=kernel == "exact"), workers))


def _by_blocks(x: Exchange, workers: Executor) -> Generator[Progress, None, DenseTransport]:
    """Fill the matrix with blocks and their mirror images."""
    n = len(x.patches.area)
    matrix, sums = np.zeros((n, n), dtype=np.float32), np.zeros(n)
    over_area = inverse(x.patches.area)
    done = links = rays = 0
    strips = _in_order(workers, partial(_strip, x), range(len(x.groups)))
    for i, (strip, segments) in zip(x.groups, strips, strict=True):
        rays += segments
        for j, between in strip:
            links += int(np.count_nonzero(between)) * (1 if j[0] == i[0] else 2)
            matrix[np.ix_(i, j)] = between * over_area[i][:, None]
            sums[i] += between.sum(axis=1, dtype=np.float64)
            if j[0] != i[0]:
                matrix[np.ix_(j, i)] = (between * over_area[j]).T
                sums[j] += between.sum(axis=0, dtype=np.float64)
        # The first strips meet all other groups, the last only themselves.
        done += len(i)
        yield Progress(STAGE, 1.0 - (1.0 - done / n) ** 2)
    sums *= over_area
    if np.any(sums > MOST_SENT):
        matrix *= limited(sums).astype(np.float32)
    return DenseTransport(matrix, x.patches.area, sums, links, rays)


def _by_hemicubes(views: Views, workers: Executor) -> Generator[Progress, None, DenseTransport]:
    """Fill the matrix row by row."""
    n = len(views.patches.area)
    matrix = np.zeros((n, n), dtype=np.float32)
    groups = [np.arange(first, min(first + HEMICUBES, n)) for first in range(0, n, HEMICUBES)]
    links = 0
    for members, rows in zip(groups, _in_order(workers, partial(hemicube_rows, views), groups), strict=True):
        matrix[members] = rows
        links += int(np.count_nonzero(rows))
        yield Progress(STAGE, (int(members[-1]) + 1) / n)
    sums = matrix.sum(axis=1, dtype=np.float64)
    return DenseTransport(matrix, views.patches.area, sums, links, n * len(views.hemicube.deltas))


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


def _in_order(workers: Executor, compute: Callable[[S], R], items: Iterable[S]) -> Iterator[R]:
    """Compute something of every item, a few at a time ahead, and yield the results in order."""
    ahead: deque[Future[R]] = deque()
    most = 2 * (os.cpu_count() or 1)
    try:
        for item in items:
            ahead.append(workers.submit(compute, item))
            if len(ahead) > most:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()
    finally:
        # Closed early: what has not begun need not be done.
        for future in ahead:
            future.cancel()


def _strip(x: Exchange, first: int) -> Strip:
    """Return A F between one group and all from it on, without the blocks that are zero, and the segments tested."""
    blocks, rays = [], 0
    for j in x.groups[first:]:
        between, segments = block(x, x.groups[first], j)
        rays += segments
        if between is not None:
            blocks.append((j, between.astype(np.float32)))
    return blocks, rays


def _check_memory(n: int) -> None:
    """Refuse a matrix that does not fit into what is free."""
    threads = os.cpu_count() or 1
    needed = 4 * n * n + threads * (BLOCK_BYTES + 3 * 4 * GROUP_SIZE * n)
    free = available_memory()
    if needed > free:
        raise RadiosityError(
            f"The form factors of {n:,} patches need {needed / 2**30:.1f} GiB of memory and {free / 2**30:.1f} GiB are "
            "free: take the method 'hierarchical' or 'shooting', or larger patches"
        )


def inverse(area: FloatArray) -> FloatArray:
    """Return 1 / A, and 0 for patches without area, which send and receive nothing."""
    return np.divide(1.0, area, out=np.zeros_like(area), where=area > 0.0)


def limited(sums: FloatArray) -> FloatArray:
    """Return what to multiply columns with, so that no patch sends out more than `MOST_SENT`."""
    return np.asarray(1.0 / np.maximum(sums / MOST_SENT, 1.0))
