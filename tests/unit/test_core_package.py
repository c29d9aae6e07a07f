# SPDX-License-Identifier: GPL-3.0-or-later
"""The package itself: light to import, its public names where they are promised."""

import subprocess
import sys
from pathlib import Path

import pytest

import core

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", core.__all__)
def test_public_names_are_there_when_asked_for(name):
    assert getattr(core, name).__name__ == name


def test_other_names_are_not():
    with pytest.raises(AttributeError, match="module 'core' has no attribute 'nothing'"):
        _ = core.nothing


def test_importing_the_package_loads_neither_numpy_nor_blender():
    code = "import core, sys; print(sorted({'numpy', 'bpy', 'mathutils'} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_every_name_comes_without_blender():
    code = f"import core, sys; [getattr(core, name) for name in {core.__all__}]; print('bpy' in sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "False"
