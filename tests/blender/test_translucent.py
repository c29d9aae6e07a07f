# SPDX-License-Identifier: GPL-3.0-or-later
"""Lampshades, curtains, paper and leaves: what they let through leaves diffusely on their other side, as in Cycles."""

import numpy as np
import pytest

from tests.blender.building import CUBE_FACES, CUBE_VERTICES, add_light, add_mesh, add_shader, colors, node_material

PAPER = (0.9, 0.6, 0.3)


def translucent(name="Paper", share=1.0):
    """Return a material that lets a share of its light through, and reflects the rest."""
    material, output = node_material(name)
    mix = add_shader(material, 'ShaderNodeMixShader', output.inputs[0])
    mix.inputs[0].default_value = share
    for kind, socket in (('ShaderNodeBsdfDiffuse', 1), ('ShaderNodeBsdfTranslucent', 2)):
        add_shader(material, kind, mix.inputs[socket], Color=(*PAPER, 1.0))
    return material


def cut_cube(scene, name, material, low, size, parts, inward):
    """Add a cube of which each side is cut into a grid."""
    corners, faces = [], []
    for face in CUBE_FACES:
        a, b, c, d = low + size * np.array(CUBE_VERTICES, float)[list(face[::-1] if inward else face)]
        s, t = (axis.ravel()[:, None] / parts for axis in np.meshgrid(*[np.arange(parts + 1)] * 2))
        first, step = len(corners), parts + 1
        corners += ((1 - s) * (1 - t) * a + s * (1 - t) * b + s * t * c + (1 - s) * t * d).tolist()
        cells = [first + j * step + i for j in range(parts) for i in range(parts)]
        faces += [(k, k + 1, k + 1 + step, k + step) for k in cells]
    return add_mesh(scene, name, corners, faces, material)


@pytest.fixture
def shaded(scene, blender):
    """Add a room with a point lamp in a paper shade; return room and shade."""
    material, output = node_material("White")
    add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs[0], Color=(0.6, 0.6, 0.6, 1.0))
    room = cut_cube(scene, "Room", material, np.zeros(3), 2.0, 6, True)
    shade = cut_cube(scene, "Shade", translucent(share=0.6), np.array((0.65, 0.75, 0.95)), 0.5, 4, False)
    add_light(scene, 'POINT', (0.9, 1.0, 1.2), energy=50.0, shadow_soft_size=0.05)
    return room, shade


def baked_with_cycles(objects):
    """Let Cycles bake the light of objects at their corners."""
    from tests.benchmarks import cycles

    for obj in objects:
        cycles.add_attribute(obj.data)
    radiance, _ = cycles.bake(objects, 256, 0, bounces=64)
    return np.split(radiance, np.cumsum([len(obj.data.loops) for obj in objects])[:-1])


def test_a_lampshade_glows_and_lights_the_room_as_in_cycles(bake, shaded):
    assert bake(quality='medium') == []
    for obj, theirs in zip(shaded, baked_with_cycles(shaded), strict=True):
        ours = colors(obj.data)[:, :3]
        np.testing.assert_allclose(ours.mean(axis=0), theirs.mean(axis=0), rtol=0.015)
    # Corner by corner on the shade, which is brighter than its noise.
    assert np.sqrt(((ours - theirs) ** 2).mean()) < 0.05 * theirs.mean()


def test_copies_that_are_cut_finer_glow_too(bake_copies, scene, shaded):
    copies = {copy["radiosity_copy_of"]: copy.data for copy in bake_copies(quality='preview', max_edge=0.1)}
    assert len(copies["Shade"].polygons) == 6 * 8**2
    glow, wall = (colors(copies[name])[:, :3].mean(axis=0) for name in ("Shade", "Room"))
    assert glow[0] > 5.0 * wall[0]
    # What goes to and fro inside takes on more of the tint.
    assert (glow[1:] / glow[0] < np.array(PAPER[1:]) / PAPER[0]).all()


def test_what_goes_through_is_read_and_nothing_is_left_to_tell(addon, extension):
    surface = addon("materials").read_material(translucent(share=0.25))
    np.testing.assert_allclose(surface.reflectance, 0.75 * np.array(PAPER), rtol=1e-6)
    np.testing.assert_allclose(surface.transmittance, 0.25 * np.array(PAPER), rtol=1e-6)
    assert not surface.passed.any() and surface.warnings == ()


def test_subsurface_of_thin_walls_is_what_goes_through(addon, blender, extension):
    material, output = node_material("Leaf")
    names = {"Base_Color": (*PAPER, 1.0), "Subsurface_Weight": 0.5}
    leaf = add_shader(material, 'ShaderNodeBsdfPrincipled', output.inputs[0], **names)
    read = addon("materials").read_material
    np.testing.assert_allclose(read(material).reflectance, PAPER, rtol=1e-6)
    if "Thin Wall" not in leaf.inputs:
        pytest.skip("this Blender has no thin walls")
    leaf.inputs["Thin Wall"].default_value, leaf.inputs["Subsurface Anisotropy"].default_value = True, 0.2
    # As much as Cycles bakes on either side of such a sheet.
    np.testing.assert_allclose(read(material).reflectance, 0.7 * np.array(PAPER), rtol=1e-6)
    np.testing.assert_allclose(read(material).transmittance, 0.3 * np.array(PAPER), rtol=1e-6)


def test_what_cycles_bakes_is_shared_out_between_both_sides(read_surfaces, scene):
    """Cycles' diffuse color has both in one."""
    material = translucent("Noisy", share=0.25)
    tree = material.node_tree
    noise = add_shader(material, 'ShaderNodeTexNoise')
    for node in tree.nodes:
        if node.bl_idname == 'ShaderNodeBsdfTranslucent':
            tree.links.new(noise.outputs["Color"], node.inputs["Color"])
    obj = add_mesh(scene, "Sheet", [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)], [(0, 1, 2, 3)], material)
    (surfaces,), _ = read_surfaces(obj)
    whole = surfaces.reflectance + surfaces.transmittance
    # Noise is 0.5 on the mean.
    np.testing.assert_allclose(whole[0], 0.75 * np.array(PAPER) + 0.25 * 0.5, atol=0.05)
    assert (surfaces.transmittance > 0.05).all()
