# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmarks' error measure: what it counts, and that the references' noise is not in it."""

import numpy as np
import pytest

from tests.benchmarks import measure, meshes
from tests.benchmarks.geometry import Geometry
from tests.benchmarks.scenes import SCENES, size


def geometry_of(mesh: meshes.Mesh, emitting=()) -> Geometry:
    """A flat-shaded mesh of quads as one object."""
    emission = np.zeros((len(mesh.faces), 3))
    emission[list(emitting)] = 1.0
    a, b, _, d = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, d - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Geometry(
        vertices=mesh.vertices,
        corner_vertex=mesh.faces.reshape(-1),
        face_start=4 * np.arange(len(mesh.faces) + 1),
        reflectance=np.full((len(mesh.faces), 3), 0.5),
        emission=emission,
        corner_normals=np.repeat(normals, 4, axis=0),
        face_object=np.zeros(len(mesh.faces)),
        sides=np.ones(len(mesh.faces), dtype=np.uint8),
        object_names=("Mesh",),
    )


def test_closed_box_counts_every_vertex_once_for_each_of_its_normals():
    where = measure.points(geometry_of(meshes.box((0, 0, 0), (1, 1, 1), 0.5)))
    assert where.counted.all()
    assert len(where.counted) == 6 * 9


def test_open_border_and_emitters_are_left_out():
    plate = meshes.grid([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], 4, 4)
    assert measure.points(geometry_of(plate)).counted.sum() == 9
    # The first face holds one inner vertex.
    assert measure.points(geometry_of(plate, emitting=[0])).counted.sum() == 8


def test_error_of_a_wrong_scale_is_that_scale():
    where = measure.points(geometry_of(meshes.box((0, 0, 0), (1, 1, 1), 0.5)))
    truth = np.full((len(where.point), 3), 2.0)
    assert measure.error(where, 1.1 * truth, truth, truth) == pytest.approx(0.1)
    assert measure.bias(where, 1.1 * truth, truth, truth) == pytest.approx(0.1)


def test_noise_of_the_references_is_not_in_the_error():
    where = measure.points(geometry_of(meshes.box((0, 0, 0), (1, 1, 1), 0.02)))
    rng = np.random.default_rng(1)
    shape = (len(where.point), 3)
    first, second = 1 + 0.2 * rng.standard_normal((2, *shape))
    found = measure.error(where, 1 + 0.05 * np.sign(rng.standard_normal(shape[0]))[:, None] * np.ones(3), first, second)
    # Averaging over the corners of a vertex takes part of the alternating error out, but the noise would be larger.
    plain = np.std(where.luminance(first) - 1)
    expected = 0.05 * np.sqrt(np.mean(1 / np.bincount(where.point)))
    assert plain > 1.5 * expected
    assert found == pytest.approx(expected, rel=0.1)


def test_published_box_has_the_vertices_that_were_published():
    assert size(SCENES["cornell"]()) == (3451, 3025)


@pytest.mark.parametrize("name", SCENES)
def test_scenes_have_no_face_without_area(name):
    for item in SCENES[name]():
        for part in item.parts:
            corners = part.mesh.vertices[part.mesh.faces]
            area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            assert (np.linalg.norm(area, axis=1) > 1e-6).all()


@pytest.mark.parametrize("gap", (5e-5, -5e-5))
def test_corners_that_a_bake_moves_into_a_box_are_buried(gap):
    """A vertex at the very foot of a box: of its four faces two are under the box, and a bake writes black there."""
    pytest.importorskip("bpy")
    from tests.benchmarks.hidden import hidden_corners

    ground = meshes.grid([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], 2, 2)
    crate = meshes.moved(meshes.box((-0.5, 0, 0), (0.5, 0.5, 0.5), 1.0, without="-z"), (1.0, 1.0 + gap, 0))
    geometry = geometry_of(meshes.join(ground, crate))
    at = (geometry.vertices[geometry.corner_vertex] == (1, 1, 0)).all(axis=1)
    middle = geometry.vertices[geometry.corner_vertex].reshape(-1, 4, 3).mean(axis=1)[geometry.corner_face[at]]
    assert np.count_nonzero(at) == 4
    assert (hidden_corners(geometry)[at] == (middle[:, 1] > 1)).all()
