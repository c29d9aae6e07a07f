# SPDX-License-Identifier: GPL-3.0-or-later
"""Who sees whom: occlusion of many segments at once, against surfaces and not patches (T14).

A surface blocks a segment that crosses it, unless an end of the segment lies in the surface's plane, within `MARGIN`:
so a surface never blocks what starts on it or runs along it, nor what starts on a coplanar neighbour, however shallow.
That is a test of heights over the plane and not of distances along the segment. Where two surfaces touch, a point on
both is blocked by neither, and closed bodies block with their far side.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .occlusion.brute_force import BruteForceOccluders
from .occlusion.panes import Panes, find_panes
from .occlusion.single_rays import SingleRays, single_rays
from .occlusion.streams import StreamOccluders
from .occlusion.surfaces import Occluding, occluder_polygons

if TYPE_CHECKING:
    from .meshing import Patches
    from .scene import Scene

# Streams want segments: half as many as there are triangles, or as many as are enough for any tree; measured.
FEW, ENOUGH = 0.5, 2048


class Occluders(Protocol):
    """Something that blocks light; safe to ask from several threads."""

    def blocked(self, origins: FloatArray, targets: FloatArray) -> BoolArray:
        """Return for each segment whether a surface crosses it strictly between its ends.

        Parameters
        ----------
        origins, targets : ndarray of shape (m, 3)
            On surfaces or anywhere else [m].

        Returns
        -------
        ndarray of shape (m,)
            The same with origins and targets exchanged.
        """
        ...


class Surroundings(Occluders, Protocol):
    """Occluders that also tell what a ray meets first."""

    def nearest(self, origins: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return face, distance and whether the front was hit; see `BruteForceOccluders.nearest`."""
        ...


def scene_occluders(scene: Scene, patches: Patches) -> SurfaceOccluders:
    """Return what blocks light in a scene.

    Parameters
    ----------
    scene : Scene
    patches : Patches
        How the scene is meshed: what blocks is what is lit.

    Returns
    -------
    SurfaceOccluders
    """
    found = SurfaceOccluders(occluder_polygons(scene, patches))
    found.panes = find_panes(scene, scene.occludes)
    if not np.array_equal(scene.occludes, scene.shades):
        found.for_sky = SurfaceOccluders(occluder_polygons(scene, patches, scene.shades))
        found.for_sky.panes = find_panes(scene, scene.shades)
    return found


def sky_occluders(occluders: Occluders) -> Occluders:
    """Return what blocks the light of the sky where all other light is blocked by `occluders`."""
    return occluders.for_sky or occluders if isinstance(occluders, SurfaceOccluders) else occluders


def panes_of(occluders: Occluders) -> Panes | None:
    """Return what gives its color to light where `occluders` do not block."""
    return occluders.panes if isinstance(occluders, SurfaceOccluders) else None


def dimmed(
    origins: FloatArray, targets: FloatArray, clear: BoolArray, occluders: Occluders
) -> tuple[FloatArray, FloatArray]:
    """Return how much panes, whatever their color, let through of light that has no colors of its own.

    Parameters
    ----------
    origins, targets : ndarray of shape (m, 3)
        Segments, from receivers to where their light comes from [m].
    clear : ndarray of shape (m,)
        Those that nothing blocks.
    occluders : Occluders

    Returns
    -------
    share, left : ndarray of shape (m,)
        That, and what is left of the place that it comes from, see `Panes.through`; 1 where something blocks.
    """
    share, left = np.ones(len(clear)), np.ones(len(clear))
    panes = panes_of(occluders)
    if panes is not None:
        some = np.flatnonzero(clear)
        tint, left[some] = panes.through(origins[some], targets[some])
        share[some] = tint.mean(axis=1)
    return share, left


class SurfaceOccluders:
    """Streams of segments where there are many of them, Blender's tree for the rest: whatever is faster.

    Parameters
    ----------
    occluding : Occluding
        Surfaces that block.

    Attributes
    ----------
    for_sky : SurfaceOccluders or None
        What blocks the light of the sky, where that is something else.
    panes : Panes or None
        What does not block, but gives its color to what goes through.
    """

    def __init__(self, occluding: Occluding) -> None:
        self.for_sky: SurfaceOccluders | None = None
        self.panes: Panes | None = None
        self._occluding = occluding
        self._stream = StreamOccluders(occluding)

    @cached_property
    def _single(self) -> SingleRays:
        """Return who is asked for a few segments, and for what is nearest: grown only when it is needed."""
        return single_rays(self._occluding)

    def blocked(self, origins: FloatArray, targets: FloatArray) -> BoolArray:
        """Return for each segment, shape (m,), whether a surface crosses it; see `Occluders`."""
        enough = len(origins) >= min(FEW * len(self._occluding.triangles), ENOUGH)
        # Outside Blender there are streams for everything, except for what is nearest.
        if enough or isinstance(self._single, BruteForceOccluders):
            return self._stream.blocked(origins, targets)
        return self._single.blocked(origins, targets)

    def nearest(self, origins: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return face, distance and side of what rays hit first; see `BruteForceOccluders.nearest`."""
        return self._single.nearest(origins, directions)
