# SPDX-License-Identifier: GPL-3.0-or-later
"""Images on surfaces: on disk, packed, tiled, missing, with pixels that are no numbers."""

import numpy as np

from tests.blender.building import add_light, add_mesh, add_shader, add_square, colors, node_material
from tests.blender.networks import Network, picture, square


def test_a_missing_image_is_named_and_grey(read_surfaces, blender, scene, tmp_path):
    network = Network(blender, "Torn")
    image = blender.data.images.new("Lost", 8, 8)
    image.filepath_raw, image.source = str(tmp_path / "nowhere.png"), 'FILE'
    (surfaces,), notes = read_surfaces(square(scene, network.diffuse(network.image(image=image))))
    np.testing.assert_allclose(surfaces.reflectance, 0.5)
    assert len(notes) == 1 and "'Torn'" in notes[0] and "'Lost'" in notes[0]


def test_images_on_disk_and_packed_are_read_alike(read_surfaces, blender, scene, tmp_path):
    made = picture(blender, "Made")
    made.filepath_raw, made.file_format = str(tmp_path / "made.png"), 'PNG'
    made.save()
    loaded = blender.data.images.load(str(tmp_path / "made.png"))
    objects = []
    for image in (made, loaded):
        network = Network(blender)
        objects.append(square(scene, network.diffuse(network.image(image=image))))
    (from_memory, from_disk), _ = read_surfaces(*objects)
    np.testing.assert_allclose(from_disk.reflectance, from_memory.reflectance, rtol=0.01)
    assert not loaded.has_data  # Blender holds no more than before


def test_tiles_and_loose_image_nodes_do_not_stop_a_reading(read_surfaces, blender, scene):
    tiled = blender.data.images.new("Tiles", 16, 16, tiled=True)
    one, other = Network(blender, "Tiled"), Network(blender, "Empty")
    objects = [
        square(scene, one.diffuse(one.image(image=tiled))),
        square(scene, other.diffuse(other('ShaderNodeTexImage', "Color")), "Second"),
    ]
    surfaces, notes = read_surfaces(*objects)
    assert np.isfinite(surfaces[0].reflectance).all()
    np.testing.assert_allclose(surfaces[1].reflectance, 0.5)
    assert any("'Empty'" in note for note in notes)


def test_a_textured_floor_lights_walls_with_its_colors(extension, blender, scene):
    """Red on one half, green on the other: a wall beside each."""
    network = Network(blender, "Halves")
    image = blender.data.images.new("Halves", 64, 64)
    pixels = np.zeros((64, 64, 4), np.float32)
    pixels[:, :32, 0] = pixels[:, 32:, 1] = pixels[..., 3] = 1.0
    image.pixels.foreach_set(pixels.ravel())
    network.principled(Base__Color=network.image(image=image))
    square(scene, network.material, "Floor")
    white = Network(blender, "White")
    white.diffuse((0.5, 0.5, 0.5, 1))
    for name, x in (("Left", 0.0), ("Right", 1.0)):
        inwards = (0, 1, 2, 3) if x == 0.0 else (3, 2, 1, 0)
        add_mesh(scene, name, [(x, 0, 0), (x, 1, 0), (x, 1, 1), (x, 0, 1)], [inwards], white.material)
    add_light(scene, 'SUN')
    assert blender.ops.radiosity.bake() == {'FINISHED'}
    color = {name: colors(scene.objects[name].data)[:, :3] for name in ("Left", "Right", "Floor")}
    left, right = (color[name].mean(axis=0) for name in ("Left", "Right"))
    assert left[0] > 1.5 * left[1] and right[1] > 1.5 * right[0]
    # The floor's corners show their own half.
    np.testing.assert_allclose(color["Floor"][[0, 3]].argmax(axis=1), 0)
    np.testing.assert_allclose(color["Floor"][[1, 2]].argmax(axis=1), 1)


def test_pixels_that_are_no_numbers_or_too_bright_do_no_harm(scene):
    import bpy

    image = bpy.data.images.new("Hot", 4, 4, float_buffer=True, is_data=True)
    pixels = np.full((4, 4, 4), 0.5, np.float32)
    pixels[0, :, 0] = (np.nan, np.inf, -np.inf, -3.0)
    pixels[1, :, 1] = 1e38
    image.pixels.foreach_set(pixels.ravel())
    material, output = node_material("Hot")
    shader = add_shader(material, 'ShaderNodeBsdfPrincipled', output.inputs["Surface"], Emission_Strength=100.0)
    texture = material.node_tree.nodes.new('ShaderNodeTexImage')
    texture.image = image
    for socket in ("Base Color", "Emission Color"):
        material.node_tree.links.new(texture.outputs["Color"], shader.inputs[socket])
    square = add_square(scene, material=material)
    square.data.uv_layers.new(name="UVMap")
    assert bpy.ops.radiosity.bake() == {'FINISHED'}
    assert np.isfinite(colors(square.data)).all()
    assert colors(square.data).max() > 1.0
    # 1e38 is finite, but not what becomes of it.
    first, second, *_ = bpy.context.window_manager.radiosity.warnings.splitlines()
    assert first.startswith("Material 'Hot': 3 pixels of image 'Hot' ") and "negative" in second
