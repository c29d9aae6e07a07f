# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of a bake: what was lit, how well the form factors close, where the energy went, and what it cost."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from .arrays import FloatArray
from .scene import Scene
from .solution import Solution


@dataclass(frozen=True)
class RowSums:
    """Share of a patch's light that meets another patch: 1 where none escapes; off by the form factors' error.

    Attributes
    ----------
    min, mean, max : float
        Over all patches, the mean weighted by their areas.
    """

    min: float
    mean: float
    max: float


@dataclass(frozen=True)
class Energy:
    """Where the light went, red, green and blue together.

    Attributes
    ----------
    emitted, absorbed, escaped : float
        Sum of A E, of A (1 - rho - tau) H, and of A B (1 - share that meets a patch) [W].
    error : float
        abs(emitted - absorbed - escaped) / emitted.
    """

    emitted: float
    absorbed: float
    escaped: float
    error: float


@dataclass(frozen=True)
class Report:
    """Figures of one bake.

    Attributes
    ----------
    scene : dict
        Numbers of objects, faces and vertices.
    islands : dict
        How many sets of connected faces have light on their front, their back, or both.
    patches : int
        What the faces were cut into.
    links : int
        Pairs that exchange light, as the method keeps them.
    rays : int
        Segments that were tested for visibility.
    iterations : int
        Sweeps; for shooting, shots.
    converged : bool
        Whether the tolerance was met.
    residual : float
        What the tolerance was compared with last.
    row_sum : RowSums
    reciprocity : float or None
        Mean difference of A_i F_ij and A_j F_ji over their mean; None where not known.
    energy : Energy
    seconds : dict
        Time of each stage: read, mesh, form_factors, solve, shade, write, total; those outside the core are added by
        whoever does them.
    peak_memory_mb : float
        Most memory that the process has held since it started [MB].
    objects : list of dict
        Name and number of corners of each object.
    warnings : list of str
        What was put right, left out, or should be looked at.
    settings : dict
        The choices that were made.
    """

    scene: dict[str, int]
    islands: dict[str, int]
    patches: int
    links: int
    rays: int
    iterations: int
    converged: bool
    residual: float
    row_sum: RowSums
    reciprocity: float | None
    energy: Energy
    seconds: dict[str, float]
    peak_memory_mb: float
    objects: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    settings: dict[str, Any] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the report as numbers, strings, lists and dicts that JSON can hold."""
        return asdict(self)


def row_sum_range(row_sums: FloatArray, area: FloatArray) -> RowSums:
    """Summarise row sums.

    Parameters
    ----------
    row_sums : ndarray of shape (n,)
        NaN where not known.
    area : ndarray of shape (n,)
        Patch areas [m^2]; those without area do not count.

    Returns
    -------
    RowSums
        All 0 when nothing is known.
    """
    known = np.isfinite(row_sums) & (area > 0.0)
    if not known.any():
        return RowSums(0.0, 0.0, 0.0)
    sums, weights = row_sums[known], area[known]
    return RowSums(float(np.min(sums)), float(np.average(sums, weights=weights)), float(np.max(sums)))


def energy_balance(
    area: FloatArray, emission: FloatArray, albedo: FloatArray, solution: Solution, sent: FloatArray
) -> Energy:
    """Add up where the light of a solution went.

    Parameters
    ----------
    area : ndarray of shape (n,)
        [m^2].
    emission, albedo : ndarray of shape (n, 3)
        E [W/m^2], and what leaves again of what arrives: rho, or rho + tau.
    solution : Solution
    sent : ndarray of shape (n,)
        Share of each patch's light that the solver let meet a patch. NaN, for a patch that has not shot, counts as 1:
        its light is still there, and shows up in the error.

    Returns
    -------
    Energy
        What escaped is a little below zero when form factors add up to more than 1.
    """
    A = area[:, None]
    emitted = float((A * emission).sum())
    absorbed = float((A * (1.0 - albedo) * solution.irradiance).sum())
    lost = 1.0 - np.nan_to_num(sent, nan=1.0)[:, None]
    escaped = float((A * solution.radiosity * lost).sum())
    error = abs(emitted - absorbed - escaped) / emitted if emitted else 0.0
    return Energy(emitted, absorbed, escaped, error)


def scene_counts(scene: Scene) -> dict[str, int]:
    """Return the numbers of objects that have faces, of faces, and of vertices that faces use."""
    return {
        "objects": len(np.unique(scene.face_object)),
        "faces": len(scene.face_start) - 1,
        "vertices": len(np.unique(scene.corner_vertex)),
    }


def object_counts(scene: Scene) -> list[dict[str, Any]]:
    """Return name and number of corners of each object; nothing has been written yet."""
    corners = np.bincount(scene.face_object[scene.corner_face], minlength=len(scene.object_names))
    rows: Mapping[str, int] = dict(zip(scene.object_names, corners.tolist(), strict=True))
    return [{"name": name, "corners": count, "written": False} for name, count in rows.items()]
