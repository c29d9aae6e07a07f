# SPDX-License-Identifier: GPL-3.0-or-later
"""Who lights whom, a column of form factors at a time (T8): for shooting, in memory that grows with n."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ..arrays import FloatArray, IntArray, SingleArray
from ..meshing import Patches
from ..occlusion.surfaces import Occluding
from ..transport import inverse, limited
from ..visibility import Occluders
from .blocks import block
from .exchange import Exchange, exchange
from .hemicube_rows import Views, hemicube_rows, hemicube_views

# Returns A_i F_ij of all patches i and some j, shape (n, m) [m^2], and how many segments it tested for that.
Exchanged = Callable[[IntArray], tuple[SingleArray, int]]

# Columns that are kept, so that a patch that shoots again costs nothing [bytes].
KEPT_BYTES = 256 * 2**20


class ColumnTransport:
    """Columns of the matrix on demand; see `transport.Transport`.

    The columns of a whole group of neighbours cost little more than one of them, so they are computed together and kept
    as long as `KEPT_BYTES` last; the brightest groups come first, and those shoot most often.

    Parameters
    ----------
    area : ndarray of shape (n,)
        [m^2].
    groups : list of ndarray
        Patches whose columns are computed together.
    exchanged : callable
        See `Exchanged`.

    Attributes
    ----------
    area : ndarray of shape (n,)
        [m^2].
    rays : int
        Segments tested for visibility so far.
    links : int
        Factors above zero in the columns computed so far.
    """

    def __init__(self, area: FloatArray, groups: list[IntArray], exchanged: Exchanged) -> None:
        self.area = area
        self._groups = groups
        self._exchanged = exchanged
        self._group = np.zeros(len(area), dtype=np.int64)
        self._place = np.zeros(len(area), dtype=np.int64)
        for index, members in enumerate(groups):
            self._group[members] = index
            self._place[members] = np.arange(len(members))
        self._kept: dict[int, SingleArray] = {}
        self._bytes_left = KEPT_BYTES
        self._sums = np.full(len(area), np.nan)
        self.rays = self.links = 0

    def column(self, j: int) -> FloatArray:
        """Return F_ij of all patches i for one j, shape (n,)."""
        group = int(self._group[j])
        members = self._groups[group]
        if group not in self._kept:
            needed = 4 * len(self.area) * len(members)
            if needed > self._bytes_left:
                return self._columns(np.array([j]))[:, 0].astype(np.float64)
            self._kept[group] = self._columns(members)
            self._bytes_left -= needed
        return self._kept[group][:, self._place[j]].astype(np.float64)

    def gather(self, radiosity: FloatArray) -> FloatArray:
        """Return the irradiance H = F B; computes every column and keeps none."""
        H = np.zeros_like(radiosity)
        for members in self._groups:
            H += self._columns(members) @ radiosity[members]
        return H

    def row_sums(self) -> FloatArray:
        """Return the share of a patch's light that meets a patch; NaN for patches that nobody has asked for."""
        return self._sums

    def _columns(self, members: IntArray) -> SingleArray:
        """Return the columns of some patches, shape (n, m)."""
        columns, rays = self._exchanged(members)
        sums = columns.sum(axis=0, dtype=np.float64) * inverse(self.area[members])
        self._sums[members] = sums
        self.links += int(np.count_nonzero(columns))
        self.rays += rays
        columns *= inverse(self.area)[:, None]
        columns *= limited(sums)
        return columns


def column_transport(
    patches: Patches, occluders: Occluders | None, *, kernel: str = "exact", surfaces: Occluding | None = None
) -> ColumnTransport:
    """Return the transport that computes columns on demand.

    Parameters
    ----------
    patches : Patches
    occluders : Occluders or None
        Who casts rays; None when nothing blocks.
    kernel : {"exact", "centre", "hemicube"}
        T3, T2 or T4.
    surfaces : Occluding, optional
        The surfaces that block; where given, most rays are saved.

    Returns
    -------
    ColumnTransport
    """
    if kernel == "hemicube":
        alone = list(np.arange(len(patches.area))[:, None])
        return ColumnTransport(patches.area, alone, partial(_hemicube_columns, hemicube_views(patches)))
    x = exchange(patches, occluders, surfaces, exact=kernel == "exact")
    return ColumnTransport(patches.area, x.groups, partial(_block_columns, x))


def _block_columns(x: Exchange, members: IntArray) -> tuple[SingleArray, int]:
    """Return A_i F_ij of all patches i and some j, and the segments tested."""
    columns, rays = np.zeros((len(x.patches.area), len(members)), dtype=np.float32), 0
    for group in x.groups:
        between, segments = block(x, group, members)
        rays += segments
        if between is not None:
            columns[group] = between
    return columns, rays


def _hemicube_columns(views: Views, members: IntArray) -> tuple[SingleArray, int]:
    """Return A_i F_ij = A_j F_ji of all patches i and some j, and the pixels looked at."""
    rows = hemicube_rows(views, members) * views.patches.area[members, None].astype(np.float32)
    return np.ascontiguousarray(rows.T), len(members) * len(views.hemicube.deltas)
