# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles on a receiver, fine enough that the shadow of no blocker is overlooked."""

import numpy as np
from numpy.typing import NDArray

from .convex_parts import area_vector, in_front
from .part_views import View

FloatArray = NDArray[np.float64]

# Triangles that every receiver is cut into at least.
FEWEST = 16
# Triangles are smaller than this share of their distance from a blocker, or than its width.
NEARNESS = 0.5
# A triangle is small enough when what it may overlook is this share of the tolerance.
OVERLOOKED = 0.1


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
    done: list[FloatArray] = []
    while len(cells):
        areas = triangle_areas(cells)
        split = (areas > largest) | _overlooking(cells, areas, view, tolerance)
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
            across = np.cross(normal, along) / np.linalg.norm(along)
            sides = (
                in_front(piece, side * ((piece - touching[0]) @ across), view.margin)
                for piece in pieces
                for side in (1, -1)
            )
            pieces = [side for side in sides if len(side)]
    return pieces


def _overlooking(cells: FloatArray, areas: FloatArray, view: View, tolerance: float) -> NDArray[np.bool_]:
    """Return which triangles may hold between their points what the cubature should see.

    A blocker of width w, d away from the receiver and e from a source of width s, has a shadow of width
    w + (w + s) d / e, penumbra included, and what it hides varies over lengths of d. By reciprocity all it can hide is
    twice its own area. An edge that runs close above the receiver has a shadow with a border as narrow as its height.
    """
    centres = cells.mean(axis=1)
    radii = np.linalg.norm(cells - centres[:, None], axis=2).max(axis=1)
    source_width, source_centre = polygon_width(view.second), view.second.mean(axis=0)
    enough = OVERLOOKED * tolerance
    split = np.zeros(len(cells), dtype=bool)
    for blocker in view.blockers:
        width, area = polygon_width(blocker), float(np.linalg.norm(area_vector(blocker)))
        beyond = max(float(np.linalg.norm(blocker.mean(axis=0) - source_centre)), view.margin)
        heights = (blocker - view.first[0]) @ view.normals[0]
        distance, border, height = _distances(centres, blocker, heights)
        shadow = width + min(NEARNESS, (width + source_width) / beyond) * distance
        split |= (radii > shadow) & (np.minimum(areas, 2 * area) > enough)
        split |= (radii > border) & (np.minimum(areas, 4 * radii * height) > enough)
    return split


def polygon_width(corners: FloatArray) -> float:
    """Return the least distance between two parallel lines that a convex polygon fits between [m]."""
    edges = np.roll(corners, -1, axis=0) - corners
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    arms = corners[None] - corners[:, None]
    off = arms - np.sum(arms * edges[:, None], axis=2, keepdims=True) * edges[:, None]
    return float(np.min(np.linalg.norm(off, axis=2).max(axis=1)))


def _distances(
    points: FloatArray, corners: FloatArray, heights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the distances of points from a convex polygon and from its border, and the height where that is closest.

    Parameters
    ----------
    points : ndarray of shape (m, 3)
    corners : ndarray of shape (k, 3)
    heights : ndarray of shape (k,)
        Of the corners; heights of edges in between are linear.

    Returns
    -------
    three ndarrays of shape (m,)
        [m]
    """
    following = np.roll(np.arange(len(corners)), -1)
    edges = corners[following] - corners
    normal = area_vector(corners) / np.linalg.norm(area_vector(corners))
    arms = points[:, None] - corners
    share = np.clip(np.sum(arms * edges, axis=2) / np.sum(edges * edges, axis=1), 0, 1)
    to_edges = np.linalg.norm(arms - share[:, :, None] * edges, axis=2)
    above = heights + share * (heights[following] - heights)
    closest = np.argmin(to_edges, axis=1)
    rows = np.arange(len(points))
    border = to_edges[rows, closest]
    inside = (np.sum(arms * np.cross(normal, edges), axis=2) >= 0).all(axis=1)
    return np.where(inside, np.abs(arms[:, 0] @ normal), border), border, above[rows, closest]


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
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(np.linalg.norm(normals, axis=1) / 2)
