# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing slips through where surfaces meet, and joining them changes nothing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.meshing import mesh
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.surfaces import occluder_polygons
from core.scene import BOTH, Scene
from tests.unit.blockers import TURN, box, everything, grid, halves, joined, soup, sphere


def test_surface_that_turns_a_corner(occluders):
    mask = np.array([[1, 1, 1], [1, 0, 0], [1, 0, 0]], dtype=bool)
    wall = occluders(joined(grid(mask)))
    middle = np.argwhere(np.ones((3, 3))) + 0.5
    start = np.column_stack([middle, np.ones(9)])
    np.testing.assert_array_equal(wall.blocked(start, start * [1, 1, -2]), mask.reshape(-1))


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["level", "turned"])
def test_nothing_slips_through_where_pieces_meet(occluders, turn):
    # A window makes pieces that meet in T-junctions; all of the lines along which faces met before, and the corners.
    mask = np.ones((9, 9), dtype=bool)
    mask[3:5, 2:6] = False
    wall = occluders(joined([*(grid(mask) @ turn.T), *(box([0, 0, -3], [9, 9, 3]) @ turn.T)]))
    rng = np.random.default_rng(4)
    line, along = rng.integers(1, 9, 6000), rng.uniform(0.001, 8.999, 6000)
    along[:1000] = np.round(along[:1000])
    on = np.where(rng.random(6000)[:, None] < 0.5, np.stack([line, along], axis=1), np.stack([along, line], axis=1))
    solid = ~((on >= [3, 2]) & (on <= [5, 6])).all(axis=1) & (on > 0).all(axis=1) & (on < 9).all(axis=1)
    on = np.column_stack([on[solid], np.zeros(solid.sum())])
    way = rng.normal(size=on.shape)
    way[: len(on) // 2] = [0, 0, 1]
    way[:, 2] = np.sign(way[:, 2]) * np.maximum(np.abs(way[:, 2]), 0.05)
    way /= 10 * np.linalg.norm(way, axis=1, keepdims=True)
    assert wall.blocked((on - way) @ turn.T, (on + 0.7 * way) @ turn.T).all()


def test_nothing_slips_through_between_triangles(occluders):
    rng = np.random.default_rng(12)
    # A wavy sheet of triangles, and rays through points of their edges and through their corners.
    quads = grid(np.ones((12, 12)))
    quads[..., 2] = 0.4 * np.sin(quads[..., 0]) * np.cos(quads[..., 1])
    corners = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    sheet = occluders(soup(corners))
    share = np.append(rng.uniform(0, 1, 20), [0.0, 0.5, 1.0])[:, None, None, None]
    on = (share * corners + (1 - share) * np.roll(corners, 1, axis=1)).reshape(-1, 3)
    on = on[(on[:, :2] > 0.01).all(axis=1) & (on[:, :2] < 11.99).all(axis=1)]
    way = rng.normal(size=on.shape) + [0, 0, 3]
    way[: len(on) // 2] = [0, 0, 1]
    way[:, 2] = np.maximum(way[:, 2], 1.0)
    assert sheet.blocked(on - 1e-3 * way, on + 2e-3 * way).all()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_joining_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    quads = [*grid(rng.random((6, 6)) < 0.7), *grid(rng.random((6, 6)) < 0.4, 3.0), *box([1, 1, 0], [3, 2, 2.5])]
    quads = np.array(quads) @ TURN.T
    one, other = joined(quads), halves(quads)
    ends = rng.uniform([-1, -1, -1], [7, 7, 4], (2, 1000, 3)) @ TURN.T
    # Both have the same diagonal, so only edges within the growth could differ.
    surely = BruteForceOccluders(other, growth=-1e-6).blocked(*ends)
    maybe = BruteForceOccluders(other, growth=3e-6).blocked(*ends)
    for found in everything(one):
        assert np.all(surely <= found.blocked(*ends))
        assert np.all(found.blocked(*ends) <= maybe)


@pytest.mark.parametrize("scale", [1.0, 0.01], ids=["alone", "in a large scene"])
def test_hollow_smooth_mesh_does_not_hide_its_neighbours(occluders, scale):
    ball = scale * sphere(20)
    around = halves([[[-5, -5, -5], [5, -5, -5], [5, 5, -5], [-5, 5, -5]]])
    scene = Scene.from_polygons([*ball[:, ::-1], *(around.vertices[None] if scale < 1 else ())])
    patches = mesh(scene)
    walls = occluders(occluder_polygons(scene, patches))
    rng = np.random.default_rng(5)
    i, j = rng.integers(0, len(ball), (2, 2000))
    j[:1000] = (i[:1000] + 1) % len(ball)
    seen = (patches.normal[i] * (patches.centre[j] - patches.centre[i])).sum(axis=1) > 0
    assert seen.mean() > 0.9
    assert not walls.blocked(patches.centre[i[seen]], patches.centre[j[seen]]).any()


def test_bent_wall_does_not_hide_its_own_points(occluders):
    bent = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0.6], [0, 4, 0]])
    lid = np.array([[0, 0, 3], [0, 4, 3], [4, 4, 3], [4, 0, 3]])
    scene = Scene.from_polygons([bent, lid], sides=[BOTH, BOTH])
    patches = mesh(scene, max_edge=1.0)
    walls = occluders(occluder_polygons(scene, patches))
    u, v = np.random.default_rng(6).uniform(0, 1, (2, 3000))
    on = np.stack([4 * u, 4 * v, 0.6 * u * v], axis=1)
    assert not walls.blocked(on, np.tile([2.0, 2, 3], (3000, 1))).any()
    assert not walls.blocked(on, np.tile([2.0, 2, -3], (3000, 1))).any()
    assert walls.blocked(on - [0, 0, 0.2], np.tile([2.0, 2, 3], (3000, 1))).all()
