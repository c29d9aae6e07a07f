# SPDX-License-Identifier: GPL-3.0-or-later
"""The choices of a bake are checked when they are made."""

import pytest

from core.errors import RadiosityError
from core.settings import FORM_FACTORS, METHODS, QUALITIES, Settings


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("form_factors", FORM_FACTORS)
@pytest.mark.parametrize("quality", QUALITIES)
def test_everything_that_is_offered_is_taken(method, form_factors, quality):
    settings = Settings(method=method, form_factors=form_factors, quality=quality)
    assert (settings.method, settings.form_factors, settings.quality) == (method, form_factors, quality)


@pytest.mark.parametrize(
    ("choice", "told"),
    [
        ({"method": "photon"}, "gathering"),
        ({"form_factors": "disc"}, "hemicube"),
        ({"quality": "ultra"}, "production"),
        ({"sides": "both"}, "auto, front, back"),
        ({"max_edge": 0.0}, "0 m"),
        ({"max_edge": float("nan")}, "above 0 m"),
        ({"max_edge": float("inf")}, "above 0 m"),
        ({"subdivide": 0}, "from 1 up"),
        ({"subdivide": 1.5}, "from 1 up"),
        ({"iterations": 0}, "from 1 up"),
        ({"tolerance": -1e-9}, "from 0"),
        ({"tolerance": 1.0}, "below 1"),
        ({"tolerance": float("nan")}, "from 0"),
        ({"seed": -1}, "from 0 up"),
        ({"iterations": float("inf")}, "from 1 up"),
        ({"seed": float("nan")}, "from 0 up"),
    ],
)
def test_what_cannot_be_is_refused_with_what_can(choice, told):
    with pytest.raises(RadiosityError, match=told):
        Settings(**choice)


def test_settings_stay_as_they_are():
    with pytest.raises(AttributeError):
        Settings().seed = 3
