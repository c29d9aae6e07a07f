# SPDX-License-Identifier: GPL-3.0-or-later
"""Node networks read on meshes, beside what Cycles bakes of them."""

import numpy as np
import pytest

from tests.blender.building import colors
from tests.blender.networks import NETWORKS, Network, grid


def bake(bpy, objects, kind):
    """Let Cycles bake diffuse color or emission at the corners of objects; return their means over faces."""
    scene = bpy.data.scenes.new("Reference")
    scene.render.engine = 'CYCLES'
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 4, False, False
    for obj in objects:
        scene.collection.objects.link(obj)
        layer = obj.data.color_attributes.new("Reference", 'FLOAT_COLOR', 'CORNER')
        obj.data.color_attributes.active_color = layer
    chosen = {"scene": scene, "view_layer": scene.view_layers[0], "object": objects[0], "active_object": objects[0]}
    chosen |= {"selected_objects": objects, "selected_editable_objects": objects}
    with bpy.context.temp_override(**chosen):
        bpy.ops.object.bake(type=kind, pass_filter={'COLOR'} if kind == 'DIFFUSE' else set(), target='VERTEX_COLORS')
    faces = []
    for obj in objects:
        values = colors(obj.data, "Reference")
        obj.data.color_attributes.remove(obj.data.color_attributes["Reference"])
        faces.append(values.reshape(-1, 4, 4)[..., :3].mean(axis=1, dtype=float).clip(0.0))
    bpy.data.scenes.remove(scene)
    return faces


@pytest.fixture(scope="module")
def both(read_surfaces, blender):
    """Reflectance and radiance of the faces of grids by name, as they are read and as Cycles bakes them."""
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = blender.context.scene
    grids = [grid(scene, build(Network(blender, name))) for name, build in NETWORKS.items()]
    ours, notes = read_surfaces(*grids)
    theirs = [bake(blender, grids, kind) for kind in ('DIFFUSE', 'EMIT')]
    # Nothing but metal, holes, and colors below black is worth a word.
    told = {"cut out", "metal and coat", "mix linear_light", "mix subtract"}
    assert {note.split("'")[1] for note in notes} == told
    read_ones = [(surfaces.reflectance, surfaces.emission / np.pi) for surfaces in ours]
    return dict(zip(NETWORKS, zip(read_ones, zip(*theirs, strict=True), strict=True), strict=True))


@pytest.mark.parametrize("name", NETWORKS)
def test_a_network_is_read_as_cycles_bakes_it(both, name):
    # Cycles' corners miss what patterns with edges do between them.
    edged = name in {"repeat", "clip", "mirror", "math", "checker", "voronoi in object space"}
    for ours, theirs in zip(*both[name], strict=True):
        np.testing.assert_allclose(ours.mean(axis=0), theirs.mean(axis=0), rtol=0.12 if edged else 0.015, atol=0.003)
        # Face by face too, but for the edges of patterns.
        assert np.median(np.abs(ours - theirs)) <= (0.1 if edged else 0.02) * theirs.max() + 1e-6
