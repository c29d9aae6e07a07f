# SPDX-License-Identifier: GPL-3.0-or-later
"""Sights: single elements that fill much of what a receiver sees."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from .elements import Elements
from .nearness import nearest_points
from .receivers import Receivers
from .rows import Rows
from .tree import Float, Int, Tree
from .vectors import dots

# How near to an element a receiver stands beside it, as a share of the element's size: at its edge, or in front of it,
# as across a gap.
EDGE, GAP = 0.12, 0.5


@dataclass(frozen=True, eq=False)
class Sights:
    """Pairs of receivers and elements.

    Attributes
    ----------
    receiver, element : ndarray of shape (k,)
    weight : ndarray of shape (k,)
        Form factor times visible share.
    place : ndarray of shape (k, 3)
        Where on the element the light comes from on the mean [m].
    """

    receiver: Int
    element: Int
    weight: Float
    place: Float

    def pick(self, which: Int | NDArray[np.bool_]) -> "Sights":
        """Return some of the pairs."""
        return Sights(*(getattr(self, field.name)[which] for field in fields(self)))


NOTHING = Sights(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 3)))


def joined(parts: Sequence[Sights]) -> Sights:
    """Return sights one after the other."""
    return Sights(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Sights)))


def of_all(sights: Sights, which: Int) -> Sights:
    """Return sights of some receivers as sights among all of them, of which they are `which`."""
    return replace(sights, receiver=which[sights.receiver])


def large_sights(rows: Rows, receivers: Receivers, tree: Tree) -> Sights:
    """Return the links of rows that fill much of what a receiver sees with a single element.

    Parameters
    ----------
    rows : Rows
    receivers : Receivers
    tree : Tree
        Of the elements.

    Returns
    -------
    Sights
        Of the receivers in the caller's order.
    """
    large = rows.large
    group = np.searchsorted(rows.begin, large, side="right") - 1
    first, count = receivers.first[rows.group[group]], np.diff(receivers.first)[rows.group[group]]
    link, member = np.divmod(large - rows.begin[group], count)
    element = tree.order[tree.start[rows.node[rows.first[group] + link]]]
    return Sights(receivers.index[first + member], element, rows.weight[large].astype(float), rows.middle)


def beside(sights: Sights, point: Float, elements: Elements, reach: float = EDGE) -> NDArray[np.bool_]:
    """Return which sights are of elements that the receiver stands beside: it sees little but their nearest end.

    Parameters
    ----------
    sights : Sights
    point : ndarray of shape (q, 3)
        Of the receivers [m].
    elements : Elements
    reach : float
        How near that is, as a share of an element's size.

    Returns
    -------
    ndarray of shape (k,)
    """
    at, element = point[sights.receiver], sights.element
    apart = at - nearest_points(at, elements.corners[element], elements.normal[element])
    close: NDArray[np.bool_] = dots(apart, apart) < reach**2 * elements.area[element]
    return close


def light_from(sights: Sights, sent: Float, count: int) -> Float:
    """Return the light that so many receivers get from what they see, shape (count, k) [W/m^2].

    Parameters
    ----------
    sights : Sights
    sent : ndarray of shape (n, k)
        What each element sends [W/m^2].
    count : int
    """
    return np.stack([np.bincount(sights.receiver, sights.weight * part[sights.element], count) for part in sent.T], 1)
