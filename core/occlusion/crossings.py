# SPDX-License-Identifier: GPL-3.0-or-later
"""All surfaces that segments go through, in order: for what does not block, but dims and colors light."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray, SingleArray
from .stragglers import Stragglers
from .stream_tree import Tree, planted
from .streams import cross, segment_rows
from .surfaces import MARGIN, Occluding

# Segments that are asked together: what waits for each other at the nodes of the tree.
_TOGETHER = 1 << 16


class Hits(NamedTuple):
    """Where segments go through surfaces, one segment after the other, each from its origin on.

    Attributes
    ----------
    segment, face : ndarray of shape (h,)
    front : ndarray of shape (h,)
        Whether the segment comes to the face's front.
    cosine : ndarray of shape (h,)
        Of the angle between segment and normal, 0 to 1.
    """

    segment: IntArray
    face: IntArray
    front: BoolArray
    cosine: FloatArray


class Crossings:
    """Tells which surfaces segments go through.

    Parameters
    ----------
    surfaces : Occluding
    """

    def __init__(self, surfaces: Occluding) -> None:
        self._core = surfaces.core
        self._tree = planted(self._core.local(surfaces.vertices)[surfaces.triangles], surfaces.margins)
        self._face = surfaces.triangle_face

    def along(self, origins: FloatArray, targets: FloatArray) -> Hits:
        """Return what segments go through; a surface that an end lies on does not count.

        Parameters
        ----------
        origins, targets : ndarray of shape (m, 3)
            [m].

        Returns
        -------
        Hits
        """
        begin, end, owner = self._core.cut(origins, targets)
        parts: list[tuple[IntArray, IntArray, FloatArray, FloatArray]] = []
        for first in range(0, len(begin) if self._tree else 0, _TOGETHER):
            some = slice(first, first + _TOGETHER)
            piece, met, angle, way = self._met(begin[some], end[some], origins[owner[some]])
            parts.append((owner[some][piece], met, angle, way))
        if not parts:
            return Hits(*(np.zeros(0, kind) for kind in (np.int64, np.int64, bool, float)))
        segment, face, facing, distance = (np.concatenate(column) for column in zip(*parts, strict=True))
        front = facing < 0
        # Faces beside each other reach a little over their common edge: there they are one.
        order = np.lexsort((distance, front, segment))
        segment, distance, side = segment[order], distance[order], front[order]
        again = (segment[1:] == segment[:-1]) & (side[1:] == side[:-1]) & (np.diff(distance) < MARGIN)
        kept = np.append(True, ~again)[: len(order)]
        order, segment, distance = order[kept], segment[kept], distance[kept]
        inward = np.lexsort((distance, segment))
        order = order[inward]
        return Hits(segment[inward], face[order], front[order], np.abs(facing[order]))

    def _met(
        self, begin: FloatArray, end: FloatArray, origin: FloatArray
    ) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
        """Return of each meeting the segment, the face, how it goes with the normal, and how far from its origin."""
        assert self._tree is not None
        segments, crossing = segment_rows(self._core, begin, end), np.zeros(len(begin), dtype=bool)
        # Most go through nothing, and to ask whether they do is several times as fast as to ask where.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            cross(self._tree, segments, np.arange(len(begin)), crossing)
        found = _Found(self._tree, segments)
        found.add(0, np.flatnonzero(crossing))
        found.finish()
        who, which = found.pairs()
        row, at = self._tree.polygons.rows[0].take(which, axis=0).T.astype(float), segments.take(who, axis=1)
        rise = (row[:3] * at[4:7]).sum(axis=0)
        share = -((row[:3] * at[:3]).sum(axis=0) + row[3]) / rise
        half = np.linalg.norm(at[4:7].astype(float), axis=0)
        place = at[:3] + share * at[4:7]
        distance = np.linalg.norm(place.T - self._core.local(origin)[who], axis=1)
        return who, self._face[self._tree.polygons.first[which]], rise / half, distance


class _Found(Stragglers):
    """Keeps what meets instead of marking it."""

    def __init__(self, tree: Tree, segments: SingleArray) -> None:
        super().__init__(tree, segments, np.zeros(segments.shape[1], dtype=bool))
        self._met: list[tuple[IntArray, IntArray]] = []

    def mark(self, segment: IntArray, polygon: IntArray) -> None:
        self._met.append((segment, polygon))

    def pairs(self) -> tuple[IntArray, IntArray]:
        """Return segments and polygons that meet."""
        none = np.zeros(0, dtype=np.int64)
        who, which = (np.concatenate([none, *column]) for column in zip((none, none), *self._met, strict=True))
        return who, which
