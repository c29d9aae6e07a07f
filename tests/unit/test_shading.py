# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours at corners: patches blend inside smooth groups and nowhere else (T16)."""

import numpy as np
import pytest

from core.meshing import mesh
from core.scene import Scene
from core.settings import LIGHTS
from core.shading import corner_angles, corner_colours, corner_irradiance, vertex_means

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


def row_of_squares(count, bend=0.0):
    """Return squares along x, each turned up by `bend` against the one before [rad]."""
    x = np.concatenate(([0.0], np.cumsum(np.cos(bend * np.arange(count)))))
    z = np.concatenate(([0.0], np.cumsum(np.sin(bend * np.arange(count)))))
    return [
        np.array([(x[k], 0, z[k]), (x[k + 1], 0, z[k + 1]), (x[k + 1], 1, z[k + 1]), (x[k], 1, z[k])])
        for k in range(count)
    ]


def shade(scene, irradiance, **meshing):
    patches = mesh(scene, **meshing)
    H = corner_irradiance(scene, patches, irradiance(patches) if callable(irradiance) else irradiance)
    return corner_colours(scene, H, np.zeros_like(H))


def grey(values):
    return np.repeat(np.asarray(values, float)[:, None], 3, axis=1)


def test_even_light_gives_even_radiance(cube):
    scene = cube(reflectance=(0.2, 0.5, 0.9), emission=0.3, divisions=3)
    patches = mesh(scene)
    radiance = shade(scene, np.full((len(patches.area), 3), 2.0))
    np.testing.assert_allclose(radiance, np.broadcast_to((0.3 + 2.0 * np.array([0.2, 0.5, 0.9])) / np.pi, (24, 3)))


def test_coplanar_neighbours_blend():
    scene = Scene.from_polygons(row_of_squares(2), 1.0 / 2.0)
    radiance = shade(scene, grey([1.0, 3.0]))[:, 0] * 2.0 * np.pi
    np.testing.assert_allclose(radiance, [1, 2, 2, 1, 2, 3, 3, 2])


def test_a_fold_stays_hard_and_smooth_shading_bridges_it():
    squares = row_of_squares(2, bend=0.3)
    irradiance = grey([1.0, 3.0])
    hard = shade(Scene.from_polygons(squares, 0.5), irradiance)[:, 0] * 2.0 * np.pi
    np.testing.assert_allclose(hard, [1, 1, 1, 1, 3, 3, 3, 3])
    smooth = Scene.from_polygons(squares, 0.5, corner_normals=np.tile((0.0, 0.0, 1.0), (8, 1)))
    np.testing.assert_allclose(shade(smooth, irradiance)[:, 0] * 2.0 * np.pi, [1, 2, 2, 1, 2, 3, 3, 2])


def test_the_noise_of_single_precision_is_no_fold():
    noise = np.random.default_rng(3).normal(size=(8, 3)) * 3e-7
    scene = Scene.from_polygons(row_of_squares(2), 0.5, corner_normals=np.tile((0.0, 0.0, 1.0), (8, 1)) + noise)
    np.testing.assert_allclose(shade(scene, grey([1.0, 3.0]))[:, 0] * 2.0 * np.pi, [1, 2, 2, 1, 2, 3, 3, 2])


def test_another_object_at_the_same_place_never_bleeds():
    scene = Scene.from_polygons([SQUARE, SQUARE + (1, 0, 0)], 0.5, face_object=[0, 1], object_names=("a", "b"))
    np.testing.assert_allclose(shade(scene, grey([1.0, 3.0]))[:, 0] * 2.0 * np.pi, [1, 1, 1, 1, 3, 3, 3, 3])


def test_reflectance_and_emission_stay_with_their_face():
    # Light blends over the border between two paints; the paints do not.
    scene = Scene.from_polygons(row_of_squares(2), [(0.8, 0, 0), (0, 0.4, 0)], [(0, 0, 0), (0, 0, 5.0)])
    radiance = np.pi * shade(scene, grey([1.0, 3.0]))
    np.testing.assert_allclose(radiance[:4], np.outer([1, 2, 2, 1], (0.8, 0, 0)), atol=1e-15)
    np.testing.assert_allclose(radiance[4:], np.outer([2, 3, 3, 2], (0, 0.4, 0)) + (0, 0, 5.0), atol=1e-15)


def test_a_finer_mesh_comes_closer_to_light_that_changes_evenly():
    scene = Scene.from_polygons(row_of_squares(3), 0.5)
    exact = scene.vertices[scene.corner_vertex, 0]
    errors = []
    for n in (1, 4, 16):
        radiance = shade(scene, lambda patches: np.repeat(patches.centre[:, :1], 3, axis=1), subdivide=n)
        errors.append(np.abs(2.0 * np.pi * radiance[:, 0] - exact).max())
    np.testing.assert_allclose(errors, [1 / 2, 1 / 8, 1 / 32])


def test_a_face_without_area_takes_the_light_around_it():
    sliver = np.array([(1, 0, 0), (1, 0.5, 0), (1, 1, 0)], float)
    with_vertex = [SQUARE, sliver]
    scene = Scene.from_polygons(with_vertex, 0.5, [(0, 0, 0), (1.0, 1.0, 1.0)])
    radiance = np.pi * shade(scene, grey([4.0]))[:, 0]
    # Its middle corner meets no patch: only its own light is left there.
    np.testing.assert_allclose(radiance, [2, 2, 2, 2, 3, 1, 3])


@pytest.mark.parametrize("sides", [1, 2, 3])
def test_the_side_that_is_shown_lights_the_corners(sides):
    scene = Scene.from_polygons([SQUARE], 0.5, sides=[sides])
    patches = mesh(scene)
    irradiance = grey(np.where(patches.side > 0, 1.0, 7.0))
    np.testing.assert_allclose(np.pi * shade(scene, irradiance), 3.5 if sides == 2 else 0.5)


def test_each_kind_of_colour_is_its_part_of_the_light():
    paint = [(0.8, 0.5, 0.0), (0.1, 0.2, 0.3)]
    scene = Scene.from_polygons([SQUARE, SQUARE + (5, 0, 0)], paint, [(0, 0, 0), (2, 3, 4)])
    H, direct = np.random.default_rng(1).uniform(1, 2, (8, 3)), np.random.default_rng(2).uniform(0, 1, (8, 3))
    kinds = {light: corner_colours(scene, H, direct, light) for light in LIGHTS}
    rho, E = scene.reflectance[scene.corner_face], scene.emission[scene.corner_face]
    np.testing.assert_allclose(kinds["combined"], kinds["direct"] + kinds["indirect"], rtol=1e-14)
    np.testing.assert_allclose(kinds["combined"], rho * kinds["lighting"] + E / np.pi, rtol=1e-14)
    np.testing.assert_allclose(kinds["direct"], (E + rho * direct) / np.pi, rtol=1e-14)
    assert (corner_colours(scene, direct, H, "indirect") == 0.0).all()


def test_a_vertex_has_the_mean_of_its_corners_by_angle():
    # Vertex 0: two corners of 90 and 30 degrees; vertex 1: two corners without an angle; vertex 2: none.
    found = vertex_means(
        np.array([[4.0, 0.0, 1.0], [0.0, 4.0, 1.0], [1.0, 2.0, 3.0], [3.0, 2.0, 1.0]]),
        np.radians([90.0, 30.0, 0.0, 0.0]),
        np.array([0, 0, 1, 1]),
        3,
    )
    np.testing.assert_allclose(found, [[3.0, 1.0, 1.0], [2.0, 2.0, 2.0], [0.0, 0.0, 0.0]])


def test_angles_of_corners():
    triangle = [(0, 0, 0), (3, 0, 0), (0, 3, 0)]
    scene = Scene.from_polygons([triangle, SQUARE, [(0, 0, 0), (0, 0, 0), (1, 0, 0)]])
    np.testing.assert_allclose(np.degrees(corner_angles(scene)), [90, 45, 45, 90, 90, 90, 90, 0, 0, 0], atol=1e-9)
