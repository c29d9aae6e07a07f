# SPDX-License-Identifier: GPL-3.0-or-later
"""The Bake button: what it writes, what it leaves alone, what it says."""

import json

import numpy as np
import pytest

from tests.blender.building import (
    CUBE_FACES,
    CUBE_VERTICES,
    SQUARE,
    add_mesh,
    add_room,
    add_square,
    colors,
    glowing,
)


@pytest.fixture
def bake(scene, blender):
    """Give a function that presses the button."""

    def bake(**settings):
        for name, value in settings.items():
            setattr(scene.radiosity, name, value)
        return blender.ops.radiosity.bake()

    return bake


def lit_pair(scene):
    """Add a lamp that shines down on a floor; return both."""
    lamp = add_square(scene, "Lamp", glowing(reflectance=0.0, radiance=5.0), z=1.0)
    lamp.rotation_euler = (np.pi, 0.0, 0.0)
    lamp.location = (0.0, 1.0, 2.0)
    return lamp, add_square(scene, "Floor")


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.9])
def test_a_closed_room_glows_as_the_geometric_series_says(bake, scene, domain, reflectance):
    room = add_room(scene, material=glowing(reflectance, radiance=2.0))
    assert bake(domain=domain, tolerance=1e-6) == {'FINISHED'}
    layer = room.data.color_attributes["Radiosity"]
    assert (layer.domain, layer.data_type) == (domain, 'FLOAT_COLOR')
    found = colors(room.data)
    assert len(found) == (24 if domain == 'CORNER' else 8)
    # B = E / (1 - rho) in a furnace, whatever its shape; radiance likewise.
    np.testing.assert_allclose(found[:, :3], 2.0 / (1.0 - reflectance), rtol=2e-3)
    np.testing.assert_array_equal(found[:, 3], 1.0)


def test_a_mirrored_and_squashed_furnace_is_a_furnace(bake, scene):
    room = add_room(scene, material=glowing(0.5, radiance=1.0))
    room.scale, room.rotation_euler = (-2.0, 1.0, 0.5), (0.1, 0.2, 0.3)
    bake(tolerance=1e-6)
    np.testing.assert_allclose(colors(room.data)[:, :3], 2.0, rtol=2e-3)


def test_colors_of_a_mirrored_mesh_go_to_the_right_corners(bake, scene):
    def light(scale):
        obj = add_mesh(scene, f"Floor {scale}", [(-2, -1, 0), (2, -1, 0), (2, 1, 0), (-2, 1, 0)], [(0, 1, 2, 3)])
        obj.scale = (scale, 1, 1)
        bake(max_edge=0.25)
        found = colors(obj.data)[:, 0]
        obj.hide_render = True
        return found

    # A lamp over the right end of the floor.
    add_mesh(scene, "Lamp", [(1.5, -1, 1), (1.5, 1, 1), (2, 1, 1), (2, -1, 1)], [(0, 1, 2, 3)], glowing(0, 5.0))
    plain, mirrored = light(1), light(-1)
    assert plain[1] > 2.0 * plain[0] and plain[2] > 2.0 * plain[3]
    np.testing.assert_allclose(mirrored, plain[[1, 0, 3, 2]], rtol=1e-5)


def test_the_attribute_is_active_for_display_and_render(bake, scene):
    _, floor = lit_pair(scene)
    floor.data.color_attributes.new("Painted", 'BYTE_COLOR', 'CORNER')
    floor.data.attributes.active_color_name = "Painted"
    floor.data.attributes.default_color_name = "Painted"
    bake(attribute="Light")
    layers = floor.data.color_attributes
    assert layers.active_color.name == "Light"
    assert layers[layers.render_color_index].name == "Light"
    assert set(layers.keys()) == {"Painted", "Light"}


@pytest.mark.parametrize(
    "kind, domain", [('FLOAT_COLOR', 'POINT'), ('BYTE_COLOR', 'CORNER'), ('FLOAT_COLOR', 'CORNER')]
)
def test_an_attribute_of_that_name_is_overwritten(bake, scene, kind, domain):
    _, floor = lit_pair(scene)
    floor.data.color_attributes.new("Radiosity", kind, domain)
    bake()
    layer = floor.data.color_attributes["Radiosity"]
    assert (layer.domain, layer.data_type) == ('CORNER', 'FLOAT_COLOR')
    assert [name for name in floor.data.attributes.keys() if name.startswith("Radiosity")] == ["Radiosity"]
    assert colors(floor.data)[:, 0].min() > 0.0


def test_baking_twice_gives_the_same_bits(bake, scene):
    _, floor = lit_pair(scene)
    bake(max_edge=0.25)
    first = colors(floor.data)
    bake()
    np.testing.assert_array_equal(colors(floor.data), first)


def test_undo_takes_the_colors_back_in_one_step(scene, blender):
    lit_pair(scene)
    blender.ops.ed.undo_push(message="Before")
    # Called with undo, as the button does; a script's call leaves no undo step by itself.
    assert blender.ops.radiosity.bake('EXEC_DEFAULT', True) == {'FINISHED'}
    assert all("Radiosity" in mesh.color_attributes for mesh in blender.data.meshes)
    assert blender.ops.ed.undo() == {'FINISHED'}
    assert len(blender.data.meshes) == 2
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)


@pytest.mark.parametrize("mode", ['EDIT', 'SCULPT', 'VERTEX_PAINT', 'WEIGHT_PAINT', 'TEXTURE_PAINT'])
def test_undo_takes_all_colors_back_from_every_mode(scene, blender, mode):
    _, floor = lit_pair(scene)
    blender.context.view_layer.objects.active = floor
    floor.select_set(True)
    blender.ops.ed.undo_push(message="Before")
    blender.ops.object.mode_set('EXEC_DEFAULT', True, mode=mode)
    assert blender.ops.radiosity.bake('EXEC_DEFAULT', True) == {'FINISHED'}
    assert colors(floor.data)[:, 0].min() > 0.0
    # In these modes Undo knows the active mesh only, so the bake leaves them.
    assert floor.mode == ('OBJECT' if mode in {'EDIT', 'SCULPT', 'TEXTURE_PAINT'} else mode)
    assert blender.ops.ed.undo() == {'FINISHED'}
    assert len(blender.data.meshes) == 2
    assert not any("Radiosity" in mesh.color_attributes for mesh in blender.data.meshes)


def test_a_closed_generator_leaves_the_scene_as_it_was(addon, scene, blender):
    lit_pair(scene)
    scene.radiosity.max_edge = 0.2
    steps = addon("operators").start_bake(blender.context)
    stages = [next(steps).stage for _ in range(3)]
    steps.close()
    assert len(set(stages)) > 1
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)


def test_no_reference_to_blenders_data_outlives_the_first_step(addon, scene, blender):
    _, floor = lit_pair(scene)
    blender.ops.ed.undo_push(message="First")
    floor.location.x = 0.25
    blender.ops.ed.undo_push(message="Moved")
    steps = addon("operators").start_bake(blender.context)
    next(steps)
    # Undo frees and makes anew what the scene is made of.
    blender.ops.ed.undo()
    for _ in steps:
        pass
    floor = blender.data.objects["Floor"]
    assert floor.location.x == 0.0
    assert colors(floor.data)[:, 0].min() > 0.0


@pytest.mark.parametrize("change", ["edited", "removed"])
def test_a_mesh_that_changes_during_the_bake_is_an_error_and_nothing_is_written(addon, error, scene, blender, change):
    lamp, floor = lit_pair(scene)
    steps = addon("operators").start_bake(blender.context)
    next(steps)
    if change == "edited":
        floor.data.clear_geometry()
        floor.data.from_pydata(SQUARE[:3], [], [(0, 1, 2)])
    else:
        blender.data.meshes.remove(floor.data)
    with pytest.raises(error, match=r"'Floor'.*bake again"):
        for _ in steps:
            pass
    assert not lamp.data.color_attributes


@pytest.mark.parametrize("kind", ["attribute", "UV map", "vertex group"])
def test_an_object_that_cannot_take_the_name_is_left_out_and_named(scene, blender, bake, kind):
    lamp, floor = lit_pair(scene)
    if kind == "attribute":
        floor.data.attributes.new("Radiosity", 'FLOAT', 'POINT')
    elif kind == "UV map":
        floor.data.uv_layers.new(name="Radiosity")
    else:
        floor.vertex_groups.new(name="Radiosity")
    assert bake() == {'FINISHED'}
    (warning,) = blender.context.window_manager.radiosity.warnings.splitlines()
    assert "'Floor'" in warning and "another name" in warning
    assert "Radiosity" in lamp.data.color_attributes and not floor.data.color_attributes
    blender.data.objects.remove(lamp)
    floor.data.materials.append(glowing())
    with pytest.raises(RuntimeError, match=r"'Floor'.*another name"):
        bake()
    assert bake(attribute="Light") == {'FINISHED'}


def test_many_attributes_are_no_obstacle(scene, bake):
    _, floor = lit_pair(scene)
    for index in range(12):
        floor.data.color_attributes.new(f"Painted {index}", 'BYTE_COLOR', 'CORNER')
    for index in range(8):
        floor.data.uv_layers.new(name=f"UV {index}")
    bake()
    layers = floor.data.color_attributes
    assert len(layers) == 13 and layers.active_color.name == "Radiosity"
    assert layers[layers.render_color_index].name == "Radiosity"


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_bytes_are_clipped_and_tell_how_much_was(scene, blender, bake, domain):
    lamp, floor = lit_pair(scene)
    bake(domain=domain)
    exact = colors(floor.data)[:, :3]
    bake(data_type='BYTE_COLOR')
    layer = floor.data.color_attributes["Radiosity"]
    assert (layer.domain, layer.data_type) == (domain, 'BYTE_COLOR')
    # A step of sRGB is nowhere more than 1 / 110.
    assert 0.0 < exact.max() < 1.0
    np.testing.assert_allclose(colors(floor.data)[:, :3], exact, atol=0.5 / 110)
    # 5 became 1: nothing wrapped around.
    np.testing.assert_array_equal(colors(lamp.data), 1.0)
    (warning,) = blender.context.window_manager.radiosity.warnings.splitlines()
    assert warning.startswith("50.0% of the colors are brighter than 1")


def test_what_the_colors_tell_is_a_choice(scene, bake):
    lamp, floor = lit_pair(scene)
    wall = add_square(scene, "Wall")
    wall.rotation_euler.x = np.pi / 2.0
    found = {}
    for light in ('combined', 'lighting', 'direct', 'indirect'):
        bake(light=light)
        found[light] = np.concatenate([colors(obj.data)[:, :3] for obj in (floor, wall, lamp)])
    np.testing.assert_allclose(found['direct'] + found['indirect'], found['combined'], rtol=1e-6)
    assert (found['indirect'][:8] > 0.0).any()
    # Faces without a material reflect 0.8; the lamp reflects nothing and emits 5.
    np.testing.assert_allclose(0.8 * found['lighting'][:8], found['combined'][:8], rtol=1e-6)
    np.testing.assert_allclose(found['direct'][8:], 5.0, rtol=1e-6)
    assert found['lighting'][8:].max() < 1.0


def test_meshes_that_are_shared_get_the_first_objects_colors_and_a_warning(bake, scene, blender):
    _, floor = lit_pair(scene)
    copy = blender.data.objects.new("Dark Floor", floor.data)
    copy.location.z = -1.0
    scene.collection.objects.link(copy)
    bake()
    (warning,) = blender.context.window_manager.radiosity.warnings.splitlines()
    assert "'Floor'" in warning and "'Dark Floor'" in warning
    assert colors(floor.data)[:, 0].min() > 0.0


def test_linked_meshes_light_the_others_but_stay_as_they_are(bake, scene, blender, tmp_path):
    lamp, _ = lit_pair(scene)
    library = str(tmp_path / "library.blend")
    blender.data.libraries.write(library, {lamp})
    blender.data.objects.remove(lamp)
    blender.data.orphans_purge(do_recursive=True)
    with blender.data.libraries.load(library, link=True) as (_, loaded):
        loaded.objects = ["Lamp"]
    linked = loaded.objects[0]
    scene.collection.objects.link(linked)
    bake()
    assert colors(blender.data.objects["Floor"].data)[:, 0].min() > 0.0
    assert not linked.data.color_attributes
    assert "library" in blender.context.window_manager.radiosity.warnings
    blender.data.objects.remove(blender.data.objects["Floor"])
    with pytest.raises(RuntimeError, match="make it local"):
        bake()


@pytest.mark.parametrize(
    "prepare, message",
    [
        (lambda scene: None, "add a mesh"),
        (lambda scene: add_square(scene), "Emission Strength"),
        (lambda scene: add_square(scene, material=glowing(radiance=0.0)), "Emission Strength"),
        (lambda scene: setattr(lit_pair(scene)[0], "hide_render", True), "Emission Strength"),
    ],
    ids=["empty", "no emitter", "emitter of strength 0", "hidden emitter"],
)
def test_what_cannot_be_baked_is_said_and_changes_nothing(bake, scene, blender, prepare, message):
    prepare(scene)
    with pytest.raises(RuntimeError, match=message):
        bake()
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)
    assert not blender.context.window_manager.radiosity.running


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e20])
def test_a_vertex_nowhere_costs_its_faces_and_no_more(bake, scene, blender, value):
    lamp, floor = lit_pair(scene)
    floor.data.vertices[0].co.x = value
    bake()
    warnings = blender.context.window_manager.radiosity.warnings
    assert "Object 'Floor': 1 face with a vertex at no finite place within 1e+12 m is skipped" in warnings
    for obj in (lamp, floor):
        assert np.isfinite(colors(obj.data)).all()


@pytest.mark.parametrize("name", ["", "x" * 64, "ä" * 32])
def test_names_that_blender_would_cut_are_refused(addon, error, scene, name):
    with pytest.raises(error, match="bytes"):
        addon("destination").Destination(name)


@pytest.mark.parametrize("name", ["position", "sharp_face", ".hidden", "material_index"])
def test_names_that_blender_needs_itself_are_refused(addon, error, scene, name):
    with pytest.raises(error, match="Blender itself"):
        addon("destination").Destination(name)


def test_unknown_domains_and_types_are_refused(addon, error, scene):
    with pytest.raises(error, match="CORNER, POINT"):
        addon("destination").Destination(domain='FACE')
    with pytest.raises(error, match="FLOAT_COLOR, BYTE_COLOR"):
        addon("destination").Destination(data_type='FLOAT')


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


def test_the_last_bake_stays_for_the_panel_but_not_in_the_file(bake, scene, blender, tmp_path):
    lit_pair(scene)
    bake()
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


def test_patches_of_the_size_that_was_asked_for(bake, scene, blender):
    box = add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES, glowing())
    bake(max_edge=0.25)
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
