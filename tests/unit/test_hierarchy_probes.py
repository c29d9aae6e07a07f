# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is shut in, and who only sees little of the opening."""

from types import SimpleNamespace

import numpy as np
import pytest

from core.hierarchy.exposed import _looking_out
from core.hierarchy.kernels import near_form_factors
from core.hierarchy.probes import points_shut_in, receivers_shut_in
from core.hierarchy.receivers import group_receivers
from core.meshing import mesh
from core.scene import Scene
from core.visibility import SurfaceOccluders, scene_occluders

WALLS = [
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    [(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)],
    [(1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0)],
    [(1, 1, 0), (1, 1, 1), (0, 1, 1), (0, 1, 0)],
    [(0, 1, 0), (0, 1, 1), (0, 0, 1), (0, 0, 0)],
]
# An opening in a corner of the ceiling, and the ceiling around it.
HOLE = [(0, 0, 1), (0, 0.4, 1), (0.4, 0.4, 1), (0.4, 0, 1)]
CEILING = [
    [(0.4, 0, 1), (0.4, 1, 1), (1, 1, 1), (1, 0, 1)],
    [(0, 0.4, 1), (0, 1, 1), (0.4, 1, 1), (0.4, 0.4, 1)],
]
FLOOR = np.stack([np.full((24, 24), 0.0), *np.meshgrid(*2 * [np.linspace(0.02, 0.98, 24)])], axis=2)[..., [1, 2, 0]]
FLOOR = FLOOR.reshape(-1, 3)
UP = np.tile((0.0, 0.0, 1.0), (len(FLOOR), 1))


def room(polygons: list) -> tuple[np.ndarray, SurfaceOccluders]:
    return np.array(polygons, float), scene_occluders(scene := Scene.from_polygons(polygons, 0.5), mesh(scene))


def test_small_openings_are_found():
    corners, occluders = room(WALLS + CEILING)
    opening = near_form_factors(FLOOR, UP, np.repeat(np.array([HOLE], float), len(FLOOR), axis=0))
    assert opening.min() < 0.02 < 0.04 < opening.max()
    shut = points_shut_in(FLOOR, UP, corners, occluders)
    assert not shut[opening > 0.03].any()
    # One look for all of a group is as good as one for each.
    receivers = group_receivers(FLOOR, UP)
    of_group = receivers_shut_in(receivers, corners, occluders)[receivers.first[:-1]]
    seen = np.add.reduceat(opening[receivers.index], receivers.first[:-1]) / np.diff(receivers.first)
    assert not of_group[seen > 0.03].any()


def test_who_sees_no_way_out_is_shut_in():
    corners, occluders = room([*WALLS, *CEILING, HOLE])
    assert points_shut_in(FLOOR, UP, corners, occluders).all()
    assert receivers_shut_in(group_receivers(FLOOR, UP), corners, occluders).all()


class Counted:
    """Occluders that count what they are asked."""

    def __init__(self, occluders):
        self._occluders, self.asked = occluders, 0

    def blocked(self, origins, targets):
        self.asked += len(origins)
        return self._occluders.blocked(origins, targets)


@pytest.mark.parametrize(("polygons", "out"), [([*WALLS, *CEILING, HOLE], False), (WALLS, True)])
def test_elements_of_one_sample_look_out_together(polygons, out):
    corners, occluders = room(polygons)
    asked = {}
    for samples in (len(FLOOR), 10):
        counted = Counted(occluders)
        cluster = np.arange(len(FLOOR)) * samples // len(FLOOR)
        transport = SimpleNamespace(row_sums=lambda: np.zeros(len(FLOOR)), samples=SimpleNamespace(cluster=cluster))
        elements = SimpleNamespace(centre=FLOOR, normal=UP, corners=corners)
        lit = SimpleNamespace(transport=transport, elements=elements, scenery=SimpleNamespace(occluders=counted))
        assert (_looking_out(lit) == out).all()
        asked[samples] = counted.asked
    assert asked[10] < asked[len(FLOOR)] / 12
