# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of the matrix by hemicubes, against the exact factors (T4)."""

import numpy as np
import pytest

from core.dense.columns import column_transport
from core.scene import BOTH, Scene
from core.transport import reciprocity_error
from tests.unit.matrices import NeverAsked, by_face, dense, furnished


def test_hemicubes_see_what_the_exact_factors_say(box):
    scene = furnished(box, 3)
    patches, exact = dense(scene)
    _, F = dense(scene, kernel="hemicube", occluders=NeverAsked())
    # A hemicube looks from the centre only, and in pixels.
    np.testing.assert_allclose(by_face(patches, F.matrix), by_face(patches, exact.matrix), atol=0.02)
    np.testing.assert_allclose(F.row_sums()[patches.face < 6][F.row_sums()[patches.face < 6] > 0.5], 1.0, atol=1e-3)
    assert 0.0 < reciprocity_error(F) < 0.25


def test_hemicubes_tell_both_sides_of_a_sheet_apart(box):
    sheet = np.array([(0, 0, 0.5), (1, 0, 0.5), (1, 1, 0.5), (0, 1, 0.5)], float)
    sides = [1, 1, 1, 1, 1, 1, BOTH, 2]
    scene = Scene.from_polygons([*box(), sheet, sheet * 0.5 + 0.25], 0.5, 1.0, sides=sides, divisions=np.full(8, 2))
    patches, F = dense(scene, kernel="hemicube")
    sheet_up, sheet_down = (patches.face == 6) & (patches.side > 0), (patches.face == 6) & (patches.side < 0)
    floor, ceiling, one_sided = patches.face == 0, patches.face == 1, patches.face == 7
    assert (F.matrix[np.ix_(ceiling, sheet_up)] > 0).any() and (F.matrix[np.ix_(floor, sheet_down)] > 0).any()
    for i, j in ((ceiling, sheet_down), (floor, sheet_up), (sheet_up, floor), (floor, ceiling)):
        np.testing.assert_array_equal(F.matrix[np.ix_(i, j)], 0.0)
    # The small sheet hides what is above it, and radiates down only.
    np.testing.assert_array_equal(F.matrix[np.ix_(ceiling, one_sided)], 0.0)
    assert (F.matrix[np.ix_(sheet_up, one_sided)] > 0).any() == (patches.centre[one_sided, 2] > 0.5).any()


def test_hemicube_columns_send_what_the_hemicubes_see(box):
    scene = furnished(box, 2)
    patches, F = dense(scene, kernel="hemicube")
    column = column_transport(patches, None, kernel="hemicube")
    for j in (0, 7, 30):
        np.testing.assert_allclose(column.column(j), F.matrix[j] * patches.area[j] / patches.area, rtol=1e-5)
        assert column.row_sums()[j] == pytest.approx(F.row_sums()[j], rel=1e-5)
    assert column.rays == 3 * 3 * 128**2
