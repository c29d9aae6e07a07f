# SPDX-License-Identifier: GPL-3.0-or-later
"""A computation aside: its steps, its result and its end are the same, and long steps tell that they go on."""

from threading import Event, get_ident

import numpy as np
import pytest

from core.attendance import attended
from core.progress import Progress, exhaust, told


def test_steps_and_result_are_passed_on_from_another_thread():
    seen = []

    def computed():
        for index in range(3):
            seen.append(get_ident())
            yield Progress("Links", index / 3, radiosity=np.ones((1, 3)))
        return 7

    heard = []

    def kept(step):
        heard.append(step)
        return step

    assert exhaust(told(attended(computed(), "Patches", every=60.0), kept)) == 7
    assert [step.fraction for step in heard] == [0, 1 / 3, 2 / 3] and all(step.radiosity is not None for step in heard)
    assert len(set(seen)) == 1 and seen[0] != get_ident()


def test_a_long_step_is_told_again_and_again_until_it_is_done():
    go_on = Event()

    def computed():
        yield Progress("Links", 0.5, memory=8, radiosity=np.ones((1, 3)))
        assert go_on.wait(60)
        yield Progress("Final gather", 0.0)

    steps = attended(computed(), "Patches", every=0.001)
    while (step := next(steps)).stage == "Patches":
        pass
    assert (step.stage, step.memory) == ("Links", 8)
    for _ in range(3):
        step = next(steps)
        # Not the memory once more, nor an array that is being written.
        assert (step.stage, step.fraction, step.memory, step.radiosity) == ("Links", 0.5, 0, None)
    go_on.set()
    while (step := next(steps)).stage == "Links":
        pass
    assert step.stage == "Final gather"
    exhaust(steps)


def test_what_goes_wrong_is_raised_to_who_waits():
    def computed():
        yield Progress("Links", 0.0)
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        exhaust(attended(computed(), "Patches"))


def test_closing_between_two_steps_closes_the_computation_at_once():
    closed = Event()

    def computed():
        try:
            yield Progress("Links", 0.0)
        finally:
            closed.set()

    steps = attended(computed(), "Patches", every=60.0)
    next(steps)
    steps.close()
    assert closed.is_set()


def test_closing_within_a_long_step_does_not_wait_for_it():
    go_on, closed = Event(), Event()

    def computed():
        try:
            assert go_on.wait(60)
            yield Progress("Links", 0.0)
            raise AssertionError("went on")
        finally:
            closed.set()

    steps = attended(computed(), "Patches", every=0.001)
    assert next(steps).stage == "Patches"
    steps.close()
    assert not closed.is_set()
    go_on.set()
    assert closed.wait(60)
