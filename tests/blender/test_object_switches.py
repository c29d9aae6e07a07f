# SPDX-License-Identifier: GPL-3.0-or-later
"""What is chosen for each object, and what Blender shows to which rays, decides what it does with light."""

import numpy as np
import pytest

from tests.blender.building import CUBE_FACES, CUBE_VERTICES, SQUARE, add_light, add_mesh, add_square, colors, glowing


@pytest.fixture
def bake(extension, scene, blender):
    """Give a function that bakes and returns the colors of the floor."""

    def bake():
        scene.radiosity.quality = 'preview'
        assert blender.ops.radiosity.bake() == {'FINISHED'}
        return colors(scene.objects["Floor"].data)[:, 0]

    return bake


@pytest.fixture
def stage(scene, blender):
    """A floor, a lamp over it or a panel that shines, and a board between them."""

    def build(lamp):
        add_square(scene, "Floor", glowing(0.5, 0.0), size=2.0)
        if lamp:
            add_light(scene, 'POINT', (1, 1, 2))
        else:
            panel = add_square(scene, "Panel", glowing(0.0, 1.0), size=2.0)
            panel.location, panel.rotation_euler = (0, 2, 2), (np.pi, 0, 0)
        return add_mesh(scene, "Board", (np.array(SQUARE) * 2.0 + (0, 0, 1)), [(0, 1, 2, 3)], glowing(0.0, 0.0))

    return build


ALL_ON = {"occludes": True, "shades": True, "reflects": True, "emits": True}


@pytest.mark.parametrize(
    ("switches", "visible", "off"),
    [
        ({}, {}, ()),
        ({"occlude": False}, {}, ("occludes", "shades")),
        ({"reflect": False}, {}, ("reflects",)),
        ({"emit": False}, {}, ("emits",)),
        ({}, {"visible_diffuse": False}, ("shades", "reflects", "emits")),
        ({}, {"visible_shadow": False}, ("occludes",)),
        ({}, {"visible_camera": False, "visible_glossy": False, "is_holdout": True, "is_shadow_catcher": True}, ()),
    ],
)
def test_switches_and_visibility_reach_the_faces(read, scene, blender, switches, visible, off):
    add_square(scene)
    scene.world = blender.data.worlds.new("Sky")
    box = add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES)
    for name, value in switches.items():
        setattr(box.radiosity, name, value)
    for name, value in visible.items():
        setattr(box, name, value)
    found = read().scene
    for name, on in (ALL_ON | dict.fromkeys(off, False)).items():
        assert getattr(found, name).tolist() == [True] + [on] * 6, name
    # Shadow rays find all lamps but a sky of one color.
    scene.world = None
    found = read().scene
    np.testing.assert_array_equal(found.shades, found.occludes)


@pytest.mark.parametrize("lamp", [True, False])
def test_what_does_not_block_casts_no_shadow(bake, stage, scene, blender, lamp):
    board = stage(lamp)
    dark = bake()
    assert dark.max() < 1e-6 if lamp else dark.max() < 0.2
    board.radiosity.occlude = False
    through = bake()
    assert colors(board.data)[:, :3].max() == 0.0  # black, but read
    board.radiosity.exclude = True
    np.testing.assert_allclose(through, bake(), rtol=2e-3)
    assert through.min() > dark.max()


def test_an_excluded_object_is_as_if_it_were_not_there(read, bake, stage, scene, blender):
    board = stage(lamp=False)
    board.radiosity.exclude = True
    assert read().scene.object_names == ("Floor", "Panel")
    bake()
    assert not board.data.color_attributes
    scene.objects["Panel"].radiosity.exclude = True
    lamp = add_light(scene, 'POINT')
    assert len(read().scene.lamps) == 1
    lamp.radiosity.emit = False
    assert not read().scene.lamps
    lamp.radiosity.emit, lamp.radiosity.exclude = True, True
    assert not read().scene.lamps


def test_an_object_that_does_not_receive_gets_no_colors_but_gives_light(bake, stage, scene):
    board = stage(lamp=False)
    dark = bake()
    board.data.color_attributes.remove(board.data.color_attributes[0])
    board.radiosity.receive = False
    np.testing.assert_array_equal(bake(), dark)
    assert not board.data.color_attributes


def test_a_patch_size_of_its_own_is_in_the_units_of_the_scene(read, scene):
    scene.unit_settings.scale_length = 0.01
    add_square(scene)
    own = add_square(scene, "Own")
    own.radiosity.max_edge = 0.25
    found = read().scene
    assert np.isnan(found.max_edge[0]) and found.max_edge[1] == pytest.approx(0.0025)


def test_an_instance_may_do_what_both_its_object_and_its_instancer_may(read, scene, blender):
    inside = blender.data.collections.new("Inside")
    box = add_mesh(scene, "Box", SQUARE, [(0, 1, 2, 3)], collection=inside)
    box.radiosity.emit, box.radiosity.max_edge = False, 0.5
    for name, size in (("Small", 0.25), ("Large", 0.0)):
        shown = blender.data.objects.new(name, None)
        shown.instance_type, shown.instance_collection = 'COLLECTION', inside
        shown.radiosity.occlude, shown.radiosity.max_edge = name == "Large", size
        scene.collection.objects.link(shown)
    found = read().scene
    assert found.object_names == ("Small > Box", "Large > Box")
    assert found.emits.tolist() == [False, False]
    assert found.occludes.tolist() == [False, True]
    assert found.max_edge.tolist() == [0.25, 0.5]


def test_switches_stay_with_the_file(scene, blender, tmp_path):
    add_square(scene).radiosity.receive = False
    path = tmp_path / "switches.blend"
    blender.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    blender.ops.wm.open_mainfile(filepath=str(path))
    assert not blender.data.objects["Square"].radiosity.receive
    copy = blender.data.objects["Square"].copy()
    assert not copy.radiosity.receive


def test_the_panel_is_there_for_what_has_faces_and_for_lamps(addon, scene, blender):
    panels = addon("object_panel")
    square = add_square(scene)
    camera = blender.data.objects.new("Camera", blender.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    for panel in (panels.RADIOSITY_PT_object, panels.RADIOSITY_PT_active_object):
        assert panel.is_registered
        for obj, there in ((square, True), (camera, False)):
            with blender.context.temp_override(object=obj):
                assert panel.poll(blender.context) is there
