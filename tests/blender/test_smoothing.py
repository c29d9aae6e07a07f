# SPDX-License-Identifier: GPL-3.0-or-later
"""Which corners look alike: those that Blender shades alike, and no others."""

from math import pi

import numpy as np
import pytest

from tests.blender.building import add_light, add_mesh, colors, glowing

# A roof whose ridge runs along y. The sun stands square to its left half and along its right one.
ROOF = [(-1, 0, 0), (0, 0, 1), (0, 1, 1), (-1, 1, 0), (1, 0, 0), (1, 1, 0)]
HALVES = [(0, 1, 2, 3), (1, 4, 5, 2)]
# Corners at the ridge, left and right, and the others.
LEFT, RIGHT, EAVES_LEFT, EAVES_RIGHT = [1, 2], [4, 7], [0, 3], [5, 6]
# What a surface square to the sun shows that reflects half; and one that looks up.
FULL, SLANTED = 0.5, 0.5 * 0.5**0.5


@pytest.fixture
def sun(scene):
    lamp = add_light(scene, 'SUN', name="Sun", energy=pi, angle=0.0)
    lamp.rotation_euler = (0.0, -pi / 4, 0.0)
    return lamp


@pytest.fixture
def bake(scene, blender, sun):
    """Return a function that bakes and gives the light at the corners of an object, shape (c,)."""

    def bake(obj, **settings):
        scene.radiosity.quality = 'preview'
        for name, value in settings.items():
            setattr(scene.radiosity, name, value)
        assert blender.ops.radiosity.bake() == {'FINISHED'}
        return colors(obj.data)[:, 0]

    return bake


def add_roof(scene, name="Roof", faces=HALVES, reflectance=0.5):
    return add_mesh(scene, name, ROOF, faces, glowing(reflectance, 0.0))


def ridge(mesh):
    """Return the edge that both halves share."""
    return next(edge for edge in mesh.edges if set(edge.vertices) == {1, 2})


def check(light, left, right):
    """Expect so much light at the ridge; what is at the eaves is the same whatever the ridge does."""
    np.testing.assert_allclose(light[EAVES_LEFT], FULL, rtol=1e-3)
    np.testing.assert_allclose(light[EAVES_RIGHT], 0.0, atol=1e-3)
    np.testing.assert_allclose(light[LEFT], left, atol=2e-3)
    np.testing.assert_allclose(light[RIGHT], right, atol=2e-3)


def test_flat_faces_keep_their_own_light(bake, scene):
    check(bake(add_roof(scene)), FULL, 0.0)


def test_smooth_faces_share_it(bake, scene):
    roof = add_roof(scene)
    roof.data.shade_smooth()
    check(bake(roof), SLANTED, SLANTED)


def test_sharp_edges_part_smooth_faces(bake, scene):
    roof = add_roof(scene)
    roof.data.shade_smooth()
    ridge(roof.data).use_edge_sharp = True
    assert "sharp_edge" in roof.data.attributes
    check(bake(roof), FULL, 0.0)


def test_flat_and_smooth_faces_in_one_mesh(bake, scene):
    # Two roofs, of which the second is smooth, and one flat half beside a smooth one.
    roof = add_mesh(
        scene,
        "Roofs",
        [(x, y + shift, z) for shift in (0, 5, 10) for x, y, z in ROOF],
        [tuple(np.array(half) + 6 * index) for index in range(3) for half in HALVES],
        glowing(0.5, 0.0),
    )
    roof.data.polygons.foreach_set("use_smooth", [False, False, True, True, True, False])
    flat, smooth, half = bake(roof).reshape(3, 8)
    check(flat, FULL, 0.0)
    check(smooth, SLANTED, SLANTED)
    check(half, FULL, 0.0)


def test_custom_normals_tell_what_is_alike(bake, scene):
    roof = add_roof(scene)
    roof.data.shade_smooth()
    left, right, up = (-(0.5**0.5), 0, 0.5**0.5), (0.5**0.5, 0, 0.5**0.5), (0, 0, 1)
    roof.data.normals_split_custom_set([left] * 4 + [right] * 4)
    check(bake(roof), FULL, 0.0)
    roof.data.normals_split_custom_set([left, up, up, left, up, right, right, up])
    check(bake(roof), SLANTED, SLANTED)


@pytest.mark.parametrize(("degrees", "shared"), [(60, False), (120, True)])
def test_smooth_by_angle(bake, scene, blender, degrees, shared):
    """Build what files with Auto Smooth get when they are opened: a modifier that makes edges sharp by their angle."""
    roof = add_roof(scene)
    roof.data.shade_smooth()
    group = blender.data.node_groups.new("Smooth by Angle", 'GeometryNodeTree')
    for way in ('INPUT', 'OUTPUT'):
        group.interface.new_socket("Mesh", in_out=way, socket_type='NodeSocketGeometry')
    give, take = group.nodes.new('NodeGroupInput'), group.nodes.new('NodeGroupOutput')
    angle, less = group.nodes.new('GeometryNodeInputMeshEdgeAngle'), group.nodes.new('ShaderNodeMath')
    smooth = group.nodes.new('GeometryNodeSetShadeSmooth')
    smooth.domain = 'EDGE'
    less.operation, less.inputs[1].default_value = 'LESS_THAN', np.radians(degrees)
    for source, target in (
        (give.outputs[0], smooth.inputs["Mesh" if "Mesh" in smooth.inputs else "Geometry"]),
        (angle.outputs["Unsigned Angle"], less.inputs[0]),
        (less.outputs[0], smooth.inputs["Shade Smooth"]),
        (smooth.outputs[0], take.inputs[0]),
    ):
        group.links.new(source, target)
    roof.modifiers.new("Smooth by Angle", 'NODES').node_group = group
    check(bake(roof), *((SLANTED, SLANTED) if shared else (FULL, 0.0)))


def test_materials_share_light_at_their_border_but_not_color(bake, scene):
    roof = add_roof(scene)
    roof.data.shade_smooth()
    roof.data.materials.append(glowing(0.1, 0.0, "Dark"))
    roof.data.polygons[1].material_index = 1
    check(bake(roof), SLANTED, SLANTED / 5)
    light = bake(roof, light='lighting')
    np.testing.assert_allclose(light[LEFT], light[RIGHT], rtol=1e-6)


def test_objects_at_one_place_never_mix(bake, scene):
    left, right = (add_roof(scene, name, [half]) for name, half in zip(("Left", "Right"), HALVES, strict=True))
    for half in (left, right):
        half.data.shade_smooth()
    np.testing.assert_allclose(bake(left), FULL, rtol=1e-3)
    np.testing.assert_allclose(colors(right.data)[:, 0], 0.0, atol=1e-3)


def test_surfaces_of_one_mesh_at_one_place_never_mix(bake, scene):
    # The halves have vertices of their own, that lie on each other.
    roof = add_mesh(scene, "Roof", [ROOF[index] for half in HALVES for index in half], [(0, 1, 2, 3), (4, 5, 6, 7)])
    roof.data.materials.append(glowing(0.5, 0.0))
    roof.data.shade_smooth()
    check(bake(roof), FULL, 0.0)


def test_mixed_normals_are_told_and_lit(bake, scene, blender):
    roof = add_roof(scene, faces=[HALVES[0], HALVES[1][::-1]])
    # Both look at the sun that way, from above and from below.
    light = bake(roof)
    assert "1 face is turned against the neighbors" in blender.context.window_manager.radiosity.warnings
    np.testing.assert_allclose(light[:4], FULL, rtol=1e-3)
