# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that have vertices twice at the same places."""

import numpy as np

from core.facing.islands import islands
from core.facing.orientation import orientation
from core.facing.seams import sewn_vertices
from core.facing.sides import MOST_ISLANDS
from core.scene import AUTO, BACK, BOTH, FRONT, Scene
from tests.unit.islands import sheet


def split(polygons, of=None, emission=0.0, **fields):
    """Return a scene in which no two faces share a vertex."""
    sizes = [len(polygon) for polygon in polygons]
    of = [0] * len(polygons) if of is None else of
    names = [f"Object {index}" for index in range(max(of) + 1)]
    vertices, start = np.concatenate(polygons), np.cumsum([0, *sizes])
    corners, light = np.arange(len(vertices)), np.zeros((len(polygons), 3))
    return Scene(vertices, corners, start, light + 0.5, light + emission, face_object=of, object_names=names, **fields)


def test_what_closes_is_one_island_and_what_stays_open_is_not(box):
    cube, pot = box(inward=False), box(at=(5, 0, 0), inward=False)[1:]
    assert islands(split(cube)).max() == 0
    assert orientation(split(cube)).sealed.all()
    assert sorted(islands(split([*cube, *pot]))) == [0] * 6 + [1, 2, 3, 4, 5]
    assert not orientation(split(pot)).sealed.any()
    # Nothing is sewn over objects, nor where more than two faces meet.
    assert islands(split(cube, of=[0, 0, 0, 1, 1, 1])).max() == 5
    assert islands(split([*cube, *box(at=(1, 0, 0), inward=False)])).max() == 11


def test_a_face_turned_round_in_a_split_cube_is_found(box):
    cube = box(inward=False)
    cube[2] = cube[2][::-1]
    assert np.flatnonzero(orientation(split(cube)).turned).tolist() == [2]


def test_a_mesh_without_seams_is_left_as_it_is(box):
    scene = Scene.from_polygons(box())
    assert sewn_vertices(scene) is scene.corner_vertex


def test_the_inside_of_glowing_letters_is_dark(decide, box):
    letter = box((0.2, 0.05, 0.3), (1, 1, 1), inward=False)
    emission = np.repeat([10.0] * 6 + [0.0], 3).reshape(7, 3)
    floor = sheet((0, 0, 0), (4, 4))
    scene = split([*letter, floor], of=[0] * 6 + [1], emission=emission, sides=[AUTO] * 7)
    assert decide(scene).sides.tolist() == [FRONT] * 7


def test_loose_faces_that_are_turned_anyhow_are_lit_in_their_room(decide):
    walls = []
    for axis in range(3):
        for at in (0.0, 3.0):
            u, v = np.meshgrid(np.arange(0, 3, 0.3), np.arange(0, 3, 0.3))
            for low in np.stack([u.ravel(), v.ravel()], axis=1):
                face = np.insert(low + 0.3 * np.array([(0, 0), (1, 0), (1, 1), (0, 1)]), axis, at, axis=1)
                inward = np.cross(face[1] - face[0], face[2] - face[1])[axis] * (1.5 - at) > 0
                walls.append(face if inward else face[::-1])
    flipped = np.random.default_rng(0).random(len(walls)) < 0.5
    walls = [face[::-1] if turned else face for face, turned in zip(walls, flipped, strict=True)]
    lamp = sheet((1, 1, 2.5), (2, 2), up=False)
    emission = np.repeat([0.0] * len(walls) + [10.0], 3).reshape(-1, 3)
    scene = split([*walls, lamp], of=[0] * len(walls) + [1], emission=emission, sides=[AUTO] * (len(walls) + 1))
    assert len(walls) > MOST_ISLANDS
    np.testing.assert_array_equal(decide(scene).sides[:-1], np.where(flipped, BACK, BOTH))


def test_very_many_loose_faces_are_turned_as_those_that_they_meet(decide, box):
    pot = [np.asarray(face) for face in box((0.2, 0.2, 0.2), inward=False)[1:]]
    places = [(0.3 * (k % 30), 0.3 * (k // 30), 0.0) for k in range(900)]
    # Every fifth pot has its lid turned: its neighbours at four edges tell.
    turned = np.array([k % 5 == 0 and side == 0 for k in range(900) for side in range(5)])
    faces = [face + place for place in places for face in pot]
    faces = [face[::-1] if turn else face for face, turn in zip(faces, turned, strict=True)]
    lamp = sheet((0, 0, 3), (9, 9), up=False)
    emission = np.repeat([0.0] * len(faces) + [10.0], 3).reshape(-1, 3)
    scene = split([*faces, lamp], of=[0] * len(faces) + [1], emission=emission, sides=[AUTO] * (len(faces) + 1))
    found = decide(scene)
    np.testing.assert_array_equal(found.sides[:-1], np.where(turned, BACK, FRONT))
    assert "180 faces are turned against the neighbors" in found.warnings[-1]
