# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes cut finer: the same surfaces, lit at more corners."""

import numpy as np
import pytest

from core.refined_scene import refined_scene
from core.refinement import refine
from core.scene import Scene
from tests.unit.painted_faces import SQUARE, furnace, halves, painted


@pytest.mark.parametrize("method", ["hierarchical", "gathering", "shooting"])
def test_a_painted_furnace_is_even_at_all_corners(box, light, method):
    scene = painted(box(), furnace)
    fine = refined_scene(scene, refine(scene, 0.34))
    assert len(fine.face_area) == 54
    result = light(fine, method, tolerance=1e-5)
    np.testing.assert_allclose(result.corner_radiance * np.pi, 1.0, rtol=0.02)
    assert len(result.patches.area) == 54


def test_finer_faces_and_corners_look_like_their_part_of_the_face():
    scene = painted(SQUARE, halves, parts=17)
    fine = refined_scene(scene, refine(scene, subdivide=4))
    middle = fine.vertices[fine.corner_vertex].reshape(-1, 4, 3).mean(axis=1)
    np.testing.assert_allclose(fine.reflectance, halves(middle)[:, :3], atol=0.02)
    place = fine.vertices[fine.corner_vertex]
    # On the border between the colors both count alike.
    expected = np.where(place[:, :1] == 0.5, (0.4, 0.4, 0.0), halves(place)[:, :3])
    np.testing.assert_allclose(fine.corner_reflectance, expected, atol=0.03)


def test_a_scene_without_cuts_is_the_same(box):
    polygons = box()
    coarse = painted(polygons, furnace)
    fine = refined_scene(coarse, refine(coarse))
    for name in ("vertices", "corner_vertex", "face_start", "reflectance", "corner_reflectance", "corner_emission"):
        np.testing.assert_array_equal(getattr(fine, name), getattr(coarse, name))
    np.testing.assert_allclose(fine.corner_normals, coarse.corner_normals, atol=1e-15)


def test_faces_keep_what_they_do_with_light(box):
    names = ("occludes", "shades", "reflects", "emits")
    roles = {name: np.arange(6) % (2 + index) == 0 for index, name in enumerate(names)}
    coarse = Scene.from_polygons(
        box(), 0.5, 1.0, face_object=[0, 0, 1, 1, 1, 2], object_names="abc", sides=[1, 2, 3, 0, 1, 2], **roles
    )
    cut = refine(coarse, subdivide=2)
    fine = refined_scene(coarse, cut)
    for name in (*names, "sides", "face_object"):
        np.testing.assert_array_equal(getattr(fine, name), getattr(coarse, name)[cut.face])
    assert fine.object_names == ("a", "b", "c")


def test_smooth_normals_turn_evenly():
    normals = np.array([(-0.6, 0, 0.8), (0.6, 0, 0.8), (0.6, 0, 0.8), (-0.6, 0, 0.8)])
    coarse = Scene.from_polygons(SQUARE, 0.5, corner_normals=normals)
    fine = refined_scene(coarse, refine(coarse, subdivide=2))
    x = fine.vertices[fine.corner_vertex][:, 0]
    expected = np.array([(-0.6, 0, 0.8), (0, 0, 1), (0.6, 0, 0.8)])[np.rint(2 * x).astype(int)]
    np.testing.assert_allclose(fine.corner_normals, expected, atol=1e-12)
