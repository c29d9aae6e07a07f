# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake writes: the attribute, its domain and type, the name it has and what else had it."""

import numpy as np
import pytest

from tests.blender.building import (
    add_square,
    colors,
    glowing,
    lit_pair,
)


def test_the_attribute_is_active_for_display_and_render(press, scene):
    _, floor = lit_pair(scene)
    floor.data.color_attributes.new("Painted", 'BYTE_COLOR', 'CORNER')
    floor.data.attributes.active_color_name = "Painted"
    floor.data.attributes.default_color_name = "Painted"
    press(attribute="Light")
    layers = floor.data.color_attributes
    assert layers.active_color.name == "Light"
    assert layers[layers.render_color_index].name == "Light"
    assert set(layers.keys()) == {"Painted", "Light"}


@pytest.mark.parametrize(
    "kind, domain", [('FLOAT_COLOR', 'POINT'), ('BYTE_COLOR', 'CORNER'), ('FLOAT_COLOR', 'CORNER')]
)
def test_an_attribute_of_that_name_is_overwritten(press, scene, kind, domain):
    _, floor = lit_pair(scene)
    floor.data.color_attributes.new("Radiosity", kind, domain)
    press()
    layer = floor.data.color_attributes["Radiosity"]
    assert (layer.domain, layer.data_type) == ('CORNER', 'FLOAT_COLOR')
    assert [name for name in floor.data.attributes.keys() if name.startswith("Radiosity")] == ["Radiosity"]
    assert colors(floor.data)[:, 0].min() > 0.0


@pytest.mark.parametrize("kind", ["attribute", "UV map", "vertex group"])
def test_an_object_that_cannot_take_the_name_is_left_out_and_named(scene, blender, press, kind):
    lamp, floor = lit_pair(scene)
    if kind == "attribute":
        floor.data.attributes.new("Radiosity", 'FLOAT', 'POINT')
    elif kind == "UV map":
        floor.data.uv_layers.new(name="Radiosity")
    else:
        floor.vertex_groups.new(name="Radiosity")
    assert press() == {'FINISHED'}
    (warning,) = blender.context.window_manager.radiosity.warnings.splitlines()
    assert "'Floor'" in warning and "another name" in warning
    assert "Radiosity" in lamp.data.color_attributes and not floor.data.color_attributes
    blender.data.objects.remove(lamp)
    floor.data.materials.append(glowing())
    with pytest.raises(RuntimeError, match=r"'Floor'.*another name"):
        press()
    assert press(attribute="Light") == {'FINISHED'}


def test_many_attributes_are_no_obstacle(scene, press):
    _, floor = lit_pair(scene)
    for index in range(12):
        floor.data.color_attributes.new(f"Painted {index}", 'BYTE_COLOR', 'CORNER')
    for index in range(8):
        floor.data.uv_layers.new(name=f"UV {index}")
    press()
    layers = floor.data.color_attributes
    assert len(layers) == 13 and layers.active_color.name == "Radiosity"
    assert layers[layers.render_color_index].name == "Radiosity"


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_bytes_are_clipped_and_tell_how_much_was(scene, blender, press, domain):
    lamp, floor = lit_pair(scene)
    press(domain=domain)
    exact = colors(floor.data)[:, :3]
    press(data_type='BYTE_COLOR')
    layer = floor.data.color_attributes["Radiosity"]
    assert (layer.domain, layer.data_type) == (domain, 'BYTE_COLOR')
    # A step of sRGB is nowhere more than 1 / 110.
    assert 0.0 < exact.max() < 1.0
    np.testing.assert_allclose(colors(floor.data)[:, :3], exact, atol=0.5 / 110)
    # 5 became 1: nothing wrapped around.
    np.testing.assert_array_equal(colors(lamp.data), 1.0)
    (warning,) = blender.context.window_manager.radiosity.warnings.splitlines()
    assert warning.startswith("50.0% of the colors are brighter than 1")


def test_what_the_colors_tell_is_a_choice(scene, press):
    lamp, floor = lit_pair(scene)
    wall = add_square(scene, "Wall")
    wall.rotation_euler.x = np.pi / 2.0
    found = {}
    for light in ('combined', 'lighting', 'direct', 'indirect'):
        press(light=light)
        found[light] = np.concatenate([colors(obj.data)[:, :3] for obj in (floor, wall, lamp)])
    np.testing.assert_allclose(found['direct'] + found['indirect'], found['combined'], rtol=1e-6)
    assert (found['indirect'][:8] > 0.0).any()
    # Faces without a material reflect 0.8; the lamp reflects nothing and emits 5.
    np.testing.assert_allclose(0.8 * found['lighting'][:8], found['combined'][:8], rtol=1e-6)
    np.testing.assert_allclose(found['direct'][8:], 5.0, rtol=1e-6)
    assert found['lighting'][8:].max() < 1.0


def test_meshes_that_are_shared_get_the_first_objects_colors_and_a_warning(press, scene, blender):
    _, floor = lit_pair(scene)
    copy = blender.data.objects.new("Dark Floor", floor.data)
    copy.location.z = -1.0
    scene.collection.objects.link(copy)
    press()
    told = blender.context.window_manager.radiosity.warnings.splitlines()
    (warning,) = [line for line in told if "is shared by 2 objects" in line]
    assert "'Floor'" in warning and "'Dark Floor'" in warning
    assert colors(floor.data)[:, 0].min() > 0.0


def test_linked_meshes_light_the_others_but_stay_as_they_are(press, scene, blender, tmp_path):
    lamp, _ = lit_pair(scene)
    library = str(tmp_path / "library.blend")
    blender.data.libraries.write(library, {lamp})
    blender.data.objects.remove(lamp)
    blender.data.orphans_purge(do_recursive=True)
    with blender.data.libraries.load(library, link=True) as (_, loaded):
        loaded.objects = ["Lamp"]
    linked = loaded.objects[0]
    scene.collection.objects.link(linked)
    press()
    assert colors(blender.data.objects["Floor"].data)[:, 0].min() > 0.0
    assert not linked.data.color_attributes
    assert "library" in blender.context.window_manager.radiosity.warnings
    blender.data.objects.remove(blender.data.objects["Floor"])
    with pytest.raises(RuntimeError, match="make it local"):
        press()


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
