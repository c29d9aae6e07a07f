# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds against Cycles: of one color, by direction, by ray, and with a sun in the sky."""

import math
from math import radians

import numpy as np
import pytest

from tests.blender.building import add_square
from tests.blender.white_floor import SIDE, agree


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


def test_a_world_of_a_surfaces_shader_is_black(scene, blender, floor, read):
    tree, _ = make_world(blender, scene)
    surface = tree.nodes.new('ShaderNodeBsdfPrincipled')
    tree.links.new(surface.outputs[0], tree.get_output_node('CYCLES').inputs["Surface"])
    assert read().scene.lamps == ()


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


def test_a_sun_where_the_picture_of_the_sky_begins_and_ends(scene, blender, cycles, direct):
    """Towards -x half of it is at either edge, and the rim that is left of a half is no other sun."""
    tree, background = make_world(blender, scene)
    sky = tree.nodes.new('ShaderNodeTexSky')
    sky.sun_elevation, sky.sun_rotation = 0.5, radians(-90)
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.3
    found, read = direct()
    assert len(read.lamps) == 3
    agree(found, cycles())


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
