# SPDX-License-Identifier: GPL-3.0-or-later
"""The first look: light straight from lamps at all elements, and a guess at the rest.

An element is a lamp when it shines much brighter than what it lights.
"""

from collections.abc import Generator
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from ..progress import Progress
from ..translucence import Translucence, scattered
from ..visibility import Surroundings
from .elements import Elements
from .exchange import stream_rows
from .linking import MOST_LAMPS, check_memory
from .quality import Quality
from .receivers import Receivers, group_receivers
from .rows import Rows, gather, received
from .samples import Samples
from .scenery import Scenery, build_scenery, node_means
from .transport import of_leaves, put_right
from .tree import Float, Int

STAGE = "First look"
# Reflectance that the ambient light is estimated with, at most.
_MOST_AMBIENT = 0.9
# An element is a lamp when it emits this many times what arrives at a typical one.
_LAMP = 3.0


@dataclass(frozen=True, eq=False)
class Look:
    """Links of elements to the lamps alone.

    Attributes
    ----------
    elements : Elements
    samples : Samples
        Those that look for lamps, for all.
    shining : ndarray of shape (l,)
        Which of them are lamps.
    emission : ndarray of shape (n, 3)
        What those emit, and nothing at the others [W/m^2].
    scenery : Scenery or None
        The lamps alone; None when there is none.
    receivers : Receivers or None
        The samples.
    rows : list of Rows
    typical : float
        Irradiance everywhere if light were spread evenly [W/m^2].
    """

    elements: Elements
    samples: Samples
    shining: Int
    emission: Float
    scenery: Scenery | None
    receivers: Receivers | None
    rows: list[Rows]
    typical: float

    @property
    def rays(self) -> int:
        """How many rays were cast."""
        return sum(rows.rays for rows in self.rows)

    def irradiance(self, sums: Float | None = None) -> Float:
        """Return the light straight from the lamps, shape (n, 3) [W/m^2].

        Parameters
        ----------
        sums : ndarray of shape (n,), optional
            Share of each element's light that meets another: what does not arrive in sum is put right.
        """
        E, A = self.elements.emission[self.shining], self.samples.area
        H = np.zeros((len(A), 3))
        if self.scenery is None or self.receivers is None:
            return np.zeros_like(self.elements.emission)
        sources, order = self.scenery.sources, self.receivers.index
        if sums is not None and len(self.shining) <= MOST_LAMPS:
            received_by = [received(part, self.receivers, A[order], len(sources.area)) for part in self.rows]
            arrives = of_leaves(sources, np.sum(received_by, axis=0))
            power = self.elements.area[self.shining] * E.sum(axis=1)
            E = E * put_right(sources.tree, power * sums[self.shining], power * arrives)[:, None]
        means = node_means(sources, self.elements.area[self.shining], E)
        H[order] = np.concatenate([gather(part, self.receivers, means) for part in self.rows])
        return self.samples.spread(H)


def first_look(
    elements: Elements,
    samples: Samples,
    direct: Float,
    occluders: Surroundings,
    quality: Quality,
    workers: Executor,
) -> Generator[Progress, None, Look]:
    """Link samples of all elements to those that are lamps."""
    E, A = elements.emission, elements.area[:, None]
    grey = min(float((A * elements.reflectance).mean() / A.mean()), _MOST_AMBIENT)
    everywhere = float((A * (E + direct)).sum(axis=0).mean() / A.sum() / (1 - grey)) or 1.0
    bright = E.mean(axis=1) > _LAMP * everywhere
    shining, emission = np.flatnonzero(bright), np.where(bright[:, None], E, 0)
    if not len(shining):
        return Look(elements, samples, shining, emission, None, None, [], everywhere)
    scenery = build_scenery(elements.pick(shining), E[shining], everywhere, occluders)
    receivers = group_receivers(elements.centre[samples.element], elements.normal[samples.element], workers=workers)
    rows: list[Rows] = []
    done = 0
    for part in stream_rows(receivers, scenery, quality.direct, workers):
        rows.append(part)
        done += len(part.group)
        check_memory(rows, done / len(receivers))
        yield Progress(STAGE, done / len(receivers))
    return Look(elements, samples, shining, emission, scenery, receivers, rows, everywhere)


def ambient_guess(
    elements: Elements, direct: Float, look: Look, through: Translucence | None
) -> tuple[Float, Float, float]:
    """Guess what is bright: direct light and an even share of the rest, as shooting displays it.

    Returns
    -------
    radiosity : ndarray of shape (n, 3)
    known : ndarray of shape (n, 3)
        What of it is no guess [W/m^2].
    typical : float
        Irradiance [W/m^2].
    """
    E, rho, A = elements.emission, elements.reflectance, elements.area[:, None]
    first = direct + look.irradiance()
    grey = min(float((A * rho).mean() / A.mean()), _MOST_AMBIENT)
    reflected = scattered(rho, first, through)
    ambient = (A * (reflected + E - look.emission)).sum(axis=0) / A.sum() / (1 - grey)
    typical = typical_irradiance(elements, first + ambient) or look.typical
    return E + reflected + rho * ambient, E + reflected, typical


def typical_irradiance(elements: Elements, irradiance: Float, seen: Float | None = None) -> float:
    """Return the irradiance that errors are judged by: the mean over area and channels [W/m^2].

    Parameters
    ----------
    elements : Elements
    irradiance : ndarray of shape (n, 3)
        What arrives at them [W/m^2].
    seen : ndarray of shape (n,), optional
        Share of its view that other elements fill for each: its row sum. A roof in the sun that sees nothing but the
        sky has no light of others to err in, and would only make dim rooms look as if they did not matter.

    Returns
    -------
    float
    """
    weight = elements.area if seen is None else elements.area * seen
    total = float(weight.sum())
    return float(weight @ irradiance.mean(axis=1)) / total if total > 0 else 0.0
