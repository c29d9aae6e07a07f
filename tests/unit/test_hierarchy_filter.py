# SPDX-License-Identifier: GPL-3.0-or-later
"""The filter for indirect light: it takes noise away and leaves shadows and the light beside lamps."""

import numpy as np
import pytest

from core.hierarchy.filter import mesh_edges, smoothed
from core.scene import Scene

COUNT = 40


def strip() -> tuple[Scene, np.ndarray]:
    """Return a strip of squares, and the number of each corner's place: across, then along."""
    squares = [[(x, 0, 0), (x + 1, 0, 0), (x + 1, 1, 0), (x, 1, 0)] for x in range(COUNT)]
    scene = Scene.from_polygons(squares, 0.5)
    x, y = scene.vertices[scene.corner_vertex, :2].T
    return scene, (2 * x + y).astype(int)


def filtered(indirect: np.ndarray, lamps: float, typical: float, near: np.ndarray | None = None) -> np.ndarray:
    scene, group = strip()
    values = np.repeat(indirect[:, None], 3, axis=1)
    covered = np.zeros(len(indirect), bool)
    return smoothed(values, values + lamps, mesh_edges(scene, group), covered, typical, near=near)[:, 0]


def test_noise_goes_and_no_light_is_made():
    noise = 1 + 0.01 * np.random.default_rng(3).standard_normal(2 * COUNT + 2)
    quiet = filtered(noise, 0.0, 1.0)
    assert quiet.std() < 0.6 * noise.std()
    assert quiet.sum() == pytest.approx(noise.sum(), rel=1e-12)


@pytest.mark.parametrize("lamps", (0.0, 20.0))
def test_shades_stay_where_there_is_little_light_and_beside_lamps(lamps):
    edge = np.repeat(np.where(np.arange(COUNT + 1) < COUNT // 2, 0.6, 1.0), 2)
    assert filtered(edge, lamps, 1.0) == pytest.approx(edge, abs=0.01)


def test_a_corner_does_not_learn_from_the_edges_that_end_there():
    light = 1 + 0.02 * (np.arange(2 * COUNT + 2) < 2)
    near = np.where(np.arange(2 * COUNT + 2) < 2, 0.7, 0.4)
    assert filtered(light, 0.0, 1.0)[0] < 1.019
    assert filtered(light, 0.0, 1.0, near)[0] == pytest.approx(1.02, abs=1e-4)
