# SPDX-License-Identifier: GPL-3.0-or-later
"""Large faces are cut where light changes on them, and nothing else is."""

import numpy as np
import pytest

from core.grading import graded
from core.hierarchy.quality import QUALITIES
from core.meshing import mesh
from core.patch_sizes import changing_edges, even_edges
from core.progress import exhaust
from core.refined_scene import refined_scene
from core.refinement import refine
from core.scene import Scene
from core.settings import Settings
from tests.unit.blockers import box
from tests.unit.painted_faces import SQUARE, halves, painted
from tests.unit.test_refinement import assert_no_vertex_on_an_edge

UP = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
BUDGET = QUALITIES["medium"].corners


def table(**fields):
    """A plate of 1 m hangs over the middle of a floor of 8 m, and a small lamp over that."""
    polygons = [8 * UP - (4, 4, 0), UP + (-0.5, -0.5, 0.5), 0.1 * UP[::-1] + (-0.05, -0.05, 3.0)]
    emission = np.array([(0.0,) * 3] * 2 + [(500.0,) * 3])
    return Scene.from_polygons(polygons, np.array([(0.5,) * 3] * 2 + [(0.0,) * 3]), emission, **fields)


def cut(scene, **settings):
    return exhaust(graded(scene, Settings(**settings)))


def test_cells_are_small_where_the_shadow_ends_and_nowhere_else():
    scene = table()
    fine = cut(scene)
    result = refined_scene(scene, fine)
    assert len(fine.face) <= 1.2 * BUDGET
    middle = (
        np.add.reduceat(result.vertices[result.corner_vertex], result.face_start[:-1])
        / np.diff(result.face_start)[:, None]
    )
    floor, away = fine.face == 0, np.abs(middle[:, :2]).max(axis=1)
    size = np.sqrt(result.face_area)
    # The plate's shadow is 1.2 m wide.
    border, around = floor & (np.abs(away - 0.6) < 0.04), floor & (away > 2.0)
    assert size[border].mean() < 0.4 * size[around].mean()
    # The lamp shows no light but its own.
    assert np.count_nonzero(fine.face == 2) == 1
    assert_no_vertex_on_an_edge(result)


def test_a_preview_is_cut_evenly():
    fine = cut(table(), quality="preview")
    floor = np.count_nonzero(fine.face == 0)
    assert floor == round(np.sqrt(floor)) ** 2 > 100


def test_what_is_fine_already_stays(box):
    scene = Scene.from_polygons(box(), 0.5, 1.0)
    fine = refined_scene(scene, refine(scene, 0.05))
    assert cut(fine) is None


def test_what_is_small_stays_where_something_large_is_cut():
    """A lath in the edge of the shadow, where light changes most."""
    lath = UP * (0.3, 0.02, 1) + (-0.15, 0.59, 0.01)
    whole = table()
    polygons = [*(whole.vertices[whole.corner_vertex].reshape(-1, 4, 3)), lath]
    scene = Scene.from_polygons(polygons, 0.5, np.concatenate([whole.emission, np.zeros((1, 3))]))
    fine = cut(scene)
    assert np.count_nonzero(fine.face == 0) > 1000 and np.count_nonzero(fine.face == 3) == 1


def test_a_length_of_its_own_counts():
    own = cut(table(max_edge=[np.nan, 0.26, np.nan]))
    assert np.count_nonzero(own.face == 1) == 16
    assert np.count_nonzero(own.face == 0) > 100


def test_white_surfaces_are_all_that_lighting_is_told_of():
    scene = table()
    assert np.isnan(even_edges(scene, 1e-3, 10_000)[2])
    assert np.isfinite(even_edges(scene, 1e-3, 10_000, white=True)).all()


def test_black_faces_with_a_pattern_are_cut():
    def checks(points):
        bright = (points[:, :1] < 0.5) * np.array([(0.0, 0.0, 0.0, 1.0, 1.0, 1.0)])
        return bright

    scene = painted(SQUARE, checks, parts=17)
    assert np.isfinite(even_edges(scene, 0.1, 1000)).all()
    assert np.isnan(even_edges(Scene.from_polygons(SQUARE, 0.0, 1.0), 0.1, 1000)).all()


def test_a_pattern_that_is_reflected_is_no_change_of_light():
    scene = painted(SQUARE, halves, parts=17)
    fine = refine(scene, 0.26)
    finer = refined_scene(scene, fine)
    light = np.ones((16, 3)), np.ones((64, 3))
    assert np.ptp(finer.corner_reflectance[:, 0]) > 0.5
    rho = scene.reflectance.mean(axis=1)[fine.face]
    assert np.isnan(changing_edges(finer, rho, mesh(finer), light, 1000)).all()


def test_the_strongest_changes_come_first():
    polygons = [UP + (2.0 * k, 0, 0) for k in range(4)]
    scene = Scene.from_polygons(polygons, 0.5)
    patches = mesh(scene)
    H = np.ones((16, 3))
    H[[4, 8, 12]] = np.array([1.6, 4.0, 1.05])[:, None]
    light = np.array([H[4 * k : 4 * k + 4].mean(axis=0) for k in range(4)]), H
    found = changing_edges(scene, np.full(4, 0.5), patches, light, 1000)
    np.testing.assert_array_equal(np.isfinite(found), [False, True, True, False])
    assert found[2] < found[1] < 1
    found = changing_edges(scene, np.full(4, 0.5), patches, light, 15)
    np.testing.assert_array_equal(np.isfinite(found), [False, False, True, False])


@pytest.mark.parametrize("land", [40.0, 4000.0])
def test_a_house_on_land_is_cut_as_a_house(land):
    scene = Scene.from_polygons([land * (UP - (0.5, 0.5, 0)), *box((-2, -2, 0), (2, 2, 3))], 0.5)
    edges = even_edges(scene, 1 / 32, 6000)
    assert np.all(edges[1:] < 0.6)
    cells = land**2 / edges[0] ** 2
    assert 500 < cells < 0.3 * 6000
