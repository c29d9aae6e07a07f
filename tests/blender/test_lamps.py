# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps and worlds against Cycles, kind by kind, on a small white floor that Cycles bakes at its vertices."""

import math
from math import radians

import numpy as np
import pytest

from tests.blender.building import add_mesh, add_shader, add_square, node_material

REFLECTANCE = 0.5
SIDE = 12  # vertices along a side of the floor


@pytest.fixture
def read(addon, scene, blender):
    """Give a function that reads the context's scene as the core's."""
    reader = addon("scene_reader")

    def read():
        context = blender.context
        return reader.read_scene(context.scene, context.view_layer, context.evaluated_depsgraph_get()).scene

    return read


@pytest.fixture
def floor(scene, blender):
    """Add a diffuse floor of 4 m x 4 m with an attribute to bake to."""
    material, output = node_material("White")
    add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs["Surface"], Color=(*[REFLECTANCE] * 3, 1.0))
    steps = np.linspace(-2, 2, SIDE)
    vertices = [(x, y, 0) for y in steps for x in steps]
    rows = [SIDE * j + i for j in range(SIDE - 1) for i in range(SIDE - 1)]
    obj = add_mesh(scene, "Floor", vertices, [(k, k + 1, k + SIDE + 1, k + SIDE) for k in rows], material)
    obj.data.color_attributes.active_color = obj.data.color_attributes.new("Cycles", 'FLOAT_COLOR', 'POINT')
    return obj


@pytest.fixture
def cycles(scene, blender, floor):
    """Give a function that bakes the floor with Cycles and returns the irradiance at its vertices."""

    def bake(samples=512):
        scene.render.engine = 'CYCLES'
        settings = scene.cycles
        settings.device, settings.samples, settings.seed = 'CPU', samples, 0
        settings.use_adaptive_sampling = settings.use_denoising = False
        settings.sample_clamp_direct = settings.sample_clamp_indirect = 0.0
        # Direct light alone: blockers reflect nothing back.
        settings.max_bounces = settings.diffuse_bounces = 0
        for obj in blender.context.view_layer.objects:
            obj.select_set(obj == floor)
        blender.context.view_layer.objects.active = floor
        blender.ops.object.bake(type='COMBINED', target='VERTEX_COLORS')
        layer = floor.data.color_attributes["Cycles"]
        values = np.zeros(4 * len(layer.data), np.float32)
        layer.data.foreach_get("color", values)
        return values.reshape(-1, 4)[:, :3] * math.pi / REFLECTANCE

    return bake


@pytest.fixture
def direct(read, core, floor):
    """Give a function that returns the direct light at the vertices of the floor, as a bake of high quality does."""

    def direct():
        scene = read()
        occluders = core("visibility").scene_occluders(scene, core("meshing").mesh(scene))
        points = np.array([floor.matrix_world @ vertex.co for vertex in floor.data.vertices])
        normals = np.tile((0.0, 0.0, 1.0), (len(points), 1))
        settings = core("settings").Settings(quality="high")
        return core("lighting.lamps").direct_light(scene, points, normals, settings, occluders), scene

    return direct


def add_lamp(scene, kind, location=(0.3, -0.4, 1.5), rotation=(0.2, 0.1, 0.3), scale=(1, 1, 1), **properties):
    """Add a light object; give up where this Blender has not one of its properties."""
    import bpy

    light = bpy.data.lights.new("Lamp", kind)
    for name, value in properties.items():
        if not hasattr(light, name):
            pytest.skip(f"this Blender's lights have no {name}")
        setattr(light, name, value)
    obj = bpy.data.objects.new("Lamp", light)
    obj.location, obj.rotation_euler, obj.scale = location, rotation, scale
    scene.collection.objects.link(obj)
    return obj


def agree(found, expected, mean=0.01, rms=0.03):
    """Compare with Cycles: the mean of each channel, and the scatter."""
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=mean)
    assert np.sqrt(np.mean((found - expected) ** 2)) < rms * expected.mean()


BALL = {"energy": 100, "use_soft_falloff": False, "shadow_soft_size": 0.4}
SPOT = {"energy": 100, "shadow_soft_size": 0.05, "spot_size": radians(80), "spot_blend": 0.4}
RECTANGLE = {"energy": 50, "shape": 'RECTANGLE', "size": 0.6, "size_y": 1.4}
KINDS = {
    "point": ('POINT', {"energy": 100, "shadow_soft_size": 0, "color": (1, 0.5, 0.2)}),
    "soft point": ('POINT', BALL | {"use_soft_falloff": True}),
    "ball": ('POINT', BALL),
    "scaled ball": ('POINT', BALL | {"scale": (2, 1, 0.5)}),
    "ball half below": ('POINT', BALL | {"location": (0.3, 0.4, 0.2)}),
    "ball on its own terms": ('POINT', BALL | {"normalize": False}),
    "point on its own terms": ('POINT', {"energy": 9, "shadow_soft_size": 0, "normalize": False}),
    "exposed": ('POINT', {"energy": 100, "exposure": 1.5}),
    "warm": ('POINT', {"energy": 100, "use_temperature": True, "temperature": 3000, "color": (1, 0.5, 0.2)}),
    "spot": ('SPOT', SPOT),
    "sharp spot": ('SPOT', SPOT | {"spot_blend": 0, "shadow_soft_size": 0}),
    "large spot": ('SPOT', SPOT | {"shadow_soft_size": 0.3, "use_soft_falloff": False, "spot_size": radians(110)}),
    "stretched spot": ('SPOT', SPOT | {"scale": (1, 2, 1.5)}),
    "mirrored spot": ('SPOT', SPOT | {"scale": (1, 1, -1), "rotation": (3.0, 0, 0)}),
    "sun": ('SUN', {"energy": 3, "angle": 0.01, "rotation": (0.6, 0.2, 0.3)}),
    "large sun": ('SUN', {"energy": 3, "angle": 2.5, "rotation": (1.0, 0.2, 0.3)}),
    "sun on its own terms": ('SUN', {"energy": 3, "angle": 0.5, "normalize": False}),
    "square": ('AREA', {"energy": 50, "shape": 'SQUARE', "size": 0.8}),
    "rectangle": ('AREA', RECTANGLE),
    "disk": ('AREA', {"energy": 50, "shape": 'DISK', "size": 1.2}),
    "ellipse": ('AREA', RECTANGLE | {"shape": 'ELLIPSE'}),
    "spread": ('AREA', RECTANGLE | {"spread": radians(90)}),
    "spread disk": ('AREA', {"energy": 50, "shape": 'DISK', "size": 0.8, "spread": radians(60)}),
    "scaled rectangle": ('AREA', RECTANGLE | {"scale": (2, 0.5, 3)}),
    "mirrored rectangle": ('AREA', RECTANGLE | {"scale": (-1, 1, -1), "rotation": (3.3, 0, 0)}),
    "rectangle on its own terms": ('AREA', RECTANGLE | {"normalize": False, "scale": (2, 0.5, 3)}),
    "standing rectangle": ('AREA', RECTANGLE | {"location": (0, 0.9, 0.3), "rotation": (radians(80), 0, 0)}),
}


@pytest.mark.parametrize("kind", KINDS)
def test_lamps_in_the_open(kind, scene, cycles, direct):
    add_lamp(scene, KINDS[kind][0], **KINDS[kind][1])
    found, read = direct()
    agree(found, cycles(), rms=0.015)
    assert read.warnings == ()


@pytest.mark.parametrize("kind", ["ball", "soft point", "large spot", "disk", "spread", "large sun"])
def test_soft_shadows(kind, scene, cycles, direct):
    plate = add_square(scene, "Plate", z=0.7, size=1.2)
    plate.location = (-0.6, -0.5, 0)
    add_lamp(scene, KINDS[kind][0], **KINDS[kind][1])
    found, _ = direct()
    expected = cycles(1024)
    agree(found, expected)
    # The plate does something.
    plate.hide_render = True
    assert direct()[0].mean() > 1.05 * expected.mean()


def make_world(blender, scene):
    """Give the scene a world of nodes and return its tree, output and background."""
    scene.world = blender.data.worlds.new("Sky")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    nodes = scene.world.node_tree.nodes
    nodes.clear()
    output, background = nodes.new('ShaderNodeOutputWorld'), nodes.new('ShaderNodeBackground')
    scene.world.node_tree.links.new(background.outputs[0], output.inputs["Surface"])
    background.inputs["Color"].default_value = (0.2, 0.5, 1.0, 1.0)
    return scene.world.node_tree, background


def test_a_world_of_one_color_and_what_stands_in_it(scene, blender, cycles, direct):
    _, background = make_world(blender, scene)
    background.inputs["Strength"].default_value = 2.0
    np.testing.assert_allclose(direct()[0], np.tile(2 * math.pi * np.array((0.2, 0.5, 1.0)), (SIDE**2, 1)), rtol=1e-6)
    add_square(scene, "Plate", z=0.7, size=1.5)
    wall = add_square(scene, "Wall", size=4.0)
    wall.rotation_euler, wall.location = (radians(90), 0, 0), (-2, 2.1, 0)
    agree(direct()[0], cycles())


def test_a_world_by_direction(scene, blender, cycles, direct):
    tree, background = make_world(blender, scene)
    turned = tree.nodes.new('ShaderNodeVectorMath')
    turned.operation = 'MULTIPLY_ADD'
    turned.inputs[1].default_value, turned.inputs[2].default_value = (0.5, -0.3, 0.2), (0.5, 0.5, 0.5)
    tree.links.new(tree.nodes.new('ShaderNodeTexCoord').outputs["Generated"], turned.inputs[0])
    tree.links.new(turned.outputs[0], background.inputs["Color"])
    add_square(scene, "Plate", z=0.7, size=1.5)
    data = {name: set(getattr(blender.data, name).keys()) for name in ("scenes", "cameras", "objects", "images")}
    found, read = direct()
    assert data == {name: set(getattr(blender.data, name).keys()) for name in data}
    agree(found, cycles())
    assert [lamp.radiance.shape[2] for lamp in read.lamps] == [3]


def test_a_world_lights_as_diffuse_rays_see_it(scene, blender, cycles, direct):
    tree, background = make_world(blender, scene)
    path, mix = tree.nodes.new('ShaderNodeLightPath'), tree.nodes.new('ShaderNodeMixShader')
    shown, lost = tree.nodes.new('ShaderNodeBackground'), tree.nodes.new('ShaderNodeTexEnvironment')
    shown.inputs["Color"].default_value = (1.0, 0.0, 0.0, 1.0)
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(background.outputs[0], mix.inputs[1])
    tree.links.new(shown.outputs[0], mix.inputs[2])
    output = tree.get_output_node('CYCLES')
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    scene.world.cycles_visibility.camera = False
    add_square(scene, "Plate", z=0.7, size=1.5)
    worlds = set(blender.data.worlds)
    found, read = direct()
    assert set(blender.data.worlds) == worlds and not read.warnings
    agree(found, cycles())
    # Without its file an image would be pink, and within fog there would be no sky.
    tree.links.new(lost.outputs[0], background.inputs["Color"])
    tree.links.new(tree.nodes.new('ShaderNodeVolumeScatter').outputs[0], output.inputs["Volume"])
    background.inputs["Strength"].default_value = 3.0
    found, read = direct()
    assert read.lamps[0].radiance.mean(axis=(0, 1)) == pytest.approx([1.5, 1.5, 1.5])
    assert ["volume" in line for line in read.warnings] == [True, False]
    assert ["has no image" in line for line in read.warnings] == [False, True]


def test_the_sun_in_a_sky_casts_its_own_shadow(scene, blender, cycles, direct):
    tree, background = make_world(blender, scene)
    sky = tree.nodes.new('ShaderNodeTexSky')
    sky.sun_elevation, sky.sun_rotation = radians(40), 1.0
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.1
    add_square(scene, "Plate", z=0.7, size=1.5)
    found, read = direct()
    assert len(read.lamps) == 2
    assert math.degrees(read.lamps[1].angle) == pytest.approx(0.545, rel=0.2)
    agree(found, cycles())


def test_what_gives_no_light(scene, blender, floor, read):
    add_lamp(scene, 'POINT', energy=0.0)
    add_lamp(scene, 'POINT', energy=10.0).hide_render = True
    add_lamp(scene, 'POINT', energy=10.0).visible_diffuse = False
    add_lamp(scene, 'AREA', energy=10.0).data.cycles.is_portal = True
    assert read().lamps == ()
    assert not read().warnings
    negative = add_lamp(scene, 'POINT', energy=-10.0)
    assert read().lamps == ()
    assert [negative.name in warning for warning in read().warnings] == [True]


def test_what_is_approximated_is_told(scene, blender, floor, read):
    linked = add_lamp(scene, 'POINT', energy=10.0)
    linked.light_linking.receiver_collection = blender.data.collections.new("Lit")
    textured = add_lamp(scene, 'POINT', energy=10.0)
    if textured.data.node_tree is None:
        textured.data.use_nodes = True
    tree = textured.data.node_tree
    emission = next(node for node in tree.nodes if node.bl_idname == 'ShaderNodeEmission')
    emission.inputs["Strength"].default_value = 3.0
    assert read().lamps[1].intensity[0] == pytest.approx(3 * read().lamps[0].intensity[0])
    tree.links.new(tree.nodes.new('ShaderNodeTexIES').outputs[0], emission.inputs["Strength"])
    warnings = read().warnings
    assert ["light linking" in warning for warning in warnings] == [True, False]
    assert [f"'{textured.name}'" in warning and "'IES Texture'" in warning for warning in warnings] == [False, True]


def test_nodes_of_a_lamp_are_read(scene, floor, read):
    _, lamp = (add_lamp(scene, 'POINT', energy=10.0) for _ in range(2))
    if lamp.data.node_tree is None:
        lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    emission = next(node for node in tree.nodes if node.bl_idname == 'ShaderNodeEmission')
    warm, falloff = tree.nodes.new('ShaderNodeBlackbody'), tree.nodes.new('ShaderNodeLightFalloff')
    warm.inputs[0].default_value, falloff.inputs["Strength"].default_value = 3000.0, 50.0
    tree.links.new(warm.outputs[0], emission.inputs["Color"])
    tree.links.new(falloff.outputs["Quadratic"], emission.inputs["Strength"])
    bright, colored = (found.intensity for found in read().lamps)
    red, green, blue = colored / (50.0 * bright)
    assert red > 1.3 > green > 0.5 > blue > 0.05
    tree.links.new(falloff.outputs["Constant"], emission.inputs["Strength"])
    assert [f"Light '{lamp.name}': 'Light Falloff' is not read" in line for line in read().warnings] == [True]


def test_lamps_shrink_with_the_unit(scene, floor, read, direct):
    # What Cycles takes for a scene in metres looks the same in centimetres.
    add_lamp(scene, 'POINT', energy=100.0, shadow_soft_size=0.3)
    add_lamp(scene, 'AREA', **RECTANGLE)
    before = direct()[0]
    scene.unit_settings.scale_length = 0.01
    centimetres = read()
    assert centimetres.lamps[0].radius == pytest.approx(0.003)
    points, normals = centimetres.vertices, np.tile((0.0, 0.0, 1.0), (SIDE**2, 1))
    found = sum(lamp.unshadowed(points, normals) for lamp in centimetres.lamps)
    np.testing.assert_allclose(found, before, rtol=1e-5)


def test_a_lamp_alone_lights_a_bake(scene, blender, floor):
    add_lamp(scene, 'POINT', energy=100.0)
    scene.radiosity.method = 'gathering'
    assert blender.ops.radiosity.bake() == {'FINISHED'}
    layer = floor.data.color_attributes["Radiosity"]
    values = np.zeros(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color", values)
    assert (values.reshape(-1, 4)[:, :3] > 0).all()
