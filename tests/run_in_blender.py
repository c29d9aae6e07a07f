# SPDX-License-Identifier: GPL-3.0-or-later
"""Run the tests inside a real Blender, whose Python has pytest.

    BLENDER_USER_RESOURCES=$(mktemp -d) blender -b --factory-startup --python-exit-code 1 \
        --python tests/run_in_blender.py -- -q tests

What follows the ``--`` goes to pytest; the exit code is pytest's.
"""

import os
import sys
from pathlib import Path

import pytest

if "BLENDER_USER_RESOURCES" not in os.environ:
    # Inside a running Blender it is too late to move them, and the tests install an extension.
    sys.exit("Set BLENDER_USER_RESOURCES to an empty folder first, so that your own settings stay as they are.")

os.chdir(Path(__file__).resolve().parents[1])
arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
sys.exit(int(pytest.main(arguments)))
