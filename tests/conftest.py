# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep the tests away from the settings and extensions of whoever runs them."""

import os
import shutil
import sys
import tempfile

import pytest


def pytest_configure(config: pytest.Config) -> None:
    """Give Blender a user folder that is gone afterwards, before any test can import bpy."""
    if "bpy" in sys.modules:  # inside Blender it is too late: tests/run_in_blender.py has asked for a folder
        return
    folder = tempfile.mkdtemp(prefix="radiosity-tests-")
    os.environ["BLENDER_USER_RESOURCES"] = folder
    config.add_cleanup(lambda: shutil.rmtree(folder, ignore_errors=True))
