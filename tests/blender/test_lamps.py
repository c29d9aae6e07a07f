# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps against Cycles, kind by kind, on a small white floor that Cycles bakes at its vertices."""

from math import radians

import numpy as np
import pytest

from tests.blender.building import add_light, add_square, colors
from tests.blender.white_floor import SIDE, agree


def add_lamp(scene, kind, location=(0.3, -0.4, 1.5), rotation=(0.2, 0.1, 0.3), scale=(1, 1, 1), **properties):
    """Add a light object; give up where this Blender has not one of its properties."""
    try:
        obj = add_light(scene, kind, location, **properties)
    except AttributeError as missing:
        pytest.skip(f"not in this Blender: {missing}")
    obj.rotation_euler, obj.scale = rotation, scale
    return obj


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


def test_what_gives_no_light(scene, blender, floor, read):
    add_lamp(scene, 'POINT', energy=0.0)
    add_lamp(scene, 'POINT', energy=10.0).hide_render = True
    add_lamp(scene, 'POINT', energy=10.0).visible_diffuse = False
    add_lamp(scene, 'AREA', energy=10.0).data.cycles.is_portal = True
    assert read().scene.lamps == ()
    assert not read().scene.warnings
    negative = add_lamp(scene, 'POINT', energy=-10.0)
    assert read().scene.lamps == ()
    assert [negative.name in warning for warning in read().scene.warnings] == [True]


def test_what_is_approximated_is_told(scene, blender, floor, read):
    linked = add_lamp(scene, 'POINT', energy=10.0)
    linked.light_linking.receiver_collection = blender.data.collections.new("Lit")
    textured = add_lamp(scene, 'POINT', energy=10.0)
    if textured.data.node_tree is None:
        textured.data.use_nodes = True
    tree = textured.data.node_tree
    emission = next(node for node in tree.nodes if node.bl_idname == 'ShaderNodeEmission')
    emission.inputs["Strength"].default_value = 3.0
    assert read().scene.lamps[1].intensity[0] == pytest.approx(3 * read().scene.lamps[0].intensity[0])
    tree.links.new(tree.nodes.new('ShaderNodeLightFalloff').outputs["Linear"], emission.inputs["Strength"])
    warnings = read().scene.warnings
    assert ["light linking" in warning for warning in warnings] == [True, False]
    assert [f"'{textured.name}'" in warning and "'Light Falloff'" in warning for warning in warnings] == [False, True]


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
    bright, colored = (found.intensity for found in read().scene.lamps)
    red, green, blue = colored / (50.0 * bright)
    assert red > 1.3 > green > 0.5 > blue > 0.05
    tree.links.new(falloff.outputs["Constant"], emission.inputs["Strength"])
    assert [f"Light '{lamp.name}': 'Light Falloff' is not read" in line for line in read().scene.warnings] == [True]


def test_lamps_shrink_with_the_unit(scene, floor, read, direct):
    # What Cycles takes for a scene in metres looks the same in centimetres.
    add_lamp(scene, 'POINT', energy=100.0, shadow_soft_size=0.3)
    add_lamp(scene, 'AREA', **RECTANGLE)
    before = direct()[0]
    scene.unit_settings.scale_length = 0.01
    centimetres = read().scene
    assert centimetres.lamps[0].radius == pytest.approx(0.003)
    points, normals = centimetres.vertices, np.tile((0.0, 0.0, 1.0), (SIDE**2, 1))
    found = sum(lamp.unshadowed(points, normals) for lamp in centimetres.lamps)
    np.testing.assert_allclose(found, before, rtol=1e-5)


def test_a_lamp_alone_lights_a_bake(scene, blender, floor):
    add_lamp(scene, 'POINT', energy=100.0)
    scene.radiosity.method = 'gathering'
    assert blender.ops.radiosity.bake() == {'FINISHED'}
    assert (colors(floor.data)[:, :3] > 0).all()
