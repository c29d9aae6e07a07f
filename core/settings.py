# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can choose about a bake: one frozen record, checked when it is made."""

from dataclasses import dataclass
from math import isfinite

from .errors import RadiosityError

METHODS = ("hierarchical", "gathering", "shooting")
FORM_FACTORS = ("exact", "centre", "hemicube")
QUALITIES = ("preview", "medium", "high", "production")
SIDES = ("auto", "front", "back")
LIGHTS = ("combined", "lighting", "direct", "indirect")

DEFAULT_METHOD = "hierarchical"


@dataclass(frozen=True)
class Settings:
    """The choices of one bake.

    Attributes
    ----------
    method : str
        "hierarchical", "gathering" (the dense matrix, T5) or "shooting" (columns of it on demand, T8).
    form_factors : str
        Kernel of the two dense methods: "exact", "centre" (T2) or "hemicube" (T4).
    quality : str
        The one knob of the hierarchical method: "preview", "medium", "high" or "production".
    sides : str
        What has light, of faces whose sides the scene leaves open: "front", "back", or "auto" for where light can
        reach, which may be both.
    light : str
        What the colours tell: "combined", all light that leaves a surface, emitted and reflected; "direct", the part
        that is emitted, or reflected at once from what emits, lamps and sky; "indirect", the part that was reflected
        before, combined = direct + indirect; or "lighting", what a white surface there would reflect, to be multiplied
        with textures.
    max_edge : float or None
        Longest edge that a patch may have [m]; None leaves the mesh as it is.
    subdivide : int
        Factor on the number n of patches along a row of every surface (T12).
    iterations : int
        Sweeps at most; shooting may take as many shots as that many sweeps have patches. 1 is direct light only (T6).
    tolerance : float
        A sweep that changes no radiosity by more than this, relative to it, is the last one (T5); shooting stops
        when less than this fraction of the emitted energy is unshot. 0 makes all iterations.
    seed : int
        Start of the random numbers: same scene, same settings, same bits.

    Raises
    ------
    RadiosityError
        A value outside of what is allowed; the message says what is.
    """

    method: str = DEFAULT_METHOD
    form_factors: str = "exact"
    quality: str = "medium"
    sides: str = "auto"
    light: str = "combined"
    max_edge: float | None = None
    subdivide: int = 1
    iterations: int = 400
    tolerance: float = 1e-4
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what no bake could work with."""
        _check_choice("method", self.method, METHODS)
        _check_choice("form factors", self.form_factors, FORM_FACTORS)
        _check_choice("quality", self.quality, QUALITIES)
        _check_choice("sides", self.sides, SIDES)
        _check_choice("light", self.light, LIGHTS)
        if self.max_edge is not None and not (isfinite(self.max_edge) and self.max_edge > 0.0):
            raise RadiosityError(f"The longest patch edge is {self.max_edge} m: give a length above 0 m, or none.")
        _check_whole("subdivision", self.subdivide, 1)
        _check_whole("number of iterations", self.iterations, 1)
        _check_whole("seed", self.seed, 0)
        if not 0.0 <= self.tolerance < 1.0:
            raise RadiosityError(f"The tolerance is {self.tolerance}: give a number from 0 to below 1, such as 0.0001.")


def _check_choice(name: str, value: str, allowed: tuple[str, ...]) -> None:
    """Refuse a word that is not one of those allowed."""
    if value not in allowed:
        raise RadiosityError(f"The {name} cannot be {value!r}: give one of {', '.join(allowed)}.")


def _check_whole(name: str, value: int, least: int) -> None:
    """Refuse what is not a whole number of at least `least`."""
    if not isfinite(value) or int(value) != value or value < least:
        raise RadiosityError(f"The {name} is {value}: give a whole number from {least} up.")
