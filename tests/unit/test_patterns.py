# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures about lamps."""

import numpy as np
import pytest

from core.lighting.patterns import Pattern, pattern_directions


@pytest.mark.parametrize("widest", [np.pi, np.pi / 2, 0.4])
def test_directions_fill_the_cone(widest):
    directions, solid = pattern_directions(40, 60, widest)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1)
    assert solid.sum() == pytest.approx(2 * np.pi * (1 - np.cos(widest)))
    assert (directions[..., 2] < -np.cos(widest)).all()


def test_a_picture_shows_what_was_seen_in_each_direction():
    widest = 2.0
    directions, _ = pattern_directions(80, 120, widest)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    # A smooth picture: a lamp's own x, y and z.
    pattern = Pattern(turn, widest, 1.5 + directions)
    np.testing.assert_allclose(pattern.share(3.0 * directions.reshape(-1, 3) @ turn), 1.5 + directions.reshape(-1, 3))
    out = np.random.default_rng(2).normal(size=(500, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    own = out @ turn.T
    inside = np.arccos(-own[:, 2]) < widest - 0.05
    np.testing.assert_allclose(pattern.share(out)[inside], 1.5 + own[inside], atol=0.03)
    # Straight ahead, and behind all there is.
    assert np.isfinite(pattern.share(np.array([(0.0, 0, -1), (0, 0, 1), (0, 0, 0)]))).all()
