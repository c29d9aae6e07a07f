# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles on a receiver, fine enough that the shadow of no blocker is overlooked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray
from .convex_parts import area_vector, cross, in_front
from .part_views import View

# Triangles that every receiver is cut into at least.
FEWEST = 16
# Triangles are smaller than this share of their distance from a blocker, or than its width.
NEARNESS = 0.5
# A triangle is small enough when what it may overlook is this share of the tolerance.
OVERLOOKED = 0.1
# How far off the mean of the hidden factor may be in a triangle that holds a corner of a blocker.
CORNER = 0.1


def receiver_cells(view: View, tolerance: float) -> FloatArray:
    """Return a view's first polygon as triangles.

    They do not cross the lines where blockers touch the receiver, since the visible factor jumps there, and are no
    larger than a blocker's shadow wherever that matters.

    Parameters
    ----------
    view : View
    tolerance : float
        Allowed error of the view's exchange area [m^2].

    Returns
    -------
    ndarray of shape (t, 3, 3)
        Corners [m].
    """
    pieces = _cut_at_contacts(view)
    fans = [np.stack((piece[[0] * (len(piece) - 2)], piece[1:-1], piece[2:]), axis=1) for piece in pieces]
    cells = np.concatenate(fans)
    cells = cells[triangle_areas(cells) > 0]
    largest = triangle_areas(cells).sum() / FEWEST
    casters = [_caster(blocker, view) for blocker in view.blockers]
    done: list[FloatArray] = []
    while len(cells):
        areas = triangle_areas(cells)
        split = (areas > largest) | _overlooking(cells, areas, casters, OVERLOOKED * tolerance)
        done.append(cells[~split])
        cells = halved(cells[split])
    return np.concatenate(done)


def _cut_at_contacts(view: View) -> list[FloatArray]:
    """Return a view's first polygon in convex pieces, cut along the lines where blockers touch it."""
    pieces = [view.first]
    normal = view.normals[0]
    for blocker in view.blockers:
        touching = blocker[np.abs((blocker - view.first[0]) @ normal) <= view.margin]
        if len(touching) >= 2:
            # The two corners in contact that are furthest apart hold the line.
            along = touching[np.argmax(np.linalg.norm(touching - touching[0], axis=1))] - touching[0]
            across = cross(normal, along) / np.linalg.norm(along)
            sides = (
                in_front(piece, side * ((piece - touching[0]) @ across), view.margin)
                for piece in pieces
                for side in (1, -1)
            )
            pieces = [side for side in sides if len(side)]
    return pieces


@dataclass(frozen=True, eq=False)
class _Caster:
    """A blocker as what casts shadows on a receiver.

    Attributes
    ----------
    corners, edges, inward : ndarray of shape (k, 3)
        Corners, the edges after them, and unit vectors from these into the polygon [m].
    normal : ndarray of shape (3,)
    heights, rises : ndarray of shape (k,)
        Heights of the corners above the receiver, and what the edges after them add to them [m].
    contacts : ndarray of shape (c, 3)
        Corners that touch the receiver.
    width, area, widening : float
        Least width [m] and area [m^2]; what a shadow's width grows by per metre of distance.
    """

    corners: FloatArray
    edges: FloatArray
    inward: FloatArray
    normal: FloatArray
    heights: FloatArray
    rises: FloatArray
    contacts: FloatArray
    width: float
    area: float
    widening: float


def _caster(blocker: FloatArray, view: View) -> _Caster:
    """Return the measures of a blocker.

    A blocker of width w, d away from the receiver and e from a source of width s, has a shadow of width
    w + (w + s) d / e, penumbra included, and what it hides varies over lengths of d.
    """
    following = np.roll(np.arange(len(blocker)), -1)
    edges = blocker[following] - blocker
    vector = area_vector(blocker)
    area = float(np.linalg.norm(vector))
    heights = (blocker - view.first[0]) @ view.normals[0]
    width = polygon_width(blocker)
    beyond = max(float(np.linalg.norm(blocker.mean(axis=0) - view.second.mean(axis=0))), view.margin)
    return _Caster(
        corners=blocker,
        edges=edges,
        inward=cross(np.broadcast_to(vector / area, edges.shape), edges),
        normal=vector / area,
        heights=heights,
        rises=heights[following] - heights,
        contacts=blocker[heights <= view.margin],
        width=width,
        area=area,
        widening=min(NEARNESS, (width + polygon_width(view.second)) / beyond),
    )


def _overlooking(cells: FloatArray, areas: FloatArray, casters: Sequence[_Caster], enough: float) -> BoolArray:
    """Return which triangles may hold between their points what the cubature should see, by more than enough [m^2].

    By reciprocity all that a blocker can hide is twice its own area. An edge that runs close above the receiver has a
    shadow with a border as narrow as its height. Where a corner touches the receiver, what is hidden depends on the
    direction from there, however close.
    """
    centres = cells.mean(axis=1)
    radii = np.sqrt(np.max(np.sum((cells - centres[:, None]) ** 2, axis=2), axis=1))
    split = np.zeros(len(cells), dtype=bool)
    for caster in casters:
        distance, border, height = _distances(centres, caster)
        shadow = caster.width + caster.widening * distance
        split |= (radii > shadow) & (np.minimum(areas, 2 * caster.area) > enough)
        split |= (radii > border) & (np.minimum(areas, 4 * radii * height) > enough)
        for corner in caster.contacts:
            split |= (radii > np.sqrt(np.sum((centres - corner) ** 2, axis=1))) & (CORNER * areas > enough)
    return split


def polygon_width(corners: FloatArray) -> float:
    """Return the least distance between two parallel lines that a convex polygon fits between [m]."""
    edges = np.roll(corners, -1, axis=0) - corners
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    arms = corners[None] - corners[:, None]
    off = arms - np.sum(arms * edges[:, None], axis=2, keepdims=True) * edges[:, None]
    return float(np.min(np.linalg.norm(off, axis=2).max(axis=1)))


def _distances(points: FloatArray, caster: _Caster) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the distances of points from a blocker and from its border, and the height where that is closest.

    Parameters
    ----------
    points : ndarray of shape (m, 3)
    caster : _Caster

    Returns
    -------
    three ndarrays of shape (m,)
        [m]
    """
    arms = points[:, None] - caster.corners
    share = np.sum(arms * caster.edges, axis=2) / np.sum(caster.edges**2, axis=1)
    share = np.minimum(np.maximum(share, 0), 1)
    to_edges = np.sum((arms - share[:, :, None] * caster.edges) ** 2, axis=2)
    closest = (np.arange(len(points)), np.argmin(to_edges, axis=1))
    border = np.sqrt(to_edges[closest])
    inside = (np.sum(arms * caster.inward, axis=2) >= 0).all(axis=1)
    distance = np.where(inside, np.abs(arms[:, 0] @ caster.normal), border)
    return distance, border, (caster.heights + share * caster.rises)[closest]


def halved(triangles: FloatArray) -> FloatArray:
    """Cut triangles through the middles of their longest edges; first all first halves, then all second ones."""
    edges = np.roll(triangles, -1, axis=1) - triangles
    longest = np.argmax(np.sum(edges * edges, axis=2), axis=1)
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (longest + k) % 3] for k in range(3))
    middle = (a + b) / 2
    return np.concatenate((np.stack((a, middle, c), axis=1), np.stack((middle, b, c), axis=1)))


def triangle_areas(triangles: FloatArray) -> FloatArray:
    """Return the areas of triangles, shape (t, 3, 3) [m^2]."""
    normals = cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(np.linalg.norm(normals, axis=1) / 2)
