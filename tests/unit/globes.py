# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls of faces that look outwards, and the sides that they have in a room with a hung lamp."""

import numpy as np

from core.facing.sides import auto_sides
from core.meshing import mesh
from core.visibility import scene_occluders
from tests.benchmarks.meshes import icosphere
from tests.unit.islands import Things

LAMP = [np.array([(1.5, 1.5, 2.8), (1.5, 2.5, 2.8), (2.5, 2.5, 2.8), (2.5, 1.5, 2.8)])]


def globe(segments, rings, radius, at, *, without=0):
    """Return the faces of a ball whose poles are fans of triangles; some rings from the top may be left out."""
    polar, around = np.linspace(0.0, np.pi, rings + 1)[:, None], np.arange(segments + 1) * 2.0 * np.pi / segments
    around[-1] = 0.0
    at_pole = np.where(np.isin(np.arange(rings + 1), (0, rings))[:, None], 0.0, np.sin(polar))
    point = np.stack([at_pole * np.cos(around), at_pole * np.sin(around), np.cos(polar) + 0.0 * around], axis=2)
    point = radius * point + at
    faces = []
    for i in range(without, rings):
        for j in range(segments):
            corners = [point[i, j], point[i + 1, j], point[i + 1, j + 1], point[i, j + 1]]
            faces.append(np.array(corners[:3] if i == 0 else [*corners[:2], corners[3]] if i == rings - 1 else corners))
    return faces


def ico(levels, radius, at):
    ball = icosphere(radius, levels)
    return [ball.vertices[face[:3]] + at for face in ball.faces]


def sides_in_a_room(room, things, glowing=(), lamps=(), seed=0, lit=True):
    """Return the side of every object of a room of 4 m x 4 m x 3 m, and the scene."""
    objects = {"Room": room, **({"Lamp": LAMP} if lit else {}), **things}
    together = Things()
    for name, faces in objects.items():
        together.add(name, faces, emission=10.0 * (name == "Lamp" or name in glowing))
    scene = together.scene(lamps=lamps)
    patches = mesh(scene)
    scene = auto_sides(scene, patches, scene_occluders(scene, patches), seed=seed)
    return {name: int(scene.sides[scene.face_object == at].min()) for at, name in enumerate(objects)}, scene
