# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that nobody would make on purpose: any nodes, lamps, meshes, modifiers and modes, thrown together.

A few with fixed seeds in the suite; `make fuzz` tries many more, and tells the seed of what fails.
"""

import os

import numpy as np
import pytest

from tests.blender.any_scene import any_file
from tests.blender.building import colors

FILES = int(os.environ.get("FUZZ_FILES", "3"))
FIRST = int(os.environ.get("FUZZ_SEED", "0"))

KINDS = ("objects", "meshes", "materials", "images", "scenes", "collections", "node_groups", "worlds", "lights")


def inventory(bpy):
    return {kind: len(getattr(bpy.data, kind)) for kind in KINDS}


def shapes(bpy):
    return {
        mesh.name_full: (len(mesh.vertices), len(mesh.loops), [item and item.name for item in mesh.materials])
        for mesh in bpy.data.meshes
        if not mesh.is_editmode
    }


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("seed", range(FIRST, FIRST + FILES))
def test_any_file_is_lit_or_refused_in_words(scene, blender, seed):
    if blender.app.version < (5, 0, 0) and "FUZZ_FILES" not in os.environ:
        pytest.skip("older Blenders crash in the next file after nodes of some kinds were made")
    rng = np.random.default_rng(seed)
    any_file(blender, rng, scene)
    for obj in blender.data.objects:
        if obj.mode == 'EDIT':
            obj.update_from_editmode()
    before, counts = shapes(blender), inventory(blender)
    try:
        assert blender.ops.radiosity.bake() == {'FINISHED'}
    except RuntimeError as error:
        assert "Traceback" not in str(error), str(error)
        assert inventory(blender) == counts and shapes(blender) == before
        return
    after = shapes(blender)
    assert {name: after[name] for name in before} == before
    made = 0
    if scene.radiosity.target == 'COPY':
        (found,) = [found for found in blender.data.collections if "radiosity_hidden" in found]
        made = len(found.objects)
    expected = counts | {"objects": counts["objects"] + made, "meshes": counts["meshes"] + made}
    assert inventory(blender) == expected | {"collections": counts["collections"] + (made > 0)}
    for data in blender.data.meshes:
        for layer in data.color_attributes:
            if layer.name == "Radiosity":
                values = colors(data)
                assert np.isfinite(values).all() and values.min(initial=0.0) >= 0.0
