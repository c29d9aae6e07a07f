# SPDX-License-Identifier: GPL-3.0-or-later
"""The example scenes: what their script makes, what they promise, what they look like when they are baked."""

from pathlib import Path

import numpy as np
import pytest

from tests.blender.building import colors

EXAMPLES = Path(__file__).resolve().parents[2] / "example_blends"
NAMES = ("cornell_box", "thesis_room", "furnace", "two_rooms", "daylight", "textured_room", "still_life")
UNDER_A_SKY = {"daylight", "still_life"}
MAKE_AND_COMPARE = """
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, {examples!r})
import make_examples


def meshes(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    found = {{}}
    for obj in bpy.context.scene.objects:
        if obj.type == 'MESH':
            points = np.zeros(3 * len(obj.data.vertices), dtype=np.float32)
            obj.data.vertices.foreach_get("co", points)
            found[obj.name] = (points, obj.data.materials[0].name)
    return found


assert set(make_examples.EXAMPLES) == set({names!r}), "an example is not tested"
for name in {names!r}:
    made, kept = meshes(make_examples.make(name, Path({folder!r}))), meshes(Path({examples!r}) / f"{{name}}.blend")
    assert made.keys() == kept.keys(), name
    for obj in made:
        np.testing.assert_allclose(made[obj][0], kept[obj][0], atol=1e-6, err_msg=obj)
        assert made[obj][1] == kept[obj][1], obj
"""


@pytest.fixture
def bake(extension, blender):
    """Give a function that opens an example and bakes it."""

    def run(name, **settings):
        blender.ops.wm.open_mainfile(filepath=str(EXAMPLES / f"{name}.blend"))
        for setting, value in settings.items():
            setattr(blender.context.scene.radiosity, setting, value)
        assert blender.ops.radiosity.bake() == {'FINISHED'}
        return blender.context.scene.objects

    return run


def radiance(obj):
    """Return the baked radiance at the corners of an object, (c, 3)."""
    return colors(obj.data)[:, :3].astype(float)


def corners(obj):
    """Return the positions of the corners of an object, (c, 3) [m]."""
    points = np.zeros(3 * len(obj.data.vertices), dtype=np.float32)
    obj.data.vertices.foreach_get("co", points)
    vertex = np.zeros(len(obj.data.loops), dtype=np.int32)
    obj.data.loops.foreach_get("vertex_index", vertex)
    return points.reshape(-1, 3)[vertex]


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_small_and_has_what_a_picture_takes(extension, blender, name):
    path = EXAMPLES / f"{name}.blend"
    assert path.stat().st_size < 500_000
    blender.ops.wm.open_mainfile(filepath=str(path))
    scene = blender.context.scene
    assert scene.camera is not None
    assert (scene.world is not None) == (name in UNDER_A_SKY)
    assert all(obj.data.materials for obj in scene.objects if obj.type == 'MESH')


def test_the_script_makes_the_examples_that_are_here(run_blender, tmp_path):
    done = run_blender(MAKE_AND_COMPARE.format(examples=str(EXAMPLES), folder=str(tmp_path), names=NAMES))
    assert done.returncode == 0, done.stdout + done.stderr


# The matrix has no noise; its rows are exact but for the sampling of what stands between two patches.
@pytest.mark.parametrize(("method", "mean_error", "worst"), [("gathering", 0.002, 0.01), ("hierarchical", 0.01, 0.05)])
def test_the_furnace_reads_two_everywhere(bake, method, mean_error, worst):
    error = np.concatenate([radiance(obj) / 2.0 - 1.0 for obj in bake("furnace", method=method) if obj.type == 'MESH'])
    assert np.sqrt(np.mean(error**2)) < mean_error
    assert np.abs(error).max() < worst


def test_every_surface_of_cornells_box_looks_into_it(bake):
    for obj in bake("cornell_box", method='gathering', form_factors='centre', iterations=8):
        if obj.type == 'MESH':
            assert radiance(obj).max(axis=1).mean() > 0.05, obj.name


def test_the_walls_of_cornells_box_color_what_is_near_them(bake):
    objects = bake("cornell_box", method='gathering', form_factors='centre', iterations=8)
    wall = objects["Back Wall"]
    x, light = corners(wall)[:, 0], radiance(wall)
    redness = light[:, 0] / light[:, 1]
    assert redness[x < -0.2].min() > 1.05 * redness[np.abs(x) < 0.05].max()
    assert redness[x > 0.2].max() < redness[np.abs(x) < 0.05].min()


def test_light_reaches_the_second_room_through_the_door_only(bake):
    objects = bake("two_rooms", method='hierarchical', quality='preview')
    lit, dark = (radiance(objects[f"{room} Ceiling"]).mean() for room in ("Lit", "Dark"))
    assert 0.0 < dark < 0.5 * lit
    # On the wall across from the door what lies straight behind it is the brightest; nothing shines through the walls.
    side = objects["Dark Side Wall"]
    position, light = corners(side), radiance(side).mean(axis=1)
    opposite = (np.abs(position[:, 1] - 1.625) < 0.5) & (position[:, 2] < 1.5)
    assert light[opposite].mean() > 2.0 * light[position[:, 2] > 2.2].mean()
