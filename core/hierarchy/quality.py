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
    samples : int
        Elements that receive indirect light, at most; where there are more, some receive for others.
    corners : int
        The same for the final gather, where there are half as many more.
    direct : Detail
        For light straight from emitters to the elements.
    solve : Detail
        For the solution at the elements.
    gather : Detail
        For the final gather at the corners.
    """

    split: float
    size: float
    samples: int
    corners: int
    direct: Detail
    solve: Detail
    gather: Detail


QUALITIES = {
    "preview": Quality(
        split=1e-3,
        size=1 / 16,
        samples=3_000,
        corners=6_000,
        direct=Detail(0.7, 0.02, 0.05, 4),
        solve=Detail(1.0, 0.008, 0.03, 4),
        gather=Detail(0.8, 0.008, 0.04, 8),
    ),
    "medium": Quality(
        split=1e-4,
        size=1 / 32,
        samples=7_000,
        corners=12_000,
        direct=Detail(0.6, 0.01, 0.02, 8),
        solve=Detail(0.6, 0.001, 0.008, 8),
        gather=Detail(0.5, 0.001, 0.0025, 32),
    ),
    "high": Quality(
        split=3e-5,
        size=1 / 48,
        samples=14_000,
        corners=30_000,
        direct=Detail(0.5, 0.004, 0.01, 16),
        solve=Detail(0.5, 0.0003, 0.003, 16),
        gather=Detail(0.4, 0.0002, 0.0012, 48),
    ),
    "production": Quality(
        split=1e-5,
        size=1 / 64,
        samples=28_000,
        corners=80_000,
        direct=Detail(0.35, 0.001, 0.004, 32),
        solve=Detail(0.35, 0.0002, 0.002, 32),
        gather=Detail(0.3, 0.0001, 0.0008, 64),
    ),
}
