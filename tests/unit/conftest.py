# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that several tests light, and one way to light them."""

import numpy as np
import pytest
from hypothesis import settings

from core.bake import bake
from core.facing.sides import auto_sides
from core.meshing import mesh
from core.occlusion.blender_tree import BVHOccluders
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.streams import StreamOccluders
from core.occlusion.surfaces import occluder_polygons
from core.progress import exhaust
from core.scene import Scene
from core.settings import Settings
from tests.unit.islands import Things, sheet

# A machine that does other things, too, is no failure.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
# Floor, ceiling, then four walls; counter-clockwise seen from inside.
INWARD = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
FLOOR, CEILING = 0, 1


def box_polygons(size=(1.0, 1.0, 1.0), at=(0.0, 0.0, 0.0), *, inward=True):
    faces = [CUBE[list(face)] * size + at for face in INWARD]
    return faces if inward else [face[::-1] for face in faces]


def l_room_polygons():
    """Return Pinney and Bean's room: six walls 3 m high round an L, its floor and its ceiling."""
    plan = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)], float)
    walls = []
    for start, end in zip(plan, np.roll(plan, -1, axis=0), strict=True):
        # The plan runs counter-clockwise, so that the inside is on the left of every wall.
        walls.append(np.array([(*end, 0), (*start, 0), (*start, 3), (*end, 3)]))
    floor = np.column_stack((plan, np.zeros(6)))
    return [*walls, floor, (floor + (0, 0, 3))[::-1]]


@pytest.fixture
def box():
    """Six quads round a box: `box(size, at, inward=True)`."""
    return box_polygons


@pytest.fixture
def l_room():
    """The polygons of an L-shaped room; surfaces 4 and 5 of its plan meet in the corner that juts in."""
    return l_room_polygons


@pytest.fixture
def cube():
    """A unit cube seen from inside: `cube(reflectance, emission, divisions)`."""

    def build(reflectance=0.5, emission=1.0, divisions=1, **fields):
        return Scene.from_polygons(box_polygons(), reflectance, emission, divisions=np.full(6, divisions), **fields)

    return build


@pytest.fixture
def ceiling_lamp():
    """A unit cube whose ceiling emits 1 W/m^2: `ceiling_lamp(reflectance, divisions)`."""

    def build(reflectance=0.5, divisions=1):
        emission = np.zeros((6, 3))
        emission[CEILING] = 1.0
        return Scene.from_polygons(box_polygons(), reflectance, emission, divisions=np.full(6, divisions))

    return build


@pytest.fixture
def light():
    """Bake a scene to its end: `light(scene, method="gathering", ...)`, with the fields of `Settings`."""

    def run(scene, method="gathering", **settings):
        return exhaust(bake(scene, Settings(method=method, **settings)))

    return run


@pytest.fixture(params=["brute", "stream", "tree"])
def occluders(request):
    """Return a way to build occluders; the tree only where Blender is."""
    if request.param == "tree":
        pytest.importorskip("bpy")
    return {"brute": BruteForceOccluders, "stream": StreamOccluders, "tree": BVHOccluders}[request.param]


@pytest.fixture(params=["brute", "tree"])
def decide(request):
    """Return a way to decide sides, with every kind of occluders that knows what is nearest."""
    if request.param == "tree":
        pytest.importorskip("bpy")
    kind = {"brute": BruteForceOccluders, "tree": BVHOccluders}[request.param]

    def run(scene, **options):
        patches = mesh(scene)
        return auto_sides(scene, patches, kind(occluder_polygons(scene, patches)), **options)

    return run


@pytest.fixture
def found(decide):
    """Return the sides of every object: one number, or a tuple where its islands differ."""

    def run(things, *lamps):
        scene = decide(things.scene(lamps=lamps))
        sides = {}
        for index, name in enumerate(scene.object_names):
            mine = np.unique(scene.sides[scene.face_object == index]).tolist()
            sides[name] = mine[0] if len(mine) == 1 else tuple(mine)
        return sides

    return run


@pytest.fixture
def lit_room(box):
    """A room of 4 m x 4 m x 3 m with a lamp in the middle of its ceiling, 20 cm under it: `room(inward=True)`."""

    def build(inward=True):
        lamp = sheet((1.5, 1.5, 2.8), (2.5, 2.5), up=False)
        return Things().add("Room", box((4, 4, 3), inward=inward)).add("Lamp", [lamp], emission=10.0)

    return build
