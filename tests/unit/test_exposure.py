# SPDX-License-Identifier: GPL-3.0-or-later
"""Any radiance becomes a colour that a screen can show (T10)."""

import numpy as np
import pytest

from core.exposure import LUMINANCE, automatic_exposure, expose


def test_a_stop_doubles():
    colour = np.array([[0.1, 0.2, 0.05]])
    np.testing.assert_allclose(expose(colour, 1.0), 2.0 * colour)
    np.testing.assert_allclose(expose(colour, -2.0), 0.25 * colour)


def test_nothing_wraps_and_nothing_that_is_no_number_passes():
    radiance = np.array([[-1.0, 0.5, 1.5], [np.nan, np.inf, -np.inf], [1e300, 0.0, 1.0]])
    shown = np.array([[0.0, 0.5, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]])
    np.testing.assert_array_equal(expose(radiance), shown)
    assert ((expose(radiance, 2000.0) >= 0.0) & (expose(radiance, 2000.0) <= 1.0)).all()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_automatic_exposure_does_not_depend_on_the_unit(scale):
    radiance = np.random.default_rng(1).random((500, 3))
    shown = expose(scale * radiance, automatic_exposure(scale * radiance))
    np.testing.assert_allclose(shown, expose(radiance, automatic_exposure(radiance)), rtol=1e-9)


def test_automatic_exposure_shows_nearly_all_below_white():
    radiance = np.random.default_rng(2).gamma(2.0, 3.0, (5000, 1)) * np.ones(3)
    shown = expose(radiance, automatic_exposure(radiance)) @ LUMINANCE
    assert np.mean(shown < 1.0) > 0.9
    assert np.percentile(shown, 95) == pytest.approx(0.9, rel=1e-6)


def test_lamps_do_not_darken_the_room():
    radiance = np.vstack((np.full((900, 3), 0.3), np.full((100, 3), 5000.0)))
    alone = automatic_exposure(radiance[:900])
    assert automatic_exposure(radiance, np.arange(1000) >= 900) == alone
    # Without being told which they are, the room must at least not go black.
    assert expose(radiance[:900], automatic_exposure(radiance)).mean() > 0.05


def test_a_scene_of_lamps_only_is_exposed_for_them():
    lamps = np.full((4, 3), 100.0)
    assert expose(lamps, automatic_exposure(lamps, np.ones(4, dtype=bool))).max() == pytest.approx(0.9)


@pytest.mark.parametrize("radiance", [np.zeros((3, 3)), np.zeros((0, 3)), np.full((2, 3), np.nan)])
def test_without_light_nothing_is_exposed(radiance):
    assert automatic_exposure(radiance) == 0.0
