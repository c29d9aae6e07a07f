# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles references, made once and kept: two bakes with different random numbers, as many samples as asked for."""

import hashlib
from dataclasses import fields
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from . import cycles
from .geometry import Geometry
from .hidden import hidden_corners

FloatArray = NDArray[np.float64]

# Samples of one bake; what was done so far is kept after each.
PORTION = 256
# Seeds start here, far from those of the bakes that are measured.
FIRST_SEED = 1000


def reference(
    folder: Path, name: str, geometry: Geometry, objects: list[bpy.types.Object], samples: int
) -> tuple[FloatArray, FloatArray]:
    """Return two references of at least `samples` each, and make what is missing of them.

    Parameters
    ----------
    folder : Path
        Where references are kept; a scene that changes gets new files.
    name : str
        Name of the scene.
    geometry : Geometry
        The scene as arrays, to tell a changed one.
    objects : list of bpy.types.Object
        The scene in Blender.
    samples : int
        Cycles samples a corner.

    Returns
    -------
    first, second : ndarray of shape (c, 3)
        Radiance at the corners [W/m^2/sr].
    """
    file = folder / f"{name}-{_digest(geometry)}.npz"
    corners = len(geometry.corner_vertex)
    sums, done = np.zeros((2, corners, 3)), np.zeros(2, dtype=int)
    if file.exists():
        with np.load(file) as kept:
            sums, done = kept["sums"], kept["done"]
    while done.min() < samples:
        which = int(np.argmin(done))
        print(f"{name}: reference {'AB'[which]}, {done[which]} of {samples} samples", flush=True)
        portion, _ = cycles.bake(objects, PORTION, FIRST_SEED + 2 * int(done[which]) // PORTION + which)
        sums[which] += PORTION * portion
        done[which] += PORTION
        _save(file, sums=sums, done=done)
    return sums[0] / done[0], sums[1] / done[1]


def hidden(folder: Path, name: str, geometry: Geometry) -> NDArray[np.bool_]:
    """Return which corners are buried; see `hidden_corners`."""
    file = folder / f"{name}-{_digest(geometry)}-buried.npz"
    if not file.exists():
        _save(file, hidden=hidden_corners(geometry))
    with np.load(file) as kept:
        corners: NDArray[np.bool_] = kept["hidden"]
    return corners


def _digest(geometry: Geometry) -> str:
    """Return a short name for the contents of all arrays."""
    digest = hashlib.sha256()
    for field in fields(geometry):
        digest.update(np.asarray(getattr(geometry, field.name)).tobytes())
    return digest.hexdigest()[:12]


def _save(file: Path, **arrays: NDArray[np.generic]) -> None:
    """Write a file that is there whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_suffix(".part.npz")
    np.savez_compressed(unfinished, **arrays)
    unfinished.replace(file)
