# SPDX-License-Identifier: GPL-3.0-or-later
"""Which faces block where materials let a part of the light through, and what light takes on of the others."""

import numpy as np
import pytest

from core.occlusion.sieve import blocking, tints

# More than enough to take turns.
MANY = 1000


@pytest.mark.parametrize("share", [0.25, 0.5, 0.7])
def test_of_many_faces_as_many_block_as_is_kept_of_the_light_wherever_they_are(share):
    blocks = blocking(np.full(MANY, share))
    assert blocks.mean() == pytest.approx(1 - share, abs=0.01)
    # In every row of some dozen faces, too.
    assert blocks.reshape(-1, 50).mean(axis=1) == pytest.approx(1 - share, abs=0.05)


def test_of_few_faces_those_that_are_nearly_opaque_block_and_of_many_those_that_are_nearly_clear_do_not():
    np.testing.assert_array_equal(blocking(np.array([0.0, 0.04, 0.06, 0.5, 1.0])), [True, True, False, False, False])
    many = blocking(np.concatenate([np.full(MANY, 0.5), np.full(100, 0.9), np.full(100, 0.1)]))
    assert not many[MANY : MANY + 100].any() and many[MANY + 100 :].all()


def test_what_goes_through_takes_on_the_tint_but_pays_no_toll_twice():
    few = np.array([(0.9, 0.5, 0.4), (0.1, 0.02, 0.02), (1.0, 1.0, 1.0)])
    np.testing.assert_array_equal(tints(few, blocking(few.mean(axis=1))), [few[0], (1, 1, 1), few[2]])
    many = np.tile((0.75, 0.5, 0.25), (MANY, 1))
    blocks = blocking(many.mean(axis=1))
    tint = tints(many, blocks)
    np.testing.assert_allclose(tint[~blocks], np.tile((1.5, 1.0, 0.5), (np.count_nonzero(~blocks), 1)))
    # Through all of them, those that block included, comes what is to come.
    np.testing.assert_allclose((tint * ~blocks[:, None]).mean(axis=0), many[0], atol=0.01)
