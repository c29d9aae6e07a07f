# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole matrix of form factors, a strip of rows at a time and several strips at once (T13, T15)."""

import os
from collections.abc import Generator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial

import numpy as np

from ..arrays import IntArray, SingleArray
from ..errors import RadiosityError
from ..memory import available_memory
from ..meshing import Patches
from ..occlusion.surfaces import Occluding
from ..progress import Progress
from ..transport import MOST_SENT, DenseTransport, inverse, limited
from ..visibility import Occluders
from ..workers import in_order
from .blocks import block
from .exchange import Exchange, exchange
from .hemicube_rows import Views, hemicube_rows, hemicube_views
from .shafts import GROUP_SIZE

# Patches j and A_i F_ij to each, then the number of segments tested for visibility.
Strip = tuple[list[tuple[IntArray, SingleArray]], int]

STAGE = "Form factors"
# Temporaries of one block of the exchange, for each of the threads [bytes].
BLOCK_BYTES = 48 * 2**20
# Rows of hemicubes computed at a time.
HEMICUBES = 32


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
    strips = in_order(workers, partial(_strip, x), range(len(x.groups)), _ahead())
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
    for members, rows in zip(groups, in_order(workers, partial(hemicube_rows, views), groups, _ahead()), strict=True):
        matrix[members] = rows
        links += int(np.count_nonzero(rows))
        yield Progress(STAGE, (int(members[-1]) + 1) / n)
    sums = matrix.sum(axis=1, dtype=np.float64)
    return DenseTransport(matrix, views.patches.area, sums, links, n * len(views.hemicube.deltas))


def _strip(x: Exchange, first: int) -> Strip:
    """Return A F between one group and all from it on, without the blocks that are zero, and the segments tested."""
    blocks, rays = [], 0
    for j in x.groups[first:]:
        between, segments = block(x, x.groups[first], j)
        rays += segments
        if between is not None:
            blocks.append((j, between.astype(np.float32)))
    return blocks, rays


def _ahead() -> int:
    """Return how many parts are computed ahead: enough that no worker waits."""
    return 2 * (os.cpu_count() or 1)


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
