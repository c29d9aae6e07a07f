# SPDX-License-Identifier: GPL-3.0-or-later
"""Where surfaces meet: beside a corner another surface shines as it does right there, not as its elements on the mean.

An element has one radiosity, but light changes within the last elements before an edge, and under the foot of a box it
ends. A corner at an edge sees little of the other surface but that end. So the other surface's irradiance is taken from
its own corner at that place, or where it has none from a point put beside; all of them light each other.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..meshing import Patches
from ..scene import Scene
from .asides import foremost, points_aside, widths
from .elements import Elements
from .glances import Corners
from .same_places import Neighbours, neighbours
from .sights import Sights, beside, joined
from .slopes import Slopes
from .tree import Float, Int
from .vectors import dots, picked

# A receiver stands a little off the edge of its surface, and light changes fastest right there: it sees as much of the
# other as from so much nearer.
_NEARER = 0.8
# In a corner of three walls so much less is seen of what is farther off.
_CORNER = 0.7
# Exchanges among those who meet, at most, and what is too little to go on for.
_ROUNDS = 60
_CONVERGED = 1e-4


@dataclass(frozen=True, eq=False)
class Meetings:
    """Who stands beside what.

    Attributes
    ----------
    sights : Sights
        Of elements that a receiver stands beside.
    other : ndarray of shape (k,)
        Who stands there for the element: a receiver, or a point aside, counted on from the receivers.
    aside : Corners
        Points put beside receivers where the other surface has no corner, and what they look from.
    owner : ndarray of shape (p,)
        The receiver that each of those was put beside.
    point : ndarray of shape (q + p, 3)
        Where receivers and points aside are [m].
    neighbours : Neighbours
    """

    sights: Sights
    other: Int
    aside: Corners
    owner: Int
    point: Float
    neighbours: Neighbours


def find_meetings(
    sights: Sights, scene: Scene, corners: Corners, elements: Elements, patches: Patches, most: int
) -> Meetings:
    """Find out where receivers stand beside another surface.

    Parameters
    ----------
    sights : Sights
        Of elements that the receivers stand beside.
    scene : Scene
    corners : Corners
        Its receivers.
    elements : Elements
    patches : Patches
    most : int
        Points aside, for those that see most of what they stand beside.

    Returns
    -------
    Meetings
    """
    known = neighbours(scene, corners, patches)
    other = known.of(sights.receiver, elements.patch[sights.element])
    gap = ~beside(sights, corners.point, elements)
    # Nobody meets himself: a face bent a little sees an end of its own.
    apart = other != sights.receiver
    sights, other, gap = sights.pick(apart), other[apart], gap[apart]
    lacking = np.flatnonzero(other < 0)
    lacking = lacking[foremost(sights.pick(lacking), most)]
    across = gap[lacking]
    owner, aside, which = points_aside(sights.pick(lacking), across, corners, elements, widths(corners, patches))
    other[lacking] = len(corners.point) + which
    met = other >= 0
    return Meetings(sights.pick(met), other[met], aside, owner, np.concatenate((corners.point, aside.point)), known)


def exchange(
    light: Float,
    meetings: Meetings,
    slopes: Slopes,
    aside: Float,
    seen: Sights,
    elements: Elements,
    radiosity: Float,
) -> Float:
    """Let surfaces light each other where they meet.

    Parameters
    ----------
    light : ndarray of shape (q, 3)
        Irradiance of the receivers, from elements of one radiosity each [W/m^2].
    meetings : Meetings
    slopes : Slopes
        Of what they see but do not stand beside.
    aside : ndarray of shape (p, 3)
        The same at the points aside.
    seen : Sights
        What those see much of.
    elements : Elements
    radiosity : ndarray of shape (n, 3)
        That they show [W/m^2].

    Returns
    -------
    ndarray of shape (q, 3)
    """
    count, owner = len(light), meetings.owner
    # Points aside look back at the surface that they were put beside.
    seen = seen.pick(beside(seen, meetings.aside.point, elements))
    back = owner[seen.receiver]
    seen = seen.pick(meetings.neighbours.of(back, elements.patch[seen.element]) == back)
    sights = joined((meetings.sights, replace(seen, receiver=count + seen.receiver)))
    other = np.concatenate((meetings.other, owner[seen.receiver]))
    there = np.where(other < count, 1 - towards_middle(sights, other, meetings.point, elements), 1)
    share = (there * sights.weight)[:, None]
    E, rho, B = elements.emission[sights.element], elements.reflectance[sights.element], radiosity[sights.element]
    receiver = np.concatenate((sights.receiver, slopes.receiver))
    sloping = slopes.share[:, None] * elements.reflectance[slopes.element]
    given = np.concatenate((light, aside))
    H = given
    for _ in range(_ROUNDS):
        # What stands for an element there sends instead of the element.
        change = np.concatenate((share * (E + rho * H[other] - B), sloping * H[slopes.corner]))
        sums = [np.bincount(receiver, channel, len(given)) for channel in change.T]
        before, H = H, np.maximum(given + np.stack(sums, axis=1), 0)
        if np.abs(H - before).max(initial=0) <= _CONVERGED * H.max(initial=0):
            break
    return H[:count]


def towards_middle(sights: Sights, other: Int, point: Float, elements: Elements) -> Float:
    """Return how far what receivers see of elements that they stand beside is from the end towards the middle.

    A point at height h sees an element of size L, at whose edge it stands, in a distance of h (ln(2 L / h) - 1) on the
    mean, and light changes evenly up to the middle.

    Parameters
    ----------
    sights : Sights
        Of elements that receivers stand beside.
    other : ndarray of shape (k,)
        Who stands for each element there: one who stands beside several is in a corner.
    point : ndarray of shape (q, 3)
        Of all receivers [m].
    elements : Elements

    Returns
    -------
    ndarray of shape (k,)
        Zero for the end, one for the middle.
    """
    e = sights.element
    height = np.abs(dots(picked(point, sights.receiver) - elements.corners[e, 0], picked(elements.normal, e)))
    h = np.clip(_NEARER * height / np.sqrt(elements.area[e]), 1e-6, _NEARER)
    pairs = np.unique(sights.receiver * len(point) + other)
    several = np.bincount(pairs // len(point), minlength=len(point))[sights.receiver] > 1
    return np.asarray(np.clip(np.where(several, _CORNER, 1) * 2 * h * (np.log(2 / h) - 1), 0, 1))
