# SPDX-License-Identifier: GPL-3.0-or-later
"""What lets light through does not keep it: panes, shades of glass, leaves and curtains with alpha."""

import numpy as np
import pytest

from tests.blender.building import (
    CUBE_FACES,
    CUBE_VERTICES,
    add_light,
    add_mesh,
    add_room,
    add_shader,
    add_square,
    colors,
    glowing,
    node_material,
)


def plain(name, kind, **values):
    """Return a material of one shader."""
    material, output = node_material(name)
    add_shader(material, kind, output.inputs[0], **values)
    return material


def sunlit(blender, scene, floor, cover):
    """Return the mean colors of a floor in the sun, without what is over it and with it."""
    add_light(scene, 'SUN')
    scene.radiosity.light = 'direct'
    lit = []
    for hidden in (True, False):
        cover.hide_render = hidden
        assert blender.ops.radiosity.bake() == {'FINISHED'}
        lit.append(colors(floor.data)[:, :3].mean(axis=0))
    return lit


@pytest.fixture
def bake(extension, scene, blender):
    """Give a function that bakes a room with a lamp inside, and in front of the lamp what is asked for."""

    def bake(shade):
        for obj in list(scene.objects):
            blender.data.objects.remove(obj)
        add_room(scene, "Room", glowing(0.5, 0.0))
        add_light(scene, 'POINT', (0.5, 0.5, 0.5), shadow_soft_size=0.01)
        if shade is not None:
            corners = 0.3 + 0.4 * np.array(CUBE_VERTICES)
            add_mesh(scene, "Shade", corners, CUBE_FACES, shade)
        scene.radiosity.quality = 'preview'
        assert blender.ops.radiosity.bake() == {'FINISHED'}
        return colors(scene.objects["Room"].data)[:, 0]

    return bake


@pytest.mark.parametrize(
    ("kind", "values", "left"),
    [
        ('ShaderNodeBsdfTransparent', {}, 1.0),
        ('ShaderNodeBsdfPrincipled', {"Alpha": 0.0}, 1.0),
        # What comes straight loses 0.04; what comes flat, more.
        ('ShaderNodeBsdfGlass', {"IOR": 1.5}, 0.94),
        ('ShaderNodeBsdfPrincipled', {"Transmission_Weight": 1.0, "Base_Color": (1.0, 1.0, 1.0, 1.0)}, 0.94),
    ],
)
def test_a_lamp_in_a_clear_shade_lights_as_without_it(bake, kind, values, left):
    np.testing.assert_allclose(bake(plain("Clear", kind, **values)), left * bake(None), rtol=0.03)


def test_a_lamp_in_fog_lights_as_without_it(bake):
    material, output = node_material("Fog")
    add_shader(material, 'ShaderNodeVolumeScatter', output.inputs["Volume"])
    np.testing.assert_allclose(bake(material), bake(None), rtol=0.02)


def test_a_lamp_in_an_opaque_shade_lights_nothing(bake):
    assert bake(plain("Opaque", 'ShaderNodeBsdfPrincipled')).max() < 1e-6


def test_leaves_that_are_half_there_pass_half_of_the_sun(extension, scene, blender):
    """A roof of many small squares, each with an image of which half is clear."""
    image = blender.data.images.new("Half", 8, 8, alpha=True)
    pixels = np.ones((8, 8, 4), np.float32)
    pixels[:, :4, 3] = 0.0
    image.pixels.foreach_set(pixels.ravel())
    material, output = node_material("Leaf")
    shader = add_shader(material, 'ShaderNodeBsdfPrincipled', output.inputs[0])
    texture = material.node_tree.nodes.new('ShaderNodeTexImage')
    texture.image = image
    material.node_tree.links.new(texture.outputs["Alpha"], shader.inputs["Alpha"])
    n = 40
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(n)))
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    at = (np.stack([x, y], axis=1)[:, None] + square).reshape(-1, 2) / n * 4.0 - 1.5
    corners = np.column_stack([at, np.ones(len(at))])
    roof = add_mesh(scene, "Roof", corners, np.arange(4 * n * n).reshape(-1, 4).tolist(), material)
    layer = roof.data.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.tile(square, (n * n, 1)).astype(np.float32).ravel())
    floor = add_square(scene, "Floor", glowing(0.5, 0.0))
    m = 24
    floor.data.clear_geometry()
    grid = [(i / m, j / m, 0.0) for j in range(m + 1) for i in range(m + 1)]
    step = m + 1
    cells = [(k, k + 1, k + 1 + step, k + step) for j in range(m) for k in range(j * step, j * step + m)]
    floor.data.from_pydata(grid, [], cells)
    bare, below = sunlit(blender, scene, floor, roof)
    assert below[0] == pytest.approx(0.5 * bare[0], rel=0.1)


def test_sun_through_a_colored_pane_is_colored(extension, scene, blender):
    floor = add_square(scene, "Floor", glowing(0.5, 0.0))
    glass = (0.9, 0.6, 0.3)
    material = plain("Glass", 'ShaderNodeBsdfGlass', Color=(*glass, 1.0), IOR=1.5)
    pane = add_square(scene, "Pane", material, z=1.0, size=5.0)
    pane.location = (-2.0, -2.0, 0.0)
    bare, below = sunlit(blender, scene, floor, pane)
    # The sun stands right above, and one surface is half a pane.
    np.testing.assert_allclose(below, bare * glass * 0.96, rtol=1e-5)
    assert "only that of lamps and the world" in blender.context.window_manager.radiosity.warnings
