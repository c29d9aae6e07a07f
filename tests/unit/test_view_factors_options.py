# SPDX-License-Identifier: GPL-3.0-or-later
"""What `form_factor_matrix` takes and refuses: rooms that are told to be closed, tolerances, bad polygons."""

import numpy as np
import pytest

from core import form_factor_matrix
from core.errors import RadiosityError
from core.exact import visible_exchange
from tests.unit.flat_shapes import areas, check_reciprocity, square


def test_closed_keeps_reciprocity_and_scales_rows(box):
    # A seam of a millimetre is left open.
    polygons = box((2, 1, 1))
    polygons[1] = polygons[1] * (0.999, 1, 1)
    F = form_factor_matrix(polygons, closed=True)
    np.testing.assert_allclose(F.sum(axis=1), 1, atol=1e-9)
    check_reciprocity(F, areas(polygons))
    np.testing.assert_allclose(F, form_factor_matrix(polygons), atol=2e-3)


def test_closed_lets_a_box_rest_on_the_floor_but_no_sheet_see_its_back(box):
    polygons = [*box((4, 3, 2.5)), *box((1, 1, 1), (1, 1, 0), inward=False)]
    F = form_factor_matrix(polygons, closed=True)
    assert F[6, 0] == pytest.approx(1, abs=1e-6)
    np.testing.assert_allclose(F.sum(axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(F[7:], form_factor_matrix(polygons)[7:], atol=1e-4)
    sheet = square(1, 1) + (1, 1, 0)
    F = form_factor_matrix([*box((4, 3, 2.5)), sheet, sheet[::-1]], closed=True)
    assert F[6, 7] == F[7, 6] == 0


@pytest.mark.parametrize("missing", range(6))
def test_closed_refuses_an_open_box(box, missing):
    polygons = box()
    del polygons[missing]
    with pytest.raises(RadiosityError, match="do not enclose"):
        form_factor_matrix(polygons, closed=True)


def test_closed_refuses_what_cannot_be_scaled():
    # Each of two plates sees nothing but the other, and their areas differ.
    plates = [square(1), square(1.01, 0.01, up=False) - (0.005, 0.005, 0)]
    assert form_factor_matrix(plates).sum(axis=1).min() > 0.95
    with pytest.raises(RadiosityError, match="contradict"):
        form_factor_matrix(plates, closed=True)


def test_a_tolerance_out_of_reach_is_an_error(monkeypatch):
    monkeypatch.setattr(visible_exchange, "MOST_ROUNDS", 4)
    with pytest.raises(RadiosityError, match="allow a larger one"):
        form_factor_matrix([square(1), square(1, 1, up=False), square(0.5, 0.5)], tolerance=1e-12)


@pytest.mark.parametrize(
    ("polygon", "message"),
    [
        (np.zeros((4, 2)), r"Polygon 1: expected corners of shape \(k, 3\)"),
        ([(0, 0, 0), (1, 0)], "Polygon 1: expected an array"),
        (square(1)[:2], "Polygon 1: has 2 corners"),
        (np.zeros((3, 3)), "Polygon 1: has no area"),
        (np.array([(0, 0, 0), (1, 0, 0), (3, 0, 0)]), "Polygon 1: has no area"),
        (np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)]), "Polygon 1: is not planar"),
        (np.array([(0, 0, 0), (1, 0, 0), (1, np.nan, 0)]), "Polygon 1: a coordinate is not finite"),
    ],
)
def test_bad_polygons_are_named(polygon, message):
    with pytest.raises(RadiosityError, match=message):
        form_factor_matrix([square(1), polygon])


@pytest.mark.parametrize("tolerance", [0, -1, 1, np.nan])
def test_tolerance_is_checked(tolerance):
    with pytest.raises(RadiosityError, match="between 0 and 1"):
        form_factor_matrix([square(1)], tolerance=tolerance)
