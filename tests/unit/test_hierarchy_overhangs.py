# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that hang close to a ceiling of large faces: what shines out of the gap, and how its light is balanced."""

import numpy as np
import pytest

from core.hierarchy.elements import split_patches
from core.hierarchy.overhangs import shown_middles
from core.hierarchy.transport import BALANCE, put_right
from core.hierarchy.tree import build_tree
from core.meshing import mesh
from core.scene import Scene
from core.visibility import scene_occluders
from tests.unit.flat_shapes import SQUARE

WHOLE = np.array([[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]], float)


def middle_under(plate):
    """Return where a unit square is asked for its light under a plate."""
    scene = Scene.from_polygons([WHOLE[0], np.array(plate, float)], 0.5, 1.0)
    return shown_middles(WHOLE, scene_occluders(scene, mesh(scene)))[0]


def plate(left, right, height):
    return [(left, -1, height), (left, 2, height), (right, 2, height), (right, -1, height)]


@pytest.mark.parametrize(
    ("left", "right", "height", "expected"),
    [
        # Half of it is under a plate: the other half is asked, off its middle by an eighth at most.
        (0.5, 3, 0.1, 0.25),
        (-2, 0.5, 0.1, 0.75),
        # What hangs higher leaves all of it to be seen, and under the whole of it nothing is.
        (0.5, 3, 0.6, 0.5),
        (-2, 3, 0.1, 0.5),
        (2, 3, 0.1, 0.5),
    ],
)
def test_a_piece_half_under_something_is_asked_where_it_shows(left, right, height, expected):
    x, y, z = middle_under(plate(left, right, height))
    assert x == pytest.approx(expected, abs=0.13 if expected != 0.5 else 1e-12)
    assert y == pytest.approx(0.5, abs=0.13)
    assert z == 0


def test_a_piece_with_little_left_is_asked_where_that_is():
    # What shows is the shape of an L, with its mean under the plate.
    x, y, _ = middle_under([(-1, -1, 0.1), (-1, 0.7, 0.1), (0.7, 0.7, 0.1), (0.7, -1, 0.1)])
    assert max(x, y) > 0.7


def test_a_ceiling_is_split_behind_its_lamp_however_many_splits_its_size_takes():
    # A ceiling of large faces takes up all the room there is for splits, and a lamp hangs right below some of them.
    places = np.stack(np.indices((40, 40)), axis=-1).reshape(-1, 1, 2)
    ceiling = [np.column_stack((corner + SQUARE[::-1, :2], np.full(4, 4.0))) for corner in places]
    lamp = np.array([(18.3, 18.3, 3.99), (21.7, 18.3, 3.99), (21.7, 21.7, 3.99), (18.3, 21.7, 3.99)])
    emission = np.zeros((len(ceiling) + 1, 3))
    emission[-1] = 10.0
    divisions = np.append(np.ones(len(ceiling), int), 4)
    scene = Scene.from_polygons([*ceiling, lamp], 0.5, emission, divisions=divisions)
    patches = mesh(scene)
    elements = split_patches(patches, scene_occluders(scene, patches), tolerance=1e-5, size=1 / 80)
    assert np.bincount(elements.patch).min() >= 4
    rim = np.abs(np.abs(elements.centre[:, :2] - 20).max(axis=1) - 1.7) < 0.02
    assert elements.area[rim & (elements.centre[:, 2] == 4)].max() < 1 / 200


def test_lamps_that_hit_or_miss_what_is_close_are_put_right_together():
    # Of eight lamps in a row every second one lights the middle of what hangs over it, and nothing else does.
    place = np.column_stack((np.arange(8.0), np.zeros(8), np.zeros(8)))
    tree = build_tree(place, np.tile((0.0, 0.0, 1.0), (8, 1)))
    sent = np.ones(8)
    struck = np.tile((1.9, 0.0), 4)
    share = put_right(tree, sent, struck)
    assert share @ struck == pytest.approx(8, rel=1e-6)
    np.testing.assert_allclose(share, 1 / 0.95)
    # What is off by little is put right for each, and never by more than so much.
    near = np.linspace(0.9, 1.1, 8)
    np.testing.assert_allclose(put_right(tree, sent, near) * near, 1)
    np.testing.assert_allclose(put_right(tree, sent, 0.1 * sent), BALANCE)
