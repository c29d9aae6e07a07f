# SPDX-License-Identifier: GPL-3.0-or-later
"""Bends: at a vertex of a coarse mesh that is shaded smooth, each face looks over its own horizon only.

A receiver stands above all of its faces and sees the half space of its normal. A path tracer that starts on one of them
sends no ray below that face, whatever the normal: on the mean over the faces so much less of what has bounced arrives.
Lamps it looks for, and nothing hides them from the vertex itself.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..runs import counted
from ..scene import Scene
from ..shading import shown_face_normals
from .receivers import Receivers
from .rows import BRIGHT, Rows
from .scenery import Scenery
from .sources import Sources
from .tree import Float, Int
from .vectors import dots, picked

# Cosine between the normal of a receiver and of a face from which on it is no matter: less than 1 % is lost.
_BENT = 0.985
# How far a node reaches above and below its middle, as a share of its radius.
_REACH = 0.7


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
    share : ndarray of shape (q,)
        Of light that comes from everywhere alike, what arrives at the faces on the mean.
    """

    bent: NDArray[np.bool_]
    first: Int
    normal: Float
    share: Float

    def pick(self, which: Int) -> "Bends":
        """Return the bends of some receivers, in that order."""
        count = np.diff(self.first)[which]
        _, face = counted(count, self.first[which])
        first = np.concatenate(([0], np.cumsum(count)))
        return Bends(self.bent[which], first, self.normal[face], self.share[which])


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
    cosine, count = dots(own, normal[receiver]), np.maximum(np.diff(first), 1)
    bent = np.bincount(receiver, cosine < _BENT, len(normal)) > 0
    # Below the horizon of a face is a lune of the half space (Lambert).
    lost = np.bincount(receiver, 0.5 * (1 - cosine), len(normal)) / count
    return Bends(bent, first, own, np.where(bent, 1 - lost, 1))


def over_horizons(rows: Rows, receivers: Receivers, bends: Bends, scenery: Scenery) -> Rows:
    """Return rows that bring to receivers on a bend what is above the horizons of their faces, on the mean over those.

    Parameters
    ----------
    rows : Rows
    receivers : Receivers
    bends : Bends
        Of the receivers in the caller's order.
    scenery : Scenery
        Its bright nodes are left as they are.

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
    node, receiver = (
        rows.node[rows.first[here][run] + place // size[run]],
        receivers.first[group][run] + place % size[run],
    )
    at = rows.begin[here][run] + place
    cut = np.flatnonzero(bent[receiver] & (rows.weight[at] > 0) & (scenery.brightness[node] <= BRIGHT))
    weight = rows.weight.copy()
    weight[at[cut]] *= _above(receivers, receiver[cut], node[cut], bends, scenery.sources).astype(np.float32)
    return replace(rows, weight=weight)


def _above(receivers: Receivers, receiver: Int, node: Int, bends: Bends, sources: Sources) -> Float:
    """Return the share of each node that is above the horizon of a receiver's faces, on the mean over them."""
    to = picked(sources.centre, node) - picked(receivers.point, receiver)
    reach = np.maximum(_REACH * sources.radius[node], 1e-300)
    owner = receivers.index[receiver]
    count = np.diff(bends.first)[owner]
    total = np.zeros(len(node))
    for turn in range(int(np.max(count, initial=0))):
        which = np.flatnonzero(turn < count)
        height = dots(bends.normal[bends.first[owner[which]] + turn], to[which])
        total[which] += np.clip(0.5 + 0.5 * height / reach[which], 0, 1)
    share: Float = total / np.maximum(count, 1)
    return share
