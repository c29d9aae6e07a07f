# SPDX-License-Identifier: GPL-3.0-or-later
"""Light runs on within an element as its corners tell."""

import numpy as np
import pytest

from core.bake import bake
from core.hierarchy.elements import split_patches
from core.hierarchy.sights import Sights
from core.hierarchy.slopes import find_slopes
from core.hierarchy.vantages import corner_receivers
from core.meshing import mesh
from core.progress import exhaust
from core.scene import Scene
from core.settings import Settings
from core.visibility import scene_occluders

QUAD = np.array([(0.0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)])
TRIANGLE = np.array([(0.0, 0, 0), (2, 0, 0), (0.5, 1, 0)])
SKEW = np.array([(0.0, 0, 0), (2, 0, 0), (1.5, 1, 0), (0.2, 0.8, 0)])


@pytest.mark.parametrize("polygon", [QUAD, TRIANGLE, SKEW])
def test_even_slopes_are_told_exactly(polygon):
    scene = Scene.from_polygons([polygon, QUAD + (0, 0, 9)], 0.5, 0.0)
    patches = mesh(scene)
    elements = split_patches(patches, scene_occluders(scene, patches), tolerance=1, size=1)
    corners = corner_receivers(scene)
    place = np.array([polygon.mean(axis=0) + (0.1, 0.2, 0), polygon[1], polygon[0]])
    sights = Sights(np.array([4, 5, 6]), np.zeros(3, int), np.array([0.1, 0.2, 0.3]), place)
    slopes = find_slopes(sights, scene, corners, elements, patches)
    assert np.bincount(slopes.receiver, slopes.share) == pytest.approx(0, abs=1e-9)
    gradient = np.array((0.3, -0.7, 0))
    light = np.zeros(len(corners.point))
    light[corners.group] = 5 + scene.vertices[scene.corner_vertex] @ gradient
    told = np.bincount(slopes.receiver, slopes.share * light[slopes.corner])[4:7]
    # Nothing leads further than from one end to the other; these do not.
    assert told == pytest.approx(sights.weight * ((place - elements.centre[0]) @ gradient), rel=1e-2, abs=1e-4)


def test_patches_cut_from_a_face_have_no_slope():
    scene = Scene.from_polygons([QUAD], 0.5, 0.0)
    patches = mesh(scene, max_edge=0.5)
    elements = split_patches(patches, scene_occluders(scene, patches), tolerance=1, size=1)
    sights = Sights(np.zeros(1, int), np.zeros(1, int), np.ones(1), elements.centre[:1])
    assert len(find_slopes(sights, scene, corner_receivers(scene), elements, patches).share) == 0


def grid(corner, along, across, n, m):
    """Return the quads of a parallelogram, cut n times m."""
    corner, along, across = (np.array(v, float) for v in (corner, along, across))
    ends = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    return [
        corner + ((a + ends[:, :1]) / n) * along + ((b + ends[:, 1:]) / m) * across for a in range(n) for b in range(m)
    ]


def light_below_a_low_shelf(rows):
    """Return the light at the vertices of the shelf's lower side, over a floor of so many rows."""
    lamp = grid((1, 1, 2), (0, 1, 0), (1, 0, 0), 1, 1)
    shelf = grid((0, 2.7, 0.1), (0, 0.3, 0), (2, 0, 0), 4, 8)
    floor = grid((0, 0, 0), (2, 0, 0), (0, 3, 0), 8, rows)
    emission = np.zeros((len(lamp + shelf + floor), 3))
    emission[: len(lamp)] = 30.0
    scene = Scene.from_polygons(lamp + shelf + floor, 0.7, emission)
    radiance = exhaust(bake(scene, Settings(sides="front"))).corner_radiance
    return radiance[4 * len(lamp) : 4 * len(lamp + shelf), 0]


@pytest.mark.parametrize("rows", [8, 13])
def test_a_shelf_sees_the_shade_below_it_and_not_the_mean_of_the_floor(rows):
    coarse, fine = light_below_a_low_shelf(rows), light_below_a_low_shelf(150)
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.1 * fine.mean()
