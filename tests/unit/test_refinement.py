# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes cut finer: no cracks, nothing turned over, nothing lost, and what each part is made of."""

from dataclasses import replace

import numpy as np
import pytest

from core.errors import RadiosityError
from core.refinement import refine
from core.refinement_of_two import composed
from core.scene import Scene

LENGTHS = (3.0, 1.1, 0.6, 0.37, 0.21)


def plane(seed, triangles=False):
    """Return a bent grid of 3 x 3 quads, or of twice as many triangles, with steps of very different lengths."""
    rng = np.random.default_rng(seed)
    x, y = (np.cumsum(rng.choice([0.15, 0.7, 1.9], 4)) for _ in range(2))
    points = np.stack([*np.meshgrid(x, y), np.zeros((4, 4))], axis=2).reshape(-1, 3)
    points[:, :2] += rng.uniform(-0.04, 0.04, (16, 2))
    quads = [(4 * j + i, 4 * j + i + 1, 4 * j + i + 5, 4 * j + i + 4) for j in range(3) for i in range(3)]
    faces = quads
    if triangles:
        faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return points, faces


def scene_of(points, faces, **fields):
    start = np.cumsum([0, *map(len, faces)])
    nothing = np.zeros((len(faces), 3))
    return Scene(points, np.concatenate(faces), start, nothing, nothing, **fields)


def finer(fine, coarse):
    """Return a refinement as a scene of its own."""
    nothing = np.zeros((len(fine.face), 3))
    return Scene(fine.vertices, fine.corner_vertex, fine.face_start, nothing, nothing)


def edges(scene):
    """Return the directed edges of all faces, shape (c, 2)."""
    following = np.arange(1, len(scene.corner_vertex) + 1)
    following[scene.face_start[1:] - 1] = scene.face_start[:-1]
    return np.stack([scene.corner_vertex, scene.corner_vertex[following]], axis=1)


def assert_no_vertex_on_an_edge(scene):
    """Check that whatever vertex lies on an edge is an end of it: the mesh has no T-junctions."""
    ends = np.unique(np.sort(edges(scene), axis=1), axis=0)
    a, b = scene.vertices[ends[:, 0]], scene.vertices[ends[:, 1]]
    along = b - a
    length2 = (along**2).sum(axis=1)
    reach = scene.vertices[None] - a[:, None]
    t = np.einsum("evx,ex->ev", reach, along) / length2[:, None]
    off = np.linalg.norm(reach - t[:, :, None] * along[:, None], axis=2)
    inside = (t > 1e-9) & (t < 1 - 1e-9) & (off < 1e-9)
    assert not inside.any()


MESHES = {f"{kind} {seed}": plane(seed, kind == "triangles") for kind in ("quads", "triangles") for seed in range(6)}
L = np.array([(0, 0, 0), (4, 0, 0), (4, 1, 0), (1, 1, 0), (1, 3, 0), (0, 3, 0)], float)
MESHES["n-gon beside quads"] = (
    np.concatenate([L, [(4, 3, 0), (5, 0, 0), (5, 1, 0)]]),
    [(0, 1, 2, 3, 4, 5), (3, 2, 6, 4), (1, 7, 8, 2)],
)
MESHES["slivers"] = (
    np.array([(0, 0, 0), (10, 0, 0), (10, 0.1, 0), (0, 0.1, 0), (5, 3, 0), (4, -0.2, 0)], float),
    [(0, 1, 2), (0, 2, 3), (3, 2, 4), (0, 5, 1)],
)


def evenly(coarse, length):
    return refine(coarse, length)


def unevenly(coarse, length):
    """Cut some faces much finer than those beside them."""
    rng = np.random.default_rng(len(coarse.face_area))
    return refine(replace(coarse, max_edge=length * rng.choice([1.0, 4.0, 30.0], len(coarse.face_area))))


def twice(coarse, length):
    """Cut once, and some of what comes about once more."""
    first = evenly(coarse, 2.0 * length)
    return composed(first, unevenly(finer(first, coarse), length))


WAYS = pytest.mark.parametrize("cut", [evenly, unevenly, twice])


@WAYS
@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("name", MESHES)
def test_a_plane_stays_whole(name, length, cut):
    points, faces = MESHES[name]
    coarse = scene_of(points, faces)
    fine = cut(coarse, length)
    result = finer(fine, coarse)
    assert_no_vertex_on_an_edge(result)
    # Every edge has a face on each side but those of the border, which is as long as it was.
    directed = edges(result)
    _, used = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    assert len(np.unique(directed, axis=0)) == len(directed) and used.max() <= 2
    assert len(np.unique(result.corner_vertex)) == len(result.vertices)
    # Nothing is turned over, nothing is lost.
    assert (result.face_normal @ (0, 0, 1) > 0.999).all()
    area = np.bincount(fine.face, result.face_area)
    np.testing.assert_allclose(area, coarse.face_area, rtol=1e-9)
    ends = result.vertices[directed]
    assert cut is not evenly or np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max() <= 2 * length


@WAYS
@pytest.mark.parametrize("name", MESHES)
def test_what_each_part_is_made_of(name, cut):
    points, faces = MESHES[name]
    coarse = scene_of(points, faces)
    fine = cut(coarse, 0.3)
    corners = coarse.vertices[coarse.corner_vertex]
    made = np.einsum("ck,ckx->cx", fine.corner_weight, corners[fine.corner_source])
    np.testing.assert_allclose(made, fine.vertices[fine.corner_vertex], atol=1e-12)
    made = np.einsum("vk,vkx->vx", fine.vertex_weight, coarse.vertices[fine.vertex_source])
    np.testing.assert_allclose(made, fine.vertices, atol=1e-12)
    np.testing.assert_array_equal(fine.vertices[: len(points)], points)
    of_face = coarse.corner_face[fine.corner_source]
    assert (of_face == np.repeat(fine.face, np.diff(fine.face_start))[:, None]).all()
    # Parts of edges lie on their edges, and are as long together.
    part, whole = (
        np.diff(positions, axis=1)[:, 0] for positions in (fine.vertices[fine.edge], points[fine.edge_source])
    )
    assert np.linalg.norm(np.cross(part, whole), axis=1).max() < 1e-12
    _, owner = np.unique(fine.edge_source, axis=0, return_inverse=True)
    lengths = np.bincount(owner.reshape(-1), np.linalg.norm(part, axis=1))
    np.testing.assert_allclose(lengths[owner.reshape(-1)], np.linalg.norm(whole, axis=1))


def test_edges_that_are_short_enough_leave_the_mesh_as_it_was():
    points, faces = MESHES["n-gon beside quads"]
    coarse = scene_of(points, faces)
    for fine in (refine(coarse), refine(coarse, 9.0)):
        np.testing.assert_array_equal(fine.corner_vertex, coarse.corner_vertex)
        np.testing.assert_array_equal(fine.face_start, coarse.face_start)
        np.testing.assert_array_equal(fine.vertices, coarse.vertices)
        np.testing.assert_array_equal(fine.corner_source[:, 0], np.arange(len(coarse.corner_vertex)))


def test_subdivisions_are_exact(box):
    fine = refine(Scene.from_polygons(box()), subdivide=4)
    assert len(fine.face) == 6 * 16
    assert len(fine.vertices) == 6 * 16 + 2
    np.testing.assert_allclose(finer(fine, None).face_area, 1 / 16)
    fine = refine(Scene.from_polygons([[(0, 0, 0), (1, 0, 0), (0, 1, 0)]]), subdivide=5)
    np.testing.assert_allclose(finer(fine, None).face_area, 0.5 / 25)


def test_faces_that_touch_without_sharing_vertices_are_cut_at_the_same_bits(box):
    rng = np.random.default_rng(0)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    polygons = [polygon @ turn.T + 0.3 for polygon in box((1.0, 2.3, 0.7))]
    welded = refine(Scene.from_polygons(polygons), 0.23)
    points = np.concatenate(polygons)
    order = rng.permutation(24)
    shuffled = np.empty_like(points)
    shuffled[order] = points
    loose = refine(scene_of(shuffled, [order[4 * k : 4 * k + 4] for k in range(6)]), 0.23)
    assert len(loose.vertices) > len(welded.vertices)
    assert len(np.unique(loose.vertices, axis=0)) == len(welded.vertices)


def test_a_seam_is_cut_alike_on_both_sides(box):
    # Faces that share no vertex, one of which is cut finer by far.
    points = np.concatenate(box((1.0, 2.3, 0.7)))
    longest = np.array([0.1, *[np.nan] * 5])
    fine = refine(scene_of(points, np.arange(24).reshape(6, 4), max_edge=longest), 9.0)
    _, place = np.unique(fine.vertices, axis=0, return_inverse=True)
    _, faces = np.unique(np.sort(place.reshape(-1)[edges(finer(fine, None))], axis=1), axis=0, return_counts=True)
    assert (faces == 2).all()


def test_a_face_without_area_follows_its_neighbours():
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0, 0)], float)
    coarse = scene_of(points, [(0, 1, 2, 3), (0, 4, 1)])
    fine = refine(coarse, 0.26)
    sizes = np.diff(fine.face_start)
    # Along the whole edge of the square it has the square's cuts.
    assert sizes[fine.face == 1].tolist() == [3 + 3]
    assert len(fine.face) == 17


def test_a_face_can_have_a_length_of_its_own():
    points, faces = plane(0)
    longest = np.full(9, np.nan)
    longest[4] = 0.1
    fine = refine(scene_of(points, faces, max_edge=longest), 50.0)
    assert_no_vertex_on_an_edge(finer(fine, None))
    counts = np.bincount(fine.face)
    assert counts[4] == counts.max() and counts[0] == 1


def test_too_many_faces_are_refused_with_the_name():
    with pytest.raises(RadiosityError, match=r"'Wall'.*larger patches"):
        refine(scene_of(*plane(0), object_names=("Wall",)), 1e-5)
