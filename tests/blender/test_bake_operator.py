# SPDX-License-Identifier: GPL-3.0-or-later
"""The Bake button: what it writes, what it leaves alone, what it says."""

import json

import numpy as np
import pytest

from tests.blender.building import (
    CUBE_FACES,
    CUBE_VERTICES,
    add_mesh,
    add_room,
    colors,
    glowing,
    lit_pair,
)


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.9])
def test_a_closed_room_glows_as_the_geometric_series_says(press, scene, domain, reflectance):
    room = add_room(scene, material=glowing(reflectance, radiance=2.0))
    assert press(domain=domain, tolerance=1e-6) == {'FINISHED'}
    layer = room.data.color_attributes["Radiosity"]
    assert (layer.domain, layer.data_type) == (domain, 'FLOAT_COLOR')
    found = colors(room.data)
    assert len(found) == (24 if domain == 'CORNER' else 8)
    # B = E / (1 - rho) in a furnace, whatever its shape; radiance likewise.
    np.testing.assert_allclose(found[:, :3], 2.0 / (1.0 - reflectance), rtol=2e-3)
    np.testing.assert_array_equal(found[:, 3], 1.0)


def test_a_mirrored_and_squashed_furnace_is_a_furnace(press, scene):
    room = add_room(scene, material=glowing(0.5, radiance=1.0))
    room.scale, room.rotation_euler = (-2.0, 1.0, 0.5), (0.1, 0.2, 0.3)
    press(tolerance=1e-6)
    np.testing.assert_allclose(colors(room.data)[:, :3], 2.0, rtol=2e-3)


def test_colors_of_a_mirrored_mesh_go_to_the_right_corners(press, scene):
    def light(scale):
        obj = add_mesh(scene, f"Floor {scale}", [(-2, -1, 0), (2, -1, 0), (2, 1, 0), (-2, 1, 0)], [(0, 1, 2, 3)])
        obj.scale = (scale, 1, 1)
        press(max_edge=0.25)
        found = colors(obj.data)[:, 0]
        obj.hide_render = True
        return found

    # A lamp over the right end of the floor.
    add_mesh(scene, "Lamp", [(1.5, -1, 1), (1.5, 1, 1), (2, 1, 1), (2, -1, 1)], [(0, 1, 2, 3)], glowing(0, 5.0))
    plain, mirrored = light(1), light(-1)
    assert plain[1] > 2.0 * plain[0] and plain[2] > 2.0 * plain[3]
    np.testing.assert_allclose(mirrored, plain[[1, 0, 3, 2]], rtol=1e-5)


def test_baking_twice_gives_the_same_bits(press, scene):
    _, floor = lit_pair(scene)
    press(max_edge=0.25)
    first = colors(floor.data)
    press()
    np.testing.assert_array_equal(colors(floor.data), first)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e20])
def test_a_vertex_nowhere_costs_its_faces_and_no_more(press, scene, blender, value):
    lamp, floor = lit_pair(scene)
    floor.data.vertices[0].co.x = value
    press()
    warnings = blender.context.window_manager.radiosity.warnings
    assert "Object 'Floor': 1 face with a vertex at no finite place within 1e+12 m is skipped" in warnings
    for obj in (lamp, floor):
        assert np.isfinite(colors(obj.data)).all()


def test_a_running_bake_keeps_the_button_from_being_pressed_again(scene, blender):
    status = blender.context.window_manager.radiosity
    lit_pair(scene)
    status.running = True
    try:
        with pytest.raises(RuntimeError, match="running"):
            blender.ops.radiosity.bake()
    finally:
        status.running = False
    assert blender.ops.radiosity.bake.poll()


def test_invoked_in_background_it_runs_to_the_end(scene, blender):
    _, floor = lit_pair(scene)
    assert blender.ops.radiosity.bake('INVOKE_DEFAULT') == {'FINISHED'}
    assert "Radiosity" in floor.data.color_attributes


def test_the_report_has_what_the_command_prints(addon, scene, blender, core):
    lit_pair(scene)
    context = blender.context
    done = core("progress").exhaust(addon("operators").start_bake(context))
    report = json.loads(json.dumps(done.report))
    assert report["objects"] == [
        {"name": "Lamp", "corners": 4, "written": True},
        {"name": "Floor", "corners": 4, "written": True},
    ]
    assert report["patches"] == 2 and report["warnings"] == []
    assert report["scene"]["objects"] == 2
    seconds = report["seconds"]
    assert seconds["total"] >= seconds["read"] + seconds["write"] > 0.0
    assert addon("operators").sentence(report).startswith("Baked 2 objects, 2 patches in ")


def test_the_panel_and_the_last_line_tell_what_to_act_on(addon, scene, blender, core):
    # Nearly white rooms at one place, one of them turned inside out.
    for name in ("Room", "Other"):
        add_room(scene, name, glowing(0.98))
    scene.objects["Other"].data.flip_normals()
    scene.radiosity.quality, scene.radiosity.iterations = 'preview', 5
    report = core("progress").exhaust(addon("operators").start_bake(blender.context)).report
    figures = dict(addon("operators").figures(report))
    assert figures["Iterations"] == "5, not converged"
    assert figures["Lit Islands"] == "1 front, 1 back"
    assert [line.split(":")[0] for line in report["warnings"]] == ["Not converged after 5 iterations", "Object 'Other'"]
    assert addon("operators").sentence(report).endswith(" s, not converged; 2 warnings in the Radiosity panel")


def test_light_that_nobody_sees_is_told(bake, scene):
    lamp, _ = lit_pair(scene)
    strength = lamp.data.materials[0].node_tree.nodes["Principled BSDF"].inputs["Emission Strength"]
    for value, told in ((1e-4, True), (1.0, False)):
        strength.default_value = value
        assert any(line.startswith("The light is faint: no color is above 0.0001") for line in bake()) == told


def test_the_last_bake_stays_for_the_panel_but_not_in_the_file(press, scene, blender, tmp_path):
    lit_pair(scene)
    press()
    figures = dict(json.loads(blender.context.window_manager.radiosity.figures))
    assert figures["Patches"] == "2"
    path = str(tmp_path / "saved.blend")
    blender.ops.wm.save_as_mainfile(filepath=path)
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    blender.ops.wm.open_mainfile(filepath=path)
    assert blender.context.window_manager.radiosity.figures == ""
    assert blender.context.scene.radiosity.attribute == "Radiosity"


def test_settings_reach_the_core_in_metres(addon, scene):
    chosen = scene.radiosity
    chosen.method, chosen.form_factors, chosen.quality = 'shooting', 'hemicube', 'high'
    chosen.iterations, chosen.tolerance, chosen.subdivide, chosen.seed = 7, 0.25, 3, 5
    settings = addon("properties").core_settings(scene)
    assert (settings.method, settings.form_factors, settings.quality) == ("shooting", "hemicube", "high")
    assert (settings.iterations, settings.tolerance, settings.subdivide, settings.seed) == (7, 0.25, 3, 5)
    assert settings.light == "combined"
    assert settings.max_edge is None
    chosen.max_edge = 50.0
    scene.unit_settings.scale_length = 0.01
    assert np.isclose(addon("properties").core_settings(scene).max_edge, 0.5)


def test_patches_of_the_size_that_was_asked_for(press, scene, blender):
    box = add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES, glowing())
    press(max_edge=0.25)
    figures = dict(json.loads(blender.context.window_manager.radiosity.figures))
    assert figures["Patches"] == str(6 * 16)
    assert len(box.data.polygons) == 6


def test_the_viewport_it_was_pressed_in_shows_the_colors(scene, blender):
    lit_pair(scene)
    window = blender.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == 'VIEW_3D')
    shading = area.spaces.active.shading
    shading.type, shading.color_type = 'SOLID', 'MATERIAL'
    blender.ops.radiosity.bake()
    assert shading.color_type == 'MATERIAL'
    with blender.context.temp_override(window=window, area=area):
        blender.ops.radiosity.bake()
    assert (shading.color_type, shading.light) == ('VERTEX', 'FLAT')
