# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces whose corners lie in no plane, lit on both sides."""

import numpy as np
import pytest

from core.lighting.lamps import SunLamp
from core.scene import BOTH, FRONT, Scene

SIDE = 8


def test_hills_do_not_look_at_their_own_backs(light):
    x, y = 0.4 * np.indices((SIDE + 1, SIDE + 1)).reshape(2, -1)
    points = np.column_stack((x, y, 0.35 * np.sin(1.3 * x) * np.cos(1.1 * y)))
    first = np.arange((SIDE + 1) * SIDE).reshape(SIDE, SIDE + 1)[:, :-1].reshape(-1, 1)
    faces = points[first + (0, SIDE + 1, SIDE + 2, 1)]
    sun = SunLamp("Sun", np.full(3, 3.0), np.array((0.0, -0.5, 0.75**0.5)), 0.01)
    found = {}
    for sides in (FRONT, BOTH):
        scene = Scene.from_polygons(list(faces), 0.5, lamps=[sun], sides=np.full(len(faces), sides))
        result = light(scene, "hierarchical", quality="preview")
        found[sides] = (result.corner_irradiance - result.corner_direct)[:, 0]
    assert found[BOTH].mean() == pytest.approx(found[FRONT].mean(), abs=0.003)
    assert found[BOTH].max() < 0.1
