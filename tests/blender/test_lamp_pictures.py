# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose nodes only Cycles can read: slides, IES files, networks; each beside Cycles on a white floor."""

import numpy as np
import pytest

from tests.blender.building import add_light
from tests.blender.white_floor import agree

# Brighter straight down than to the sides: candela at seven angles from the axis.
IES = """IESNA:LM-63-1995
TILT=NONE
1 1000 1 7 1 1 2 0 0 0
1 1 100
0 15 30 45 60 75 90
0
1000 900 700 400 150 30 0
"""


def tree_of(lamp):
    """Return the nodes of a lamp and its emission."""
    if lamp.data.node_tree is None:
        lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    return tree, next(node for node in tree.nodes if node.bl_idname == 'ShaderNodeEmission')


def put_slide(blender, lamp):
    """Put waves of color before a lamp, by the direction of its light."""
    tree, emission = tree_of(lamp)
    place, wave = tree.nodes.new('ShaderNodeTexCoord'), tree.nodes.new('ShaderNodeTexMagic')
    wave.inputs["Scale"].default_value = 2.0
    tree.links.new(place.outputs["Normal"], wave.inputs["Vector"])
    tree.links.new(wave.outputs["Color"], emission.inputs["Color"])


def put_ies(blender, lamp):
    """Put a luminaire's measured light before a lamp."""
    tree, emission = tree_of(lamp)
    node = tree.nodes.new('ShaderNodeTexIES')
    node.ies = blender.data.texts.new("Luminaire")
    node.ies.write(IES)
    tree.links.new(node.outputs[0], emission.inputs["Strength"])


LAMPS = {
    "point": ('POINT', {"energy": 100.0, "shadow_soft_size": 0.0}),
    "spot": ('SPOT', {"energy": 100.0, "shadow_soft_size": 0.0, "spot_size": 1.9, "spot_blend": 0.3}),
}


@pytest.mark.parametrize("kind", LAMPS)
@pytest.mark.parametrize("put", [put_slide, put_ies])
def test_light_goes_where_the_nodes_send_it(put, kind, scene, blender, cycles, direct):
    lamp = add_light(scene, LAMPS[kind][0], (0.3, -0.4, 1.5), **LAMPS[kind][1])
    lamp.rotation_euler = (0.2, 0.1, 0.3)
    bare = direct()[0]
    put(blender, lamp)
    before = {name: len(getattr(blender.data, name)) for name in ("lights", "meshes", "materials", "scenes")}
    found, read = direct()
    expected = cycles()
    agree(found, expected, mean=0.02, rms=0.05)
    assert read.warnings == ()
    assert {name: len(getattr(blender.data, name)) for name in before} == before
    # The nodes do more than to weaken the light.
    ratio = expected.mean(axis=1) / np.maximum(bare.mean(axis=1), 1e-9)
    assert ratio.std() > 0.1 * ratio.mean()


def test_area_lamps_and_suns_have_the_mean(scene, blender, cycles, direct):
    put_slide(blender, add_light(scene, 'AREA', (0.3, -0.4, 1.5), energy=50.0, size=0.5))
    sun = add_light(scene, 'SUN', (0, 0, 3), energy=2.0)
    tree, emission = tree_of(sun)
    noise = tree.nodes.new('ShaderNodeTexNoise')
    tree.links.new(noise.outputs["Color"], emission.inputs["Color"])
    found, read = direct()
    np.testing.assert_allclose(found.mean(), cycles().mean(), rtol=0.15)
    assert any("averaged" in warning for warning in read.warnings)


def test_a_lamp_that_many_objects_share_is_baked_once(scene, blender, floor, read, addon, monkeypatch):
    lamp = add_light(scene, 'POINT', (0, 0, 1), energy=10.0)
    put_slide(blender, lamp)
    for _ in range(3):
        scene.collection.objects.link(blender.data.objects.new("Another", lamp.data))
    baked = []
    pictures = addon("lamp_pictures")
    bake = pictures.bake_colors
    monkeypatch.setattr(pictures, "bake_colors", lambda *args: (baked.append(args), bake(*args)))
    lamps = read().scene.lamps
    assert (len(lamps), len(baked)) == (4, 1)
    np.testing.assert_array_equal(lamps[0].pattern.picture, lamps[3].pattern.picture)


def test_without_cycles_the_sockets_own_value_counts(scene, blender, floor, read, addon, monkeypatch):
    lamp = add_light(scene, 'POINT', (0, 0, 1), energy=10.0)
    put_slide(blender, lamp)
    tree_of(lamp)[1].inputs["Strength"].default_value = 3.0
    monkeypatch.setattr(addon("lamp_pictures"), "available", lambda: False)
    scene = read().scene
    assert scene.lamps[0].pattern is None
    assert scene.lamps[0].intensity[0] == pytest.approx(30 / (4 * np.pi))
    assert [f"'{lamp.name}'" in warning and "'Magic" in warning for warning in scene.warnings] == [True]
