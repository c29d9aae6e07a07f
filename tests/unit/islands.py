# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that are put together island by island, for tests of which sides have light."""

import numpy as np

from core.scene import AUTO, Scene

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


def sheet(low, high, *, up=True):
    """Return a horizontal rectangle."""
    corners = low + SQUARE * (*(np.array(high) - low[:2]), 1.0)
    return corners if up else corners[::-1]


def upright(x, y, z, *, right=True):
    """Return a rectangle across the x axis, over ranges of y and z, that faces along the axis or against it."""
    corners = np.array([(x, y[0], z[0]), (x, y[1], z[0]), (x, y[1], z[1]), (x, y[0], z[1])], float)
    return corners if right else corners[::-1]


class Things:
    """A scene that is put together object by object, each with vertices of its own."""

    def __init__(self):
        self.polygons, self.emission, self.names, self.of, self.chosen = [], [], [], [], []

    def add(self, name, polygons, emission=0.0, sides=AUTO):
        if name not in self.names:
            self.names.append(name)
        self.polygons += list(polygons)
        self.of += [self.names.index(name)] * len(polygons)
        self.emission += [emission] * len(polygons)
        self.chosen += [sides] * len(polygons)
        return self

    def scene(self, **fields):
        emission = np.repeat(np.array(self.emission)[:, None], 3, axis=1)
        return Scene.from_polygons(
            self.polygons, 0.5, emission, sides=self.chosen, face_object=self.of, object_names=self.names, **fields
        )
