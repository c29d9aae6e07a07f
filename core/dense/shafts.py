# SPDX-License-Identifier: GPL-3.0-or-later
"""What could stand between two groups of patches: shaft culling over compact groups.

Rays are the dear part of a dense matrix, and most of them are not needed: where no surface enters the convex hull of
two groups (their shaft), all their patches see each other; elsewhere only the few surfaces that enter it can block.

References
----------
E. Haines, J. Wallace, Shaft culling for efficient ray-traced radiosity, Eurographics Workshop on Rendering 1991.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..occlusion.surfaces import MARGIN, Occluding

GROUP_SIZE = 192
# Directions around the axis of a shaft that its sides are tried in.
AROUND = 8


@dataclass(frozen=True, eq=False)
class Blockers:
    """Triangles and parallelograms as the planes that the tests need.

    Attributes
    ----------
    corners : ndarray of shape (t, 4, 3)
        World space [m]; a triangle repeats its last corner.
    edges : ndarray of shape (t,)
        3 or 4.
    planes : ndarray of shape (t, 5, 4)
        Each one's own plane and those that stand on its edges, facing in: (unit normal, offset), so that
        normal . x + offset is the distance of x from the plane. A triangle leaves the last one out.
    margin : ndarray of shape (t,)
        A point this close to the plane lies on the surface [m].
    """

    corners: FloatArray
    edges: IntArray
    planes: FloatArray
    margin: FloatArray


def as_blockers(occluding: Occluding) -> Blockers:
    """Prepare the surfaces that block light.

    Parameters
    ----------
    occluding : Occluding

    Returns
    -------
    Blockers
        Both halves of a parallelogram become one; triangles without area are left out, since they block nothing.
    """
    corners = occluding.vertices[occluding.triangles]
    edge = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(edge[:, 0], edge[:, 1])
    length = np.linalg.norm(normal, axis=1)
    real = length > 1e-12 * np.max(np.square(edge).sum(axis=2), axis=1, initial=0.0)

    # The second half of a, b, c, d follows as a, c, d; it becomes the fourth corner of the first.
    twin = np.flatnonzero(_twins(corners) & real[:-1] & real[1:])
    outline = np.concatenate((corners, corners[:, 2:]), axis=1)
    outline[twin, 3] = corners[twin + 1, 2]
    edges = np.full(len(corners), 3)
    edges[twin] = 4
    real[twin + 1] = False
    outline, edges, normal = outline[real], edges[real], normal[real] / length[real, None]

    # Along a, b, c, d, a; a triangle's third edge goes back to its first corner and the fourth is not used.
    triangle = edges == 3
    following = np.roll(outline, -1, axis=1)
    following[triangle, 2] = outline[triangle, 0]
    inward = np.cross(normal[:, None], following - outline)
    width = np.linalg.norm(inward, axis=2, keepdims=True)
    normals = np.concatenate((normal[:, None], inward / np.where(width > 0, width, 1.0)), axis=1)
    offset = -(normals * np.concatenate((outline[:, :1], outline), axis=1)).sum(axis=2)
    margin = MARGIN * occluding.diagonal + np.broadcast_to(occluding.slack, len(real))[real]
    margin = margin + MARGIN * occluding.diagonal * occluding.core.away(outline[:, :3])
    return Blockers(outline, edges, np.concatenate((normals, offset[..., None]), axis=2), margin)


def _twins(corners: FloatArray) -> BoolArray:
    """Return which triangles are the first half of a parallelogram whose second half follows, shape (t - 1,)."""
    first, second = corners[:-1], corners[1:]
    shared = (first[:, 0] == second[:, 0]).all(axis=1) & (first[:, 2] == second[:, 1]).all(axis=1)
    span = np.ptp(first, axis=1).max(axis=1, initial=0.0)
    gap = np.abs(first[:, 0] + first[:, 2] - first[:, 1] - second[:, 2]).max(axis=1, initial=0.0)
    twin = shared & (gap <= 1e-6 * span)
    # Of three in a row only the first two can be.
    twin[1:] &= ~twin[:-1]
    return np.asarray(twin)


def compact_groups(centres: FloatArray, normals: FloatArray, size: int = GROUP_SIZE) -> list[IntArray]:
    """Split patches into groups that are close together and look the same way.

    Parameters
    ----------
    centres : ndarray of shape (n, 3)
        Patch centres [m].
    normals : ndarray of shape (n, 3)
        Unit normals.
    size : int
        Patches in a group at most.

    Returns
    -------
    list of ndarray
        Indices of the patches of each group; every patch is in one.
    """
    extent = float(np.max(np.ptp(centres, axis=0), initial=0.0)) or 1.0
    # Normals count twice as much as the place, so that walls come apart before they are cut up.
    features = np.concatenate((centres / extent, 2.0 * normals), axis=1)
    groups: list[IntArray] = []
    waiting = [np.arange(len(centres))]
    while waiting:
        members = waiting.pop()
        if len(members) <= size and _even(normals[members]):
            groups.append(members)
            continue
        own = features[members]
        low, high = own.min(axis=0), own.max(axis=0)
        axis = int(np.argmax(high - low))
        lower = own[:, axis] < 0.5 * (low[axis] + high[axis])
        # Many patches in one place: any half will do.
        if not lower.any():
            lower[: len(lower) // 2] = True
        waiting += [members[~lower], members[lower]]
    return groups


def _even(normals: FloatArray) -> bool:
    """Return whether a group need not be split for its normals' sake: few patches, or within a hemisphere or so."""
    return len(normals) <= GROUP_SIZE // 8 or float(np.max(np.ptp(normals, axis=0))) < 1.0


def between(first: FloatArray, second: FloatArray, blockers: Blockers) -> IntArray:
    """Return the triangles that could block light between two clouds of points.

    Parameters
    ----------
    first, second : ndarray of shape (m, 3), (k, 3)
        Corners of the patches of each group [m].
    blockers : Blockers

    Returns
    -------
    ndarray
        Indices of triangles that no tried plane parts from the convex hull of both clouds.
    """
    if not len(blockers.corners):
        return np.zeros(0, dtype=np.int64)
    cloud = np.concatenate((first, second))
    directions = _directions(second.mean(axis=0) - first.mean(axis=0))
    along = cloud @ directions.T
    low, high = along.min(axis=0), along.max(axis=0)
    spans = blockers.corners.reshape(-1, 3) @ directions.T
    # On the hull is not in it: light goes between points inside of the patches.
    apart = (spans <= low).reshape(-1, 4, len(low)).all(axis=1) | (spans >= high).reshape(-1, 4, len(low)).all(axis=1)
    left = np.flatnonzero(~apart.any(axis=1))
    # All of both groups on one side of the triangle.
    height = cloud @ blockers.planes[left, 0, :3].T + blockers.planes[left, 0, 3]
    crossed = (height.max(axis=0) > blockers.margin[left]) & (height.min(axis=0) < -blockers.margin[left])
    return np.asarray(left[crossed])


def _directions(axis: FloatArray) -> FloatArray:
    """Return the coordinate axes, the axis of a shaft and directions around it, shape (k, 3)."""
    length = float(np.linalg.norm(axis))
    w = axis / length if length > 0 else np.array([1.0, 0.0, 0.0])
    u = np.cross(w, np.eye(3)[np.argmin(np.abs(w))])
    u = u / np.linalg.norm(u)
    angle = np.arange(AROUND) * (np.pi / AROUND)
    around = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * np.cross(w, u)
    return np.concatenate((np.eye(3), w[None], around))
