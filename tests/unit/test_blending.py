# SPDX-License-Identifier: GPL-3.0-or-later
"""What corners learn from samples round them runs on from cluster to cluster."""

from types import SimpleNamespace

import numpy as np
import pytest

from core.hierarchy.blending import blended
from core.hierarchy.clustering import choose_samples
from core.hierarchy.elements import Elements
from core.hierarchy.filter import mesh_edges
from core.scene import Scene

SIDE = 40
# Nothing is in the way.
NOTHING = SimpleNamespace(
    blocked=lambda origins, targets: np.zeros(len(origins), bool),
    nearest=lambda origins, directions: (
        np.full(len(origins), -1),
        np.zeros(len(origins)),
        np.ones(len(origins), bool),
    ),
)


@pytest.fixture(scope="module")
def square():
    """Return the vertices of a square of 40 x 40 faces, edges among them, and some 100 samples."""
    faces = [[(x, y, 0), (x + 1, y, 0), (x + 1, y + 1, 0), (x, y + 1, 0)] for x in range(SIDE) for y in range(SIDE)]
    scene = Scene.from_polygons(faces, 0.5)
    point = np.unique(scene.vertices, axis=0)
    which = (scene.vertices[scene.corner_vertex] @ (SIDE + 1, 1, 0)).astype(int)
    none, one, corners = np.zeros((len(point), 3)), np.ones(len(point)), np.repeat(point[:, None], 4, axis=1)
    elements = Elements(corners, point, none + (0, 0, 1), one, which * 0, none, none, one)
    return point, mesh_edges(scene, which), choose_samples(elements, NOTHING, 100)


def told(square, light):
    point, edges, samples = square
    values = np.repeat(light[samples.element][:, None], 3, axis=1)
    up = np.zeros((len(point), 3)) + (0, 0, 1)
    return blended(samples, values, point, up, edges, np.zeros(len(samples), bool))[:, 0]


def test_even_light_is_even(square):
    assert told(square, np.ones(len(square[0]))) == pytest.approx(1, rel=1e-9)


def test_slopes_run_on_across_borders_of_clusters(square):
    point = square[0]
    light = 1 + 0.02 * point[:, 0]
    got = told(square, light)
    inside = ((point > 5) & (point < SIDE - 5))[:, :2].all(axis=1)
    assert got[inside] == pytest.approx(light[inside], rel=0.02)


def test_noise_of_samples_makes_no_steps(square):
    point, edges, samples = square
    light = 1 + 0.1 * np.random.default_rng(1).standard_normal(len(point))
    got, steps = told(square, light), samples.spread(np.repeat(light[samples.element][:, None], 3, axis=1))[:, 0]
    jump, was = (np.abs(of[edges[0]] - of[edges[1]]).max() for of in (got, steps))
    assert jump < 0.4 * was
