# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices at the same place: found among the round numbers that artists and imports use."""

import numpy as np
import pytest

from core.places import places

GRIDS = {"tenths": 0.1 * np.arange(20), "eighths": np.arange(-9, 9) / 8, "even": np.linspace(-3.0, 3.0, 19)}


@pytest.mark.parametrize("steps", GRIDS.values(), ids=list(GRIDS))
def test_each_place_of_a_lattice_has_one_number(steps):
    lattice = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    order = np.random.default_rng(0).permutation(3 * len(lattice)) % len(lattice)
    points = lattice[order]
    place = places(points)
    np.testing.assert_array_equal(points[place], points)
    assert len(np.unique(place)) == len(lattice)


def test_what_is_apart_by_a_bit_stays_apart_and_minus_zero_is_zero():
    points = np.array([(0.0, 1.0, -0.0), (np.nextafter(0.0, 1.0), 1.0, 0.0), (-0.0, 1.0, 0.0)])
    assert places(points).tolist() == [0, 1, 0]
    assert places(np.zeros((0, 3))).shape == (0,)
