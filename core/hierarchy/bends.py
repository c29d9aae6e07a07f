# SPDX-License-Identifier: GPL-3.0-or-later
"""Bends: at a vertex of a coarse mesh that is shaded smooth, each face looks over its own horizon only.

A receiver stands above all of its faces and sees the half space of its normal. A path tracer that starts on one of them
sends no ray below that face, whatever the normal: on the mean over the faces so much less arrives of what has bounced,
and of the sky. Lamps and what emits it looks for, and nothing hides those from the vertex itself.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..runs import counted
from ..scene import Scene
from ..shading import shown_face_normals
from .receivers import Receivers
from .rows import Rows
from .sources import Sources
from .tree import Float, Int
from .vectors import dots, picked

# Cosine between the normal of a receiver and of a face from which on it is no matter: less than 1 % is lost.
_BENT = 0.985
# How far a node reaches above and below its middle, as a share of its radius.
_REACH = 0.7
# Sine of the angle above a horizon up to which it counts as in the plane.
_EVEN = 1e-5
# A node that is seen has risen by such a share, whatever its middle says.
_LEAST = 0.02


@dataclass(frozen=True, eq=False)
class Bends:
    """The faces round each of q receivers.

    Attributes
    ----------
    bent : ndarray of shape (q,)
        Whether any of them differs.
    first : ndarray of shape (q + 1,)
        Where the faces of each receiver begin.
    normal : ndarray of shape (t, 3)
        Of those faces, unit length.
    """

    bent: NDArray[np.bool_]
    first: Int
    normal: Float

    def pick(self, which: Int) -> "Bends":
        """Return the bends of some receivers, in that order."""
        count = np.diff(self.first)[which]
        _, face = counted(count, self.first[which])
        first = np.concatenate(([0], np.cumsum(count)))
        return Bends(self.bent[which], first, self.normal[face])

    def risen(self, who: Int, way: Float) -> Float:
        """Return over which share of the faces round a receiver each direction rises.

        Parameters
        ----------
        who : ndarray of shape (n,)
            Receivers.
        way : ndarray of shape (n, 3)

        Returns
        -------
        ndarray of shape (n,)
            1 for receivers that are not bent.
        """
        asked = np.flatnonzero(self.bent[who])
        share = np.ones(len(who))
        share[asked] = self.mean(who[asked], lambda some, up: dots(up, picked(way, asked[some])) > 0)
        return share

    def mean(self, who: Int, over: Callable[[Int, Float], Float | NDArray[np.bool_]]) -> Float:
        """Return the mean over the faces round receivers, shape (n,); one face of each is asked at a time.

        `over` tells for some of `who`, which are bent, what each has over a face with such a normal.
        """
        first, count = self.first[who], np.diff(self.first)[who]
        total = np.zeros(len(who))
        for turn in range(int(np.max(count, initial=0))):
            some = np.flatnonzero(turn < count)
            total[some] += over(some, self.normal[first[some] + turn])
        return total / np.maximum(count, 1)


def find_bends(scene: Scene, normal: Float, group: Int) -> Bends:
    """Find out where a smooth surface is bent.

    Parameters
    ----------
    scene : Scene
    normal : ndarray of shape (q, 3)
        Of the receivers, unit length.
    group : ndarray of shape (c,)
        Receiver of each of the scene's corners.

    Returns
    -------
    Bends
    """
    own = shown_face_normals(scene)[scene.corner_face]
    corner = np.flatnonzero(own.any(axis=1))
    corner = corner[np.argsort(group[corner], kind="stable")]
    own, receiver = own[corner], group[corner]
    first = np.searchsorted(receiver, np.arange(len(normal) + 1))
    bent = np.bincount(receiver, dots(own, normal[receiver]) < _BENT, len(normal)) > 0
    return Bends(bent, first, own)


def over_horizons(rows: Rows, receivers: Receivers, bends: Bends, sources: Sources, emits: Float) -> Rows:
    """Return rows that bring to receivers on a bend what is above the horizons of their faces, on the mean over those.

    Parameters
    ----------
    rows : Rows
    receivers : Receivers
    bends : Bends
        Of the receivers in the caller's order.
    sources : Sources
    emits : ndarray of shape (m,)
        Share of each node's light that it emits.

    Returns
    -------
    Rows
        With the sums they had, which tell what is around.
    """
    bent = bends.bent[receivers.index]
    here = np.flatnonzero(np.add.reduceat(bent, receivers.first[:-1], dtype=np.int64)[rows.group])
    if not len(here):
        return rows
    # Every link of a group has a weight for each of its receivers, and those follow each other.
    group, links = rows.group[here], np.diff(rows.first)[here]
    size = np.diff(receivers.first)[group]
    run, place = counted(links * size)
    node = rows.node[rows.first[here][run] + place // size[run]]
    receiver = receivers.first[group][run] + place % size[run]
    at = rows.begin[here][run] + place
    cut = np.flatnonzero(bent[receiver] & (rows.weight[at] > 0) & (emits[node] < 1))
    at, receiver, node = at[cut], receiver[cut], node[cut]
    below = 1 - _above(receivers, receiver, node, bends, sources)
    weight = rows.weight.copy()
    weight[at] *= (1 - below * (1 - emits[node])).astype(np.float32)
    return replace(rows, weight=weight)


def _above(receivers: Receivers, receiver: Int, node: Int, bends: Bends, sources: Sources) -> Float:
    """Return which share of what each receiver sees of a node is above the horizon of its faces, on the mean."""
    to = picked(sources.centre, node) - picked(receivers.point, receiver)
    # What is below the receiver's own horizon it does not see anyway.
    seen = _risen(picked(receivers.normal, receiver), to, node, sources)

    def over(some: Int, up: Float) -> Float:
        return np.minimum(_risen(up, to[some], node[some], sources) / seen[some], 1)

    return bends.mean(receivers.index[receiver], over)


def _risen(up: Float, to: Float, node: Int, sources: Sources) -> Float:
    """Return the share of each node above a horizon, by how high its middle is in units of how high it reaches."""
    slope = dots(up, picked(sources.normal, node))
    # What is flat and lies along the horizon does not reach above it: a face does not see itself.
    tilt = np.where(sources.flat[node], np.sqrt(np.maximum(1 - slope * slope, 0)), 1)
    reach = np.maximum(_REACH * sources.radius[node] * tilt, 1e-300)
    height = dots(up, to) - _EVEN * np.sqrt(dots(to, to))
    risen: Float = np.clip(0.5 + 0.5 * height / reach, _LEAST, 1)
    return risen
