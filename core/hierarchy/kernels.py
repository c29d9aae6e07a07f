# SPDX-License-Identifier: GPL-3.0-or-later
"""Form factors from receivers to nodes of the hierarchy, without visibility."""

import numpy as np
from numpy.typing import NDArray

from ..form_factors import point_to_polygon
from .sources import Sources, shown_area
from .tree import Float, Int
from .vectors import dots, picked

Single = NDArray[np.float32]

# Pairs worked on at a time: their temporaries stay in a core's second-level cache.
_BLOCK = 8192
_TINY = np.float32(1e-36)


def far_form_factors(point: Float, normal: Float, sources: Sources, node: Int) -> Single:
    """Integrate the kernel over far nodes: by four points each, or by the area that a wide node shows.

    Parameters
    ----------
    point, normal : ndarray of shape (k, 3)
        Receivers [m], pair by pair.
    sources : Sources
    node : ndarray of shape (k,)

    Returns
    -------
    ndarray of shape (k,)
    """
    factors = np.zeros(len(node), np.float32)
    wide = sources.wide[node]
    told = np.flatnonzero(wide)
    if len(told):
        factors[told] = _by_shown_area(picked(point, told), picked(normal, told), sources, node[told])
        told = np.flatnonzero(~wide)
        factors[told] = _by_points(picked(point, told), picked(normal, told), sources, node[told])
        return factors
    return _by_points(point, normal, sources, node)


def _by_shown_area(point: Float, normal: Float, sources: Sources, node: Int) -> Single:
    """Return form factors of nodes that look in many directions, as bodies of the area that they show."""
    factors = np.zeros(len(node), np.float32)
    for first in range(0, len(node), _BLOCK):
        part = slice(first, first + _BLOCK)
        s = node[part]
        to: Single = (picked(sources.centre, s) - point[part]).astype(np.float32)
        squared = np.maximum(dots(to, to), _TINY)
        distance = np.sqrt(squared)
        shown = shown_area(sources, s, -to / distance[:, None]).astype(np.float32)
        # The mean height over the horizon, of a ball of the node's radius: a part of it may be below.
        height = dots(normal[part].astype(np.float32), to)
        reach = np.maximum(sources.radius[s].astype(np.float32), 1e-6 * distance)
        above = np.clip(height + reach, 0, 2 * reach)
        height = np.where(height > reach, height, above * above / (4 * reach))
        factors[part] = shown * height / (np.pi * squared * distance)
    return factors


def _by_points(point: Float, normal: Float, sources: Sources, node: Int) -> Single:
    """Return form factors by the four points of each node."""
    factors = np.zeros(len(node), np.float32)
    for first in range(0, len(node), _BLOCK):
        part = slice(first, first + _BLOCK)
        p = np.ascontiguousarray(point[part].T)
        n = np.ascontiguousarray(normal[part].T, dtype=np.float32)
        s = node[part]
        q = picked(sources.quadrature, s).transpose(1, 2, 0)
        v = picked(sources.vector, s).transpose(1, 2, 0).astype(np.float32)
        total = np.zeros(p.shape[1], np.float32)
        for k in range(4):
            # The difference in double precision: a scene may lie far from the origin.
            x, y, z = (q[k] - p).astype(np.float32)
            squared = x * x + y * y + z * z
            here = np.maximum(n[0] * x + n[1] * y + n[2] * z, 0)
            there = np.maximum(-(v[k, 0] * x + v[k, 1] * y + v[k, 2] * z), 0)
            total += here * there / np.maximum(squared * squared, _TINY)
        factors[part] = total / np.pi
    return factors


def near_form_factors(point: Float, normal: Float, polygons: Float) -> Single:
    """Integrate the kernel over near patches exactly, see `form_factors.point_to_polygon`."""
    factors: Single = point_to_polygon(point, normal, polygons).astype(np.float32)
    return factors
