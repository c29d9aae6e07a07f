# SPDX-License-Identifier: GPL-3.0-or-later
"""A diffuse floor of 4 m x 4 m, and its direct light as Cycles has it and as we do."""

import math

import numpy as np

from tests.blender.building import add_mesh, add_shader, node_material

REFLECTANCE = 0.5
SIDE = 12  # vertices along a side of the floor


def add_floor(scene):
    """Add the floor."""
    material, output = node_material("White")
    add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs["Surface"], Color=(*[REFLECTANCE] * 3, 1.0))
    steps = np.linspace(-2, 2, SIDE)
    vertices = [(x, y, 0) for y in steps for x in steps]
    rows = [SIDE * j + i for j in range(SIDE - 1) for i in range(SIDE - 1)]
    return add_mesh(scene, "Floor", vertices, [(k, k + 1, k + SIDE + 1, k + SIDE) for k in rows], material)


def cycles_irradiance(floor, samples=512):
    """Bake the floor with Cycles and return the direct irradiance at its vertices, shape (v, 3) [W/m^2]."""
    from tests.benchmarks import cycles

    cycles.add_attribute(floor.data, 'POINT')
    # Direct light alone: blockers reflect nothing back.
    radiance, _ = cycles.bake([floor], samples, 0, bounces=0)
    return radiance * math.pi / REFLECTANCE


def direct_irradiance(core, scene, floor):
    """Return the same from a scene of the core, as a bake of high quality has it."""
    occluders = core("visibility").scene_occluders(scene, core("meshing").mesh(scene))
    points = np.array([floor.matrix_world @ vertex.co for vertex in floor.data.vertices])
    normals = np.tile((0.0, 0.0, 1.0), (len(points), 1))
    settings = core("settings").Settings(quality="high")
    return core("lighting.lamps").direct_light(scene, points, normals, settings, occluders)


def agree(found, expected, mean=0.01, rms=0.03):
    """Compare with Cycles: the mean of each channel, and the scatter."""
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=mean)
    assert np.sqrt(np.mean((found - expected) ** 2)) < rms * expected.mean()
