# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat polygons to cut and to look at each other, and what holds for the factors between any polygons."""

import numpy as np

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
TRIANGLE = SQUARE[:3]
ELL = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)], dtype=float)
ARROW = np.array([(0, 0, 0), (2, 1, 0), (0, 2, 0), (0.5, 1, 0)], dtype=float)
NEEDLE = np.array([(0, 0, 0), (10, 0, 0), (10, 0.2, 0)])
FLAT = np.array([(0, 0, 0), (10, 0, 0), (4, 0.3, 0)])
LINE = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0)], dtype=float)


def square(side, height=0.0, *, up=True):
    corners = side * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]) + (0, 0, height)
    return corners if up else corners[::-1]


def disc(n_sides, radius, height, *, up=True):
    angle = 2 * np.pi * np.arange(n_sides) / n_sides
    corners = np.column_stack((radius * np.cos(angle), radius * np.sin(angle), np.full(n_sides, float(height))))
    return corners if up else corners[::-1]


def area(polygon):
    arms = polygon - polygon[0]
    return np.linalg.norm(np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0)) / 2


def areas(polygons):
    return np.array([area(np.asarray(polygon)) for polygon in polygons])


def turned(polygons, angle, about):
    c, s = np.cos(angle), np.sin(angle)
    return [(p - about) @ np.array([(c, s, 0), (-s, c, 0), (0, 0, 1)]) + about for p in polygons]


def check_reciprocity(F, A):
    exchange = A[:, None] * F
    np.testing.assert_allclose(exchange, exchange.T, rtol=1e-12, atol=1e-15 * A.max())
