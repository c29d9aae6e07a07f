# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a lamp's light gets through to each receiver, by rays over the lamp and more where it is seen in part.

A lamp is a square of numbers (u, v), cut into cells. Neighbouring receivers form groups. First each receiver casts a
ray into each cell; cells that not all of a group see alike, or whose neighbours are seen otherwise, get more rays. It
is the group that decides, so that what a receiver happens to hit says little about whether it looks again.
"""

from concurrent.futures import Executor
from typing import Protocol

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..cells import widened
from ..occlusion.panes import Panes
from ..sequences import GOLDEN, PLASTIC
from ..visibility import Occluders
from ..workers import in_order

# Receivers in a group.
_GROUP = 16
# Rays that are cast together.
_RAYS = 1 << 18
# A group that gets more than this share of a lamp's light sees it well: an error of one cell is little of all that.
_WELL = 0.1
# Steps from receiver to receiver, and from one ray of a receiver to those beside it, across a number and along it.
_STEP = np.array(PLASTIC)
_ACROSS, _ALONG = GOLDEN, 0.4142135623730951
_TINY = 1e-300


class Samples(Protocol):
    """A lamp that can be sampled."""

    @property
    def even(self) -> bool:
        """Return whether one ray tells everything."""
        ...

    def sample(
        self, points: FloatArray, normals: FloatArray, u: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a direction, shape (n, 3), the way to the lamp there [m], and the light from there up to a factor."""
        ...


class Horizons(Protocol):
    """Faces round receivers, each of which sees what is above itself only."""

    def pick(self, which: IntArray, /) -> "Horizons":
        """Return those of some receivers, in that order."""
        ...

    def risen(self, who: IntArray, way: FloatArray, /) -> FloatArray:
        """Return over which share of the faces round a receiver each direction, shape (n, 3), rises, shape (n,)."""
        ...


def visible_share(
    lamp: Samples,
    points: FloatArray,
    normals: FloatArray,
    occluders: Occluders,
    *,
    side: int,
    finer: int,
    reach: float,
    well: int | None = None,
    panes: Panes | None = None,
    horizons: Horizons | None = None,
    workers: Executor | None = None,
) -> FloatArray:
    """Return which share of a lamp's light reaches receivers.

    Parameters
    ----------
    lamp : Samples
    points, normals : ndarray of shape (n, 3)
        Receivers [m] and their unit normals.
    occluders : Occluders
    side : int
        Cells along each side of the lamp's square.
    finer : int
        Rays along each side of a cell in the second look.
    reach : float
        Longest way that anything can be met on [m].
    well : int, optional
        What stands for `finer` where the lamp is seen well.
    panes : Panes, optional
        What gives its color to light that nothing blocks.
    horizons : Horizons, optional
        What hides light that nothing blocks.
    workers : concurrent.futures.Executor, optional
        Who computes; the result does not depend on it, bit for bit.

    Returns
    -------
    ndarray of shape (n, 1) or (n, 3)
        0 to 1, for all channels together or for each.
    """
    side = 1 if lamp.even else side
    order = _neighbours(points, normals)
    size = max(1, _RAYS // (side * side * _GROUP)) * _GROUP
    looks = (finer, finer if well is None else well)
    runs = [(start, order[start : start + size]) for start in range(0, len(order), size)]
    tasks = [
        (lamp, points[run], normals[run], start, occluders, panes, horizons and horizons.pick(run), side, looks, reach)
        for start, run in runs
    ]
    if workers is None:
        parts = [_block(*task) for task in tasks]
    else:
        # Who interrupts this does not wait for what has not begun.
        parts = list(in_order(workers, lambda task: _block(*task), tasks, len(tasks)))
    share = np.zeros((len(points), parts[0].shape[1] if parts else 1))
    if parts:
        share[order] = np.concatenate(parts)
    return share


def _block(
    lamp: Samples,
    points: FloatArray,
    normals: FloatArray,
    first: int,
    occluders: Occluders,
    panes: Panes | None,
    horizons: Horizons | None,
    side: int,
    looks: tuple[int, int],
    reach: float,
) -> FloatArray:
    """Return the shares of receivers that are neighbours; `first` numbers the first, `looks` are `finer` and `well`."""
    cells = side * side
    who, cell = (part.reshape(-1) for part in np.indices((len(points), cells)))

    def cast(who: IntArray, cell: IntArray, within: IntArray, cut: int) -> tuple[FloatArray, BoolArray, FloatArray]:
        """Return of one ray of each receiver into a cell of a cell the light, whether it comes through, and as what."""
        place = np.stack(np.divmod(cell, side)) * cut + np.stack(np.divmod(within, cut))
        # Along an edge that runs through a row or a column of cells, rays lie on both sides of it by turns.
        jitter = (first + who) * _STEP[:, None] + _ACROSS * place[::-1] + _ALONG * place
        u, v = (place + jitter % 1) / (side * cut)
        out, length, light = lamp.sample(points[who], normals[who], u, v)
        light = light[:, None] if light.ndim == 1 else light
        clear = np.zeros(len(who), bool)
        shines = np.flatnonzero(light.any(axis=1))
        start = points[who[shines]]
        end = start + np.minimum(length[shines], reach)[:, None] * out[shines]
        clear[shines] = ~occluders.blocked(start, end)
        passed = light * clear[:, None]
        if horizons is not None:
            passed *= horizons.risen(who, out)[:, None]
        if panes is not None:
            light, passed = (np.tile(part, (1, 3 // part.shape[1])) for part in (light, passed))
            some = clear[shines]
            passed[shines[some]] *= panes.tint(start[some], end[some])
        return light, clear, passed

    light, clear, passed = cast(who, cell, np.zeros_like(who), 1)
    shape = (len(points), cells, light.shape[1])
    through, whole = passed.reshape(shape), light.reshape(shape)
    if not lamp.even:
        counts = light.any(axis=1).reshape(shape[:2])
        edge = _unsure(clear.reshape(shape[:2]), counts, side)
        well = _seen_well(through, whole)
        for finer, chosen in zip(looks, (~well, well), strict=True):
            at, cell = np.nonzero((edge & chosen[:, None])[np.arange(len(points)) // _GROUP])
            rays = finer * finer
            if rays == 1 or not len(at):
                continue
            who, within = np.repeat(at, rays), np.tile(np.arange(rays), len(at))
            light, _, passed = cast(who, np.repeat(cell, rays), within, finer)
            means = (values.reshape(len(at), rays, shape[2]).mean(axis=1) for values in (passed, light))
            through[at, cell], whole[at, cell] = means
    return _shares(through.sum(axis=1), whole.sum(axis=1))


def _seen_well(through: FloatArray, whole: FloatArray) -> BoolArray:
    """Return which groups get much of the light, shape (g,), from that of each receiver, cell and channel."""
    start = np.arange(0, len(whole), _GROUP)
    lit, all_of_it = (np.add.reduceat(values.sum(axis=(1, 2)), start) for values in (through, whole))
    return np.asarray(lit > _WELL * all_of_it)


def _shares(through: FloatArray, whole: FloatArray) -> FloatArray:
    """Return how much of the light comes through, also to receivers whose rays have all missed the lit part."""
    start = np.arange(0, len(whole), _GROUP)
    sums = (np.add.reduceat(values, start, axis=0) for values in (through, whole))
    group = np.arange(len(whole)) // _GROUP
    # What neighbours see is the best guess; without any, nothing is known to be in the way.
    of_group, all_of_group = (values[group] for values in sums)
    guess = np.where(all_of_group > 0, of_group / np.maximum(all_of_group, _TINY), 1.0)
    return np.where(whole > 0, through / np.maximum(whole, _TINY), guess)


def _unsure(clear: BoolArray, counts: BoolArray, side: int) -> BoolArray:
    """Return which cells each group should look at again, shape (g, cells)."""
    start = np.arange(0, len(clear), _GROUP)
    some = np.logical_or.reduceat(clear & counts, start, axis=0).reshape(-1, side, side)
    none = np.logical_or.reduceat(~clear & counts, start, axis=0).reshape(-1, side, side)
    # What is next to a cell that is seen and to one that is not has the edge of the shadow in it or near it.
    return np.asarray((widened(some) & widened(none)).reshape(len(start), -1))


def _neighbours(points: FloatArray, normals: FloatArray) -> IntArray:
    """Return an order in which receivers that follow each other are close and look the same way."""
    low = np.min(points, axis=0, initial=np.inf)
    extent = max(float(np.max(points - low, initial=0.0)), _TINY)
    grid = ((points - low) / extent * 1023).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    # Morton: the bits of the three coordinates by turns.
    for bit in range(10):
        for axis in range(3):
            code |= ((grid[:, axis] >> bit) & 1) << (3 * bit + axis)
    way = np.abs(normals).argmax(axis=1)
    facing = 2 * way + (normals[np.arange(len(way)), way] < 0)
    return np.asarray(np.lexsort((code, facing)))
