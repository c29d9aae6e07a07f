# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a bake: its pixels are the baked colors, and nothing of its making is left."""

import numpy as np
import pytest

from tests.blender.building import add_shader, node_material


@pytest.fixture
def picture(addon):
    return addon("picture")


@pytest.fixture
def small(picture, monkeypatch):
    """Draw little: what is tested are colors, not edges."""
    monkeypatch.setattr(picture, "LONGER_SIDE", 60)
    monkeypatch.setattr(picture, "SAMPLES", 4)


def add_quad(bpy, scene, name, corners, color):
    """Add one face with a baked color all over it, and a material that would show green."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.color_attributes.new("Radiosity", 'FLOAT_COLOR', 'CORNER').data.foreach_set("color", (*color, 1.0) * 4)
    material = bpy.data.materials.get("Green") or bpy.data.materials.new("Green")
    material.diffuse_color = (0.0, 1.0, 0.0, 1.0)
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def add_camera(bpy, scene, location):
    """Add a camera that looks down."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = location
    camera.data.angle = np.radians(40.0)
    scene.collection.objects.link(camera)
    scene.camera = camera


def draw(bpy, picture, path, **options):
    """Draw the scene; return the picture's stored values (height, width, 3), 0 to 1, its lowest row first."""
    bpy.context.view_layer.update()
    picture.render_picture(path, bpy.context.evaluated_depsgraph_get(), **options)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = 'Non-Color'
    width, height = image.size
    pixels = np.zeros(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, -1)[..., :3]


def srgb(linear):
    """Encode as IEC 61966-2-1 has it."""
    linear = np.asarray(linear, dtype=float)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def two_walls(bpy, scene):
    """A red and a too bright quad side by side below the camera, black around them."""
    add_quad(bpy, scene, "Red", [(-1, -1, 0), (0, -1, 0), (0, 1, 0), (-1, 1, 0)], (0.5, 0.02, 0.1))
    add_quad(bpy, scene, "Bright", [(0, -1, 0), (1, -1, 0), (1, 1, 0), (0, 1, 0)], (7.0, 0.25, 0.0))
    add_camera(bpy, scene, (0, 0, 4))


def test_pixels_are_the_baked_colors_clamped(blender, scene, picture, small, tmp_path):
    two_walls(blender, scene)
    scene.render.resolution_x, scene.render.resolution_y = 300, 200
    pixels = draw(blender, picture, tmp_path / "a.png", exposure=0.0)
    assert pixels.shape == (40, 60, 3)
    tolerance = 3.0 / 255.0  # eight bits, and the dither
    np.testing.assert_allclose(pixels[20, 20], srgb([0.5, 0.02, 0.1]), atol=tolerance)
    np.testing.assert_allclose(pixels[20, 40], srgb([1.0, 0.25, 0.0]), atol=tolerance)
    np.testing.assert_allclose(pixels[1, 1], 0.0, atol=tolerance)


def test_exposure_is_in_stops(blender, scene, picture, small, tmp_path):
    two_walls(blender, scene)
    pixels = draw(blender, picture, tmp_path / "a.png", exposure=-2.0)
    height, width = pixels.shape[:2]
    np.testing.assert_allclose(pixels[height // 2, width // 2 - 8], srgb([0.125, 0.005, 0.025]), atol=3.0 / 255.0)


def test_images_are_multiplied_before_what_is_too_bright_is_cut(blender, scene, picture, small, tmp_path):
    two_walls(blender, scene)
    image = blender.data.images.new("Grey", 4, 4, float_buffer=True)
    image.pixels.foreach_set(np.tile(np.float32([0.125, 0.125, 0.125, 1.0]), 16))
    image.pack()
    material, output = node_material("Textured")
    shader = add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs["Surface"])
    add_shader(material, 'ShaderNodeTexImage', shader.inputs["Color"]).image = image
    wall = blender.data.objects["Bright"].data
    wall.uv_layers.new(name="Map")
    wall.materials[0] = material
    pixels = draw(blender, picture, tmp_path / "a.png", exposure=-1.0, lighting=True)
    height, width = pixels.shape[:2]
    found = pixels[height // 2, width // 2 + 8]
    np.testing.assert_allclose(found, srgb([7.0 / 16.0, 0.25 / 16.0, 0.0]), atol=4.0 / 255.0)


def test_without_a_camera_a_closed_room_is_seen_from_within(blender, scene, picture, small, tmp_path):
    low, high = -1.0, 1.0
    walls = {
        "Floor": [(low, low, low), (high, low, low), (high, high, low), (low, high, low)],
        "Ceiling": [(low, low, high), (low, high, high), (high, high, high), (high, low, high)],
        "Front": [(low, low, low), (low, low, high), (high, low, high), (high, low, low)],
        "Back": [(low, high, low), (high, high, low), (high, high, high), (low, high, high)],
        "Left": [(low, low, low), (low, high, low), (low, high, high), (low, low, high)],
        "Right": [(high, low, low), (high, low, high), (high, high, high), (high, high, low)],
    }
    colors = {"Floor": (0, 0, 1), "Ceiling": (1, 1, 1), "Back": (0, 1, 0), "Left": (1, 0, 0), "Right": (1, 1, 0)}
    for name, corners in walls.items():
        add_quad(blender, scene, name, corners, colors.get(name, (1, 0, 1)))
    scene.render.resolution_x = scene.render.resolution_y = 100
    pixels = draw(blender, picture, tmp_path / "a.png", exposure=0.0)
    seen = {
        name: pixels[row, column] > 0.5
        for name, row, column in [
            ("Back", 30, 30),
            ("Left", 30, 5),
            ("Right", 30, 54),
            ("Floor", 5, 30),
            ("Ceiling", 54, 30),
        ]
    }
    assert {name: tuple(map(int, values)) for name, values in seen.items()} == {
        name: color for name, color in colors.items() if name in seen
    }


@pytest.mark.parametrize("with_camera", [True, False])
def test_nothing_is_left_over_and_the_scene_is_as_before(blender, scene, picture, small, tmp_path, with_camera):
    two_walls(blender, scene)
    if not with_camera:
        camera = scene.camera
        blender.data.batch_remove([camera, camera.data])

    def state():
        kinds = ("objects", "meshes", "materials", "scenes", "cameras", "images", "worlds", "node_groups")
        found = {kind: [(item.name, item.users) for item in getattr(blender.data, kind)] for kind in kinds}
        render = scene.render
        return found, render.engine, render.filepath, render.resolution_x, scene.camera, blender.context.window.scene

    before = state()
    draw(blender, picture, tmp_path / "a.png")
    assert state() == before
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_a_failure_is_one_error_and_leaves_no_file(error, blender, scene, picture, small, tmp_path):
    two_walls(blender, scene)
    names = [item.name for item in blender.data.scenes]
    with pytest.raises(error, match='color attribute "Other"'):
        draw(blender, picture, tmp_path / "a.png", attribute="Other")
    with pytest.raises(error, match="Cannot write"):
        draw(blender, picture, tmp_path / "missing" / "a.png")
    assert [item.name for item in blender.data.scenes] == names
    assert list(tmp_path.iterdir()) == []
