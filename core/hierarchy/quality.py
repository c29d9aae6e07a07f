# SPDX-License-Identifier: GPL-3.0-or-later
"""The one knob: how finely light is followed at each quality."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Detail:
    """How finely the links of one set of receivers are told apart.

    Attributes
    ----------
    angle : float
        A node is opened when its radius exceeds this times its distance.
    error : float
        ... or when its estimated error exceeds this share of a typical irradiance.
    ray : float
        A link gets one more ray for each such share of a typical irradiance that it may carry.
    most_rays : int
        For one link and receiver.
    """

    angle: float
    error: float
    ray: float
    most_rays: int


@dataclass(frozen=True)
class Quality:
    """What a quality means.

    Attributes
    ----------
    split : float
        Patches are split until an element can misplace no more than this share of the emitted power.
    size : float
        ... and until none is larger than this share of the scene's diagonal.
    pilot : Detail
        For the first look at who is bright.
    solve : Detail
        For the solution at the elements.
    gather : Detail
        For the final gather at the corners.
    """

    split: float
    size: float
    pilot: Detail
    solve: Detail
    gather: Detail


_PILOT = Detail(0.7, 0.05, 0.1, 4)

QUALITIES = {
    "preview": Quality(1e-3, 1 / 16, _PILOT, Detail(1.0, 0.03, 0.05, 4), Detail(0.8, 0.03, 0.03, 8)),
    "medium": Quality(1e-4, 1 / 32, _PILOT, Detail(0.7, 0.01, 0.02, 8), Detail(0.5, 0.005, 0.01, 16)),
    "high": Quality(3e-5, 1 / 48, _PILOT, Detail(0.5, 0.004, 0.01, 16), Detail(0.4, 0.002, 0.005, 32)),
    "production": Quality(1e-5, 1 / 64, _PILOT, Detail(0.35, 0.001, 0.004, 32), Detail(0.3, 0.0007, 0.002, 64)),
}
