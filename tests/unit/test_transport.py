# SPDX-License-Identifier: GPL-3.0-or-later
"""Who lights whom: the matrix and its columns against exact factors and each other (T2, T3, T14)."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from core import form_factor_matrix
from core.dense import columns, matrix
from core.dense.columns import column_transport
from core.dense.matrix import dense_transport
from core.errors import RadiosityError
from core.form_factors import centre_to_centre
from core.meshing import mesh
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.surfaces import occluder_polygons
from core.progress import exhaust
from core.scene import Scene
from core.transport import MOST_SENT, DenseTransport, reciprocity_error
from tests.unit.matrices import ADJACENT, OPPOSITE, NeverAsked, by_face, dense, furnished


@pytest.mark.parametrize("divisions", [1, 2, 5, 8])
def test_faces_of_a_cube_see_each_other_as_published(cube, divisions):
    patches, F = dense(cube(divisions=divisions), occluders=NeverAsked())
    factors = by_face(patches, F.matrix)
    expected = np.full((6, 6), ADJACENT)
    np.fill_diagonal(expected, 0.0)
    expected[range(6), [1, 0, 3, 2, 5, 4]] = OPPOSITE
    np.testing.assert_allclose(factors, expected, atol=2e-5)
    np.testing.assert_allclose(F.row_sums(), 1.0, atol=2e-4)


def test_oblique_and_unequal_patches_against_the_exact_factors():
    rng = np.random.default_rng(8)
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    polygons = []
    for at in np.stack(np.meshgrid([0, 3, 6], [0, 3, 6], [0, 4]), axis=-1).reshape(-1, 3):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        polygons.append(square * rng.uniform(0.2, 2.0, 3) @ frame + at)
    polygons += [polygon[:3] + (0, 0, 9) for polygon in polygons[:4]]
    scene = Scene.from_polygons(polygons, 0.5, 1.0)
    _, F = dense(scene, occluders=None)
    for i in range(len(polygons)):
        for j in range(i):
            pair = form_factor_matrix([polygons[i], polygons[j]], tolerance=1e-5)
            assert F.matrix[i, j] == pytest.approx(pair[0, 1], rel=5e-3, abs=5e-5)


def test_centre_factors_are_the_formula_and_one_ray(box):
    scene = furnished(box, 2)
    patches, F = dense(scene, kernel="centre")
    i, j = np.mgrid[: len(patches.area), : len(patches.area)]
    plain = centre_to_centre(
        patches.centre[i], patches.normal[i], patches.centre[j], patches.normal[j], patches.area[j]
    )
    blocked = BruteForceOccluders(occluder_polygons(scene, patches)).blocked(
        patches.centre[i].reshape(-1, 3), patches.centre[j].reshape(-1, 3)
    )
    expected = np.where(blocked.reshape(i.shape), 0.0, plain)
    expected = expected / np.maximum(F.row_sums() / MOST_SENT, 1.0)
    np.testing.assert_allclose(F.matrix, expected, rtol=2e-5, atol=1e-7)


@pytest.mark.parametrize("kernel", ["exact", "centre"])
def test_factors_are_reciprocal_and_nobody_sends_more_than_all(box, kernel):
    patches, F = dense(furnished(box), kernel=kernel)
    sent = (patches.area[:, None] * F.matrix).sum(axis=0) / patches.area
    np.testing.assert_allclose(sent, np.minimum(F.row_sums(), MOST_SENT), atol=1e-5)
    raw = patches.area[:, None] * F.matrix * np.maximum(F.row_sums() / MOST_SENT, 1.0)
    np.testing.assert_allclose(raw, raw.T, rtol=1e-5, atol=1e-9)


def test_reciprocity_error_is_what_the_definition_says():
    rng = np.random.default_rng(4)
    area = rng.uniform(0.5, 2.0, 1500)
    F = DenseTransport(rng.random((1500, 1500), dtype=np.float32), area, np.ones(1500), 0, 0)
    K = area[:, None] * F.matrix
    assert reciprocity_error(F) == pytest.approx(np.abs(K - K.T).mean() / K.mean(), rel=1e-4)
    assert reciprocity_error(replace(F, matrix=((K + K.T) / area[:, None]).astype(np.float32))) < 1e-6
    assert reciprocity_error(replace(F, matrix=np.zeros_like(F.matrix))) == 0.0


def test_the_number_of_workers_changes_no_bit(box):
    scene = furnished(box, 5)
    matrices = []
    for workers in (1, 3):
        with ThreadPoolExecutor(workers) as executor:
            matrices.append(dense(scene, executor=executor)[1])
    matrices.append(dense(scene)[1])
    for other in matrices[1:]:
        np.testing.assert_array_equal(other.matrix, matrices[0].matrix)
        np.testing.assert_array_equal(other.row_sums(), matrices[0].row_sums())


@pytest.mark.parametrize("kernel", ["exact", "centre"])
def test_columns_are_those_of_the_matrix(box, kernel, monkeypatch):
    scene = furnished(box)
    patches, F = dense(scene, kernel=kernel)
    occluding = occluder_polygons(scene, patches)

    def on_demand():
        return column_transport(patches, BruteForceOccluders(occluding), kernel=kernel, surfaces=occluding)

    some = np.random.default_rng(0).permutation(len(patches.area))[:40]
    kept = on_demand()
    assert np.isnan(kept.row_sums()).all()
    for j in some:
        np.testing.assert_allclose(kept.column(j), F.matrix[:, j], rtol=1e-5, atol=1e-9)
        np.testing.assert_array_equal(kept.column(j), kept.column(j))
    np.testing.assert_allclose(kept.row_sums()[some], F.row_sums()[some], rtol=1e-5)
    # With no room to keep them, they come one by one.
    monkeypatch.setattr(columns, "KEPT_BYTES", 0)
    alone = on_demand()
    np.testing.assert_allclose(alone.column(some[0]), F.matrix[:, some[0]], rtol=1e-5, atol=1e-9)
    assert np.count_nonzero(np.isfinite(alone.row_sums())) == 1
    light = np.random.default_rng(1).random((len(patches.area), 3))
    np.testing.assert_allclose(alone.gather(light), F.gather(light), rtol=1e-5)
    np.testing.assert_array_equal(alone.area, patches.area)


def test_gathering_is_a_product_whatever_the_brightness(cube):
    _, F = dense(cube(divisions=3))
    light = np.random.default_rng(6).random((54, 3))
    for scale in (1e-60, 1.0, 1e60):
        np.testing.assert_allclose(F.gather(scale * light), scale * (F.matrix @ light), rtol=1e-5)
    np.testing.assert_array_equal(F.gather(np.zeros((54, 3))), np.zeros((54, 3)))
    np.testing.assert_array_equal(F.column(7), F.matrix[:, 7])


def test_a_matrix_that_does_not_fit_is_refused_before_it_is_made(cube, monkeypatch):
    monkeypatch.setattr(matrix, "available_memory", lambda: 2**20)
    with pytest.raises(RadiosityError, match=r"150 patches need \d+\.\d GiB of memory and 0\.0 GiB.*shooting"):
        next(dense_transport(mesh(cube(divisions=5)), None))


def test_progress_grows_to_the_end_and_closing_stops(box):
    patches = mesh(furnished(box, 8))
    steps = dense_transport(patches, None)
    fractions = [step.fraction for step in steps]
    assert fractions == sorted(fractions) and fractions[0] == 0.0 and fractions[-1] == 1.0
    with ThreadPoolExecutor(1) as executor:
        steps = dense_transport(patches, None, executor=executor)
        next(steps)
        next(steps)
        steps.close()
        # The executor was not ours to shut down.
        assert executor.submit(int, "7").result() == 7


def test_patches_without_area_neither_send_nor_receive(cube):
    patches = mesh(cube(divisions=2))
    corners, area = patches.corners.copy(), patches.area.copy()
    corners[0], area[0] = corners[0, :1], 0.0
    F = exhaust(dense_transport(replace(patches, corners=corners, area=area), None))
    np.testing.assert_array_equal(F.matrix[0], 0.0)
    np.testing.assert_array_equal(F.matrix[:, 0], 0.0)
    assert np.isfinite(F.matrix).all()
