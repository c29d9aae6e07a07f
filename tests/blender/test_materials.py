# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflectance and emission from node trees."""

import math

import numpy as np
import pytest

from tests.blender.building import add_shader, glowing, node_material

GREY = (0.25, 0.5, 0.75, 1.0)
RED = (0.5, 0.0, 0.0, 1.0)


@pytest.fixture
def read(addon, scene):
    """Give `read_material`, checked to return clean arrays."""
    materials = addon("materials")

    def read(material):
        surface = materials.read_material(material)
        assert surface.reflectance.shape == surface.emission.shape == (3,)
        assert np.isfinite([surface.reflectance, surface.emission]).all()
        return surface

    return read


def expect(surface, reflectance, radiance, warnings=0):
    np.testing.assert_allclose(surface.reflectance, np.broadcast_to(reflectance, 3), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(surface.emission, np.pi * np.broadcast_to(radiance, 3), rtol=1e-6, atol=1e-7)
    assert len(surface.warnings) == warnings, surface.warnings


def test_no_material_is_white_of_four_fifths(read):
    expect(read(None), 0.8, 0.0)


def test_emission_is_radiance_times_pi(read):
    material, output = node_material()
    add_shader(material, 'ShaderNodeEmission', output.inputs[0], Color=GREY, Strength=2.0)
    expect(read(material), 0.0, 2.0 * np.array(GREY[:3]))


def test_diffuse(read):
    material, output = node_material()
    add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs[0], Color=GREY)
    expect(read(material), GREY[:3], 0.0)


def test_principled_reflects_and_emits(read):
    material, output = node_material()
    add_shader(
        material,
        'ShaderNodeBsdfPrincipled',
        output.inputs[0],
        Base_Color=GREY,
        Emission_Color=RED,
        Emission_Strength=3.0,
    )
    expect(read(material), GREY[:3], (1.5, 0.0, 0.0))


def test_a_new_material_of_blender_is_grey_and_dark(read, blender):
    material = blender.data.materials.new("New")
    if material.node_tree is None:
        material.use_nodes = True
    expect(read(material), 0.8, 0.0)


def test_metal_glass_and_transparency_scatter_less(read):
    material, output = node_material("Layered")
    add_shader(
        material,
        'ShaderNodeBsdfPrincipled',
        output.inputs[0],
        Base_Color=(0.8, 0.8, 0.8, 1.0),
        Metallic=0.5,
        Transmission_Weight=0.25,
        Alpha=0.5,
        IOR=1.5,
        Emission_Color=(1.0, 1.0, 1.0, 1.0),
        Emission_Strength=2.0,
    )
    surface = read(material)
    expect(surface, 0.8 * 0.5 * 0.75 * 0.5, 1.0, warnings=2)
    assert all("'Layered'" in warning for warning in surface.warnings)
    # What alpha leaves out, and the glass of what is there.
    glass = 0.5 * 0.5 * 0.25 * np.sqrt(0.8)
    np.testing.assert_allclose(surface.passed, 0.5 + glass, rtol=1e-6)
    np.testing.assert_allclose(surface.specular, 0.04 * glass, rtol=1e-5)


def test_add_shader_sums(read):
    material, output = node_material()
    add = add_shader(material, 'ShaderNodeAddShader', output.inputs[0])
    add_shader(material, 'ShaderNodeBsdfDiffuse', add.inputs[0], Color=GREY)
    add_shader(material, 'ShaderNodeEmission', add.inputs[1], Color=RED, Strength=2.0)
    expect(read(material), GREY[:3], (1.0, 0.0, 0.0))


@pytest.mark.parametrize("factor", [0.0, 0.25, 1.0])
def test_mix_shader_with_a_constant_factor_mixes(read, factor):
    material, output = node_material()
    mix = add_shader(material, 'ShaderNodeMixShader', output.inputs[0])
    mix.inputs[0].default_value = factor
    add_shader(material, 'ShaderNodeBsdfDiffuse', mix.inputs[1], Color=GREY)
    add_shader(material, 'ShaderNodeEmission', mix.inputs[2], Color=RED, Strength=2.0)
    expect(read(material), (1 - factor) * np.array(GREY[:3]), (factor, 0.0, 0.0))


def test_constant_input_nodes_are_followed_through_reroutes(read):
    material, output = node_material()
    tree = material.node_tree
    emission = add_shader(material, 'ShaderNodeEmission', output.inputs[0], Strength=5.0)
    reroute = tree.nodes.new('NodeReroute')
    tree.links.new(reroute.outputs[0], emission.inputs["Color"])
    color = add_shader(material, 'ShaderNodeRGB', reroute.inputs[0])
    color.outputs[0].default_value = GREY
    value = add_shader(material, 'ShaderNodeValue', emission.inputs["Strength"])
    value.outputs[0].default_value = 2.0
    expect(read(material), 0.0, 2.0 * np.array(GREY[:3]))


def test_the_shader_is_followed_through_reroutes(read):
    material, output = node_material()
    reroute = material.node_tree.nodes.new('NodeReroute')
    diffuse = add_shader(material, 'ShaderNodeBsdfDiffuse', Color=GREY)
    material.node_tree.links.new(diffuse.outputs[0], reroute.inputs[0])
    material.node_tree.links.new(reroute.outputs[0], output.inputs[0])
    expect(read(material), GREY[:3], 0.0)


def test_a_color_as_a_number_counts_its_luminance(read):
    material, output = node_material()
    emission = add_shader(material, 'ShaderNodeEmission', output.inputs[0], Color=(1.0, 1.0, 1.0, 1.0))
    color = add_shader(material, 'ShaderNodeRGB', emission.inputs["Strength"])
    color.outputs[0].default_value = (0.0, 1.0, 0.0, 1.0)
    expect(read(material), 0.0, 0.7152)


def test_a_number_as_a_color_is_grey(read):
    material, output = node_material()
    diffuse = add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs[0])
    value = add_shader(material, 'ShaderNodeValue', diffuse.inputs["Color"])
    value.outputs[0].default_value = 0.3
    expect(read(material), 0.3, 0.0)


def test_a_texture_gives_way_to_the_sockets_own_value_with_a_warning(read):
    material, output = node_material("Brick")
    diffuse = add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs[0], Color=GREY)
    texture = add_shader(material, 'ShaderNodeTexBrick')
    material.node_tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
    surface = read(material)
    expect(surface, GREY[:3], 0.0, warnings=1)
    assert "'Brick'" in surface.warnings[0] and "Color" in surface.warnings[0]


def test_an_empty_group_is_black_and_an_unknown_shader_told(read, blender):
    material, output = node_material("Grouped")
    group = material.node_tree.nodes.new('ShaderNodeGroup')
    group.node_tree = blender.data.node_groups.new("Inside", 'ShaderNodeTree')
    group.node_tree.interface.new_socket("Shader", in_out='OUTPUT', socket_type='NodeSocketShader')
    material.node_tree.links.new(group.outputs[0], output.inputs[0])
    expect(read(material), 0.0, 0.0)
    add_shader(material, 'ShaderNodeBsdfToon', output.inputs[0])
    surface = read(material)
    expect(surface, 0.8, 0.0, warnings=1)
    assert "'Grouped'" in surface.warnings[0]


@pytest.mark.parametrize(
    ("kind", "reflectance", "passed"),
    [
        ('ShaderNodeBsdfGlossy', 0.0, 0.0),
        ('ShaderNodeBsdfGlass', 0.0, (0.9, 0.6, 0.3)),
        ('ShaderNodeBsdfRefraction', 0.0, (0.9, 0.6, 0.3)),
        ('ShaderNodeBsdfTransparent', 0.0, (0.9, 0.6, 0.3)),
    ],
)
def test_what_is_not_diffuse_reflects_less_and_is_told(read, kind, reflectance, passed):
    material, output = node_material()
    add_shader(material, kind, output.inputs[0], Color=(0.9, 0.6, 0.3, 1.0))
    surface = read(material)
    expect(surface, reflectance, 0.0, warnings=1)
    np.testing.assert_allclose(surface.passed, passed, rtol=1e-6)


def test_the_active_output_counts(read):
    material, first = node_material()
    second = material.node_tree.nodes.new('ShaderNodeOutputMaterial')
    add_shader(material, 'ShaderNodeBsdfDiffuse', first.inputs[0], Color=GREY)
    add_shader(material, 'ShaderNodeBsdfDiffuse', second.inputs[0], Color=RED)
    for output, color in ((second, RED), (first, GREY)):
        first.is_active_output, second.is_active_output = output == first, output == second
        expect(read(material), color[:3], 0.0)


def test_the_output_for_cycles_goes_before_that_for_eevee(read):
    material, output = node_material()
    other = material.node_tree.nodes.new('ShaderNodeOutputMaterial')
    output.target, other.target = 'CYCLES', 'EEVEE'
    add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs[0], Color=GREY)
    add_shader(material, 'ShaderNodeBsdfDiffuse', other.inputs[0], Color=RED)
    expect(read(material), GREY[:3], 0.0)
    material.node_tree.nodes.remove(output)
    expect(read(material), RED[:3], 0.0)


def test_an_output_without_a_shader_and_no_output_are_black(read):
    material, output = node_material()
    expect(read(material), 0.0, 0.0)
    material.node_tree.nodes.remove(output)
    expect(read(material), 0.0, 0.0, warnings=1)


def test_muted_links_and_nodes_do_not_count(read):
    material, output = node_material()
    add = add_shader(material, 'ShaderNodeAddShader', output.inputs[0])
    diffuse = add_shader(material, 'ShaderNodeBsdfDiffuse', add.inputs[0], Color=GREY)
    emission = add_shader(material, 'ShaderNodeEmission', add.inputs[1], Color=RED)
    diffuse.mute = True
    expect(read(material), 0.0, RED[:3])
    diffuse.mute = False
    emission.outputs[0].links[0].is_muted = True
    expect(read(material), GREY[:3], 0.0)
    # A muted node passes its first shader on.
    add.mute = True
    expect(read(material), GREY[:3], 0.0)


def test_negative_light_counts_as_none(read):
    material = glowing(reflectance=0.5, radiance=-1.0, name="Dark Star")
    surface = read(material)
    expect(surface, 0.5, 0.0, warnings=1)
    assert "'Dark Star'" in surface.warnings[0]


def test_a_material_without_nodes_has_its_viewport_color(read, blender):
    if blender.app.version >= (5, 0, 0):
        pytest.skip("from 5.0 on every material has nodes")
    material = glowing()
    material.diffuse_color = GREY
    material.use_nodes = False  # the tree stays behind
    expect(read(material), GREY[:3], 0.0)


def test_a_chain_that_doubles_at_every_node_is_read_at_once(read):
    # Each node adds the one before to itself: 2^50 paths, 50 nodes.
    material, output = node_material()
    shader = add_shader(material, 'ShaderNodeEmission', Color=(1.0, 1.0, 1.0, 1.0), Strength=2.0**-50)
    for _ in range(50):
        add = material.node_tree.nodes.new('ShaderNodeAddShader')
        for socket in add.inputs:
            material.node_tree.links.new(shader.outputs[0], socket)
        shader = add
    material.node_tree.links.new(shader.outputs[0], output.inputs[0])
    assert math.isclose(read(material).emission[0], math.pi, rel_tol=1e-6)
