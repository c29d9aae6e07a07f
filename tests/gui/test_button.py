# SPDX-License-Identifier: GPL-3.0-or-later
"""The button in a real window: pressed with a pointer, undone, pressed again and cancelled."""

import pytest

from tests.gui import launch


@pytest.mark.skipif(bool(launch.missing()), reason=f"no window here: this machine lacks {launch.missing()}")
def test_the_button_bakes_undoes_and_cancels_in_a_window(tmp_path):
    result = launch.run(tmp_path, launch.ROOT / "example_blends" / "cornell_box.blend")
    assert result["passed"], "\n".join([*result["checks"], result["problem"]])
