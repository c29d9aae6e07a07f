# SPDX-License-Identifier: GPL-3.0-or-later
"""New light on a scene that is linked already: no form factor depends on emission or reflectance.

A few hundred clusters exchange light in a small dense matrix that is solved at once; within each, light is taken to lie
as it did before. Two or three bounces through the links make that a solution on the elements, instead of dozens.
"""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from ..meshing import Patches
from ..progress import Progress
from ..solution import Solution
from ..translucence import piece_translucence, scattered
from .exchange import build_rows
from .first_look import typical_irradiance
from .linking import linked
from .quality import Detail
from .scenery import relit
from .solve import Lit, patch_solution
from .transport import HierarchicalTransport
from .tree import Float, Int

# Clusters of the small matrix, at most, and how many of its columns are computed at a time.
_CLUSTERS = 256
_COLUMNS = 32
# Bounces among the clusters, at most, and what is too little to go on for.
_BOUNCES = 500
_CONVERGED = 1e-4
# Sweeps that are enough where light lies much as it did; one more where the last changed more than this share of all.
_SWEEPS, _ELSEWHERE = 2, 0.002
# A link is stale when it carries this many times what it was made for, and more than this many errors.
_BRIGHTER = 4.0


@dataclass(frozen=True, eq=False)
class Relighting:
    """A transport and its small matrix.

    Attributes
    ----------
    lit : Lit
    node : ndarray of shape (k,)
        Nodes of the hierarchy that are the clusters.
    cluster : ndarray of shape (n,)
        Cluster of each element.
    area : ndarray of shape (k,)
        Of the clusters [m^2].
    matrix : ndarray of shape (k, k)
        Irradiance of cluster i from cluster j of radiosity 1.
    missed : ndarray of shape (n, 3)
        What links miss of the light straight from lamps, which were looked at more closely [W/m^2].
    shape : ndarray of shape (n, 3)
        How much more than its cluster each element received, in the light that the links were made for.
    """

    lit: Lit
    node: Int
    cluster: Int
    area: Float
    matrix: Float
    missed: Float
    shape: Float


def prepare_relighting(lit: Lit) -> Relighting:
    """Condense a transport into a matrix of a few hundred clusters; once for a scene.

    Parameters
    ----------
    lit : Lit

    Returns
    -------
    Relighting
    """
    tree, area = lit.transport.sources.tree, lit.elements.area
    node = tree.cut(max(1, -(-2 * len(area) // _CLUSTERS)))
    cluster = np.zeros(len(area), np.int64)
    cluster[tree.order] = np.repeat(np.arange(len(node)), tree.size[node])
    missed = lit.straight - lit.transport.gather(lit.lamp)
    size, none = lit.transport.sources.area[node], np.zeros((0, 0))
    bare = Relighting(lit, node, cluster, size, none, missed, none)
    columns = []
    for first in range(0, len(node), _COLUMNS):
        alone = cluster[:, None] == np.arange(first, min(first + _COLUMNS, len(node)))
        columns.append(_restricted(lit.transport.gather(alone.astype(float)), bare))
    matrix = np.concatenate(columns, axis=1)
    # What was dark says nothing about where new light lies.
    received = lit.transport.gather(lit.solution.radiosity)
    mean = (matrix @ _restricted(lit.solution.radiosity, bare))[cluster]
    shape = np.where(mean > 0, received / np.where(mean > 0, mean, 1), 1)
    return replace(bare, matrix=matrix, shape=shape)


def relight(relighting: Relighting, patches: Patches, *, sweeps: int | None = None) -> Lit:
    """Solve for new emission and reflectance with the links there are.

    Parameters
    ----------
    relighting : Relighting
    patches : Patches
        The same patches with other `emission` and `reflectance`.
    sweeps : int, optional
        Through the links; each leaves about a third of the error. By default two, and a third where light falls
        elsewhere than before.

    Returns
    -------
    Lit
        With the solution on the elements; see `relit_patches` for that on the patches. Light of lamps stays as it was.
    """
    lit = relighting.lit
    elements, transport = lit.elements, lit.transport
    rho, emission = patches.surface(elements.corners, elements.patch)
    elements = replace(elements, reflectance=rho, emission=emission)
    # What links miss of the lamps' light goes with what lamps emit.
    was, total = lit.lamp.any(axis=1), elements.area[:, None] * np.stack((lit.lamp, emission))
    before, now = total[:, was].sum(axis=1)
    missed = relighting.missed * (now / np.where(before > 0, before, np.inf))
    direct = lit.direct + missed
    through = piece_translucence(elements.corners, elements.patch, patches)
    E = emission + scattered(rho, direct, through)
    dull = _restricted(rho if through is None else through.albedo(rho), relighting)
    clustered = _bounced(relighting.matrix, _restricted(E, relighting), dull)
    H = relighting.shape * (relighting.matrix @ clustered)[relighting.cluster]
    B = E + scattered(rho, H, through)
    residual, done = np.inf, 0
    while done < _SWEEPS + 1 if sweeps is None else done < sweeps:
        H = transport.gather(B)
        missing = E + scattered(rho, H, through) - B
        # What one bounce still lacks as it is, and what all further bounces add to it by the clusters.
        means = _restricted(missing, relighting)
        step = missing + (_bounced(relighting.matrix, means, dull) - means)[relighting.cluster]
        B += step
        done += 1
        changed: Float = np.abs(step)
        residual = float(np.max(changed)) / max(float(np.max(B)), 1e-300)
        if sweeps is None and done == _SWEEPS and float(changed.sum()) <= _ELSEWHERE * float(B.sum()):
            break
    tells = rho > 0 if through is None else np.zeros_like(rho, dtype=bool)
    irradiance = np.where(tells, (B - E) / np.where(tells, rho, 1), H) + direct
    solution = Solution(B, irradiance, done, residual < _CONVERGED, residual)
    return replace(lit, elements=elements, solution=solution, through=through)


def relit_patches(lit: Lit, patches: Patches) -> Solution:
    """Return the solution on the patches that `relight` was given."""
    return patch_solution(lit, patches)


def refine(lit: Lit, patches: Patches, detail: Detail, workers: Executor) -> Generator[Progress, None, tuple[Lit, int]]:
    """Link anew where light now falls that the links were not made for.

    Parameters
    ----------
    lit : Lit
        From `relight`.
    patches : Patches
        What it was lit with.
    detail : Detail
        That of the quality.
    workers : concurrent.futures.Executor

    Yields
    ------
    Progress

    Returns
    -------
    lit : Lit
        To prepare for relighting again, when anything was refined.
    refined : int
        How many groups of elements were linked anew.
    """
    transport, elements = lit.transport, lit.elements
    typical = typical_irradiance(elements, lit.solution.irradiance, lit.transport.row_sums())
    if typical <= 0:
        return lit, 0
    scenery = relit(lit.scenery, elements, lit.solution.radiosity, typical)
    stale = [
        index for index, _ in enumerate(transport.rows) if _stale(transport, index, scenery.brightness, lit, detail)
    ]
    rows = list(transport.rows)
    futures = [workers.submit(build_rows, transport.receivers, rows[index].group, scenery, detail) for index in stale]
    for done, (index, future) in enumerate(zip(stale, futures, strict=True)):
        rows[index] = future.result()
        yield Progress("Links", (done + 1) / len(stale))
    if not stale:
        return lit, 0
    renewed = linked(elements, transport.samples, scenery, transport.receivers, rows, detail, workers)
    renewed = renewed.balanced(lit.solution.radiosity)
    return replace(lit, transport=renewed, scenery=scenery), sum(len(rows[index].group) for index in stale)


def _stale(transport: HierarchicalTransport, index: int, brightness: Float, lit: Lit, detail: Detail) -> bool:
    """Return whether a part of the rows carries light that it was not made for."""
    rows = transport.rows[index]
    before, now = lit.scenery.brightness[rows.node], brightness[rows.node]
    suspicious = np.flatnonzero(now > _BRIGHTER * before)
    if not len(suspicious):
        return False
    strongest = np.concatenate([weight.max(axis=1, initial=0) for _, _, weight in rows.blocks(transport.receivers)])
    return bool((strongest[suspicious] * now[suspicious] > _BRIGHTER * detail.error).any())


def _restricted(values: Float, relighting: Relighting) -> Float:
    """Return the means of elements' values over clusters, shape (n, c) to (k, c)."""
    # Clusters are runs of the tree's order, one after the other.
    tree = relighting.lit.transport.sources.tree
    ordered = (relighting.lit.elements.area * values.T).take(tree.order, axis=1)
    sums: Float = np.add.reduceat(ordered, tree.start[relighting.node], axis=1).T
    return sums / relighting.area[:, None]


def _bounced(matrix: Float, first: Float, reflectance: Float) -> Float:
    """Return what clusters that reflect `first` end up reflecting in all, shape (k, c)."""
    total = first.copy()
    for _ in range(_BOUNCES):
        change = first + reflectance * (matrix @ total) - total
        total += change
        if np.abs(change).max(initial=0) <= _CONVERGED * np.abs(total).max(initial=0):
            break
    return total
