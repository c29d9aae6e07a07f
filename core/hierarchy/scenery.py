# SPDX-License-Identifier: GPL-3.0-or-later
"""What light travels through: elements in clusters, how bright those may be, and what stands between."""

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from ..visibility import Surroundings
from .element_hits import ElementHits
from .elements import Elements
from .links import Links, find_links, unevenness
from .quality import Detail
from .receivers import Receivers
from .source_points import SourcePoints
from .sources import Sources, build_sources
from .thickets import Thickets, find_thickets, most_links
from .tree import Float, Int

# Stops of brightness, about a typical one, that clusters are told apart by.
_DARKEST, _BRIGHTEST = -5.0, 15.0
# Of a typical irradiance: what is darker is not lit at all.
_UNLIT = 4e-3
# Of a typical irradiance: where nothing shines, rays go anywhere.
_FAINT = 0.01


@dataclass(frozen=True, eq=False)
class Scenery:
    """What light travels through: the sources and what stands between.

    Attributes
    ----------
    sources : Sources
    brightness : ndarray of shape (m,)
        Radiosity of each node over a typical irradiance: what is worth following.
    uneven : ndarray of shape (m,)
        How much the parts of each node differ from it in that.
    targets : SourcePoints
    occluders : Surroundings
    thickets : Thickets or None
        None where every receiver is linked to all that it sees.
    """

    sources: Sources
    brightness: Float
    uneven: Float
    targets: SourcePoints
    occluders: Surroundings
    thickets: Thickets | None = None


def build_scenery(
    elements: Elements,
    radiosity: Float,
    typical: float,
    occluders: Surroundings,
    known: Float | None = None,
    workers: Executor | None = None,
    hits: ElementHits | None = None,
) -> Scenery:
    """Cluster elements by where they are and how bright they may be.

    Parameters
    ----------
    elements : Elements
    radiosity : ndarray of shape (n, 3)
        A guess [W/m^2].
    typical : float
        Irradiance that errors are judged by [W/m^2].
    occluders : Surroundings
    known : ndarray of shape (n, 3), optional
        What of it is no guess: what is alike in that is clustered. Rooms that no lamp shines into stay for themselves.
    workers : concurrent.futures.Executor, optional
        See `build_tree`.
    hits : ElementHits, optional
        What rays meet of the elements, for receivers in thickets.

    Returns
    -------
    Scenery
    """
    bright = radiosity.mean(axis=1) / typical
    told = bright if known is None else known.mean(axis=1) / typical
    shade = np.clip(np.log2(np.maximum(told, 2.0**_DARKEST)), _DARKEST, _BRIGHTEST)
    # Next to nothing is what a rough solution leaves in rooms that no light reaches: those stay for themselves.
    shade[told < _UNLIT] = 2 * _DARKEST
    measures = elements.corners, elements.centre, elements.normal, elements.area
    sources = build_sources(*measures, shade, workers, elements.solid)
    return _scenery(sources, elements, bright, occluders, hits)


def relit(scenery: Scenery, elements: Elements, radiosity: Float, typical: float) -> Scenery:
    """Return the same clusters under other light; parameters as for `build_scenery`."""
    hits = None if scenery.thickets is None else scenery.thickets.hits
    return _scenery(scenery.sources, elements, radiosity.mean(axis=1) / typical, scenery.occluders, hits)


def _scenery(
    sources: Sources, elements: Elements, bright: Float, occluders: Surroundings, hits: ElementHits | None
) -> Scenery:
    targets = SourcePoints(sources, elements.corners, elements.area * (bright + _FAINT))
    brightness = node_means(sources, elements.area, bright[:, None])[:, 0]
    thickets = find_thickets(sources.tree, brightness, hits) if hits else None
    return Scenery(sources, brightness, unevenness(sources, brightness), targets, occluders, thickets)


def links_to(scenery: Scenery, receivers: Receivers, groups: Int, detail: Detail, need: Float | None = None) -> Links:
    """Link some groups of receivers to what they might see, as finely as a detail asks for; see `find_links`."""
    return find_links(
        receivers,
        groups,
        scenery.sources,
        scenery.brightness,
        angle=detail.angle,
        error=detail.error,
        uneven=scenery.uneven,
        need=need,
        linked=None if scenery.thickets is None else scenery.thickets.linked,
        most=most_links(detail),
    )


def node_means(sources: Sources, area: Float, radiosity: Float) -> Float:
    """Return the mean radiosity of every node, shape (m, k), from that of the elements, shape (n, k)."""
    sums: Float = sources.tree.sums(area[:, None] * radiosity)
    return sums / sources.area[:, None]
