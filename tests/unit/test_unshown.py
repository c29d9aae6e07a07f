# SPDX-License-Identifier: GPL-3.0-or-later
"""What corners cannot show is told, and nothing else."""

import numpy as np
import pytest

from core.meshing import mesh
from core.unshown import light_between_corners
from tests.unit.islands import Things, sheet, upright


@pytest.fixture
def told(light):
    """Return the names of the objects that a bake tells something about, by what it tells."""

    def run(things, **settings):
        lines = light(things.scene(), "hierarchical", quality="preview", **settings).report.warnings
        return {what: [line.split("'")[1] for line in lines if what in line] for what in ("sides differ", "too large")}

    return run


@pytest.mark.parametrize("right", [True, False])
@pytest.mark.parametrize(("lamps", "names"), [((10.0, 1.0), ["Wall"]), ((10.0, 6.0), [])])
def test_a_sheet_between_a_bright_room_and_a_darker_one(told, box, lamps, names, right):
    things = Things().add("Room", box((4, 4, 3), inward=True)).add("Wall", [upright(2, (0, 4), (0, 3), right=right)])
    for index, (x, emission) in enumerate(zip((0.5, 2.5), lamps, strict=True)):
        things.add(f"Lamp {index}", [sheet((x, 1.5, 2.999), (x + 1, 2.5), up=False)], emission=emission)
    assert told(things, subdivide=4)["sides differ"] == names


def test_behind_a_picture_on_a_wall_nobody_looks(told, box):
    things = Things().add("Room", box((4, 4, 3), inward=True)).add("Picture", [upright(0.1, (1, 3), (1, 2))])
    things.add("Lamp", [sheet((1.5, 1.5, 2.999), (2.5, 2.5), up=False)], emission=10.0)
    assert told(things, subdivide=4)["sides differ"] == []


def test_ground_in_the_open_is_looked_at_from_above(told, box):
    things = Things().add("Ground", [sheet((0, 0, 0), (4, 4))]).add("Lamp", [sheet((1, 1, 2), (3, 3))], emission=1.0)
    things.add("Below", [sheet((1, 1, -2), (3, 3))], emission=0.1)
    assert told(things, subdivide=4)["sides differ"] == []


@pytest.mark.parametrize(("cells", "names"), [(1, ["Floor"]), (12, [])])
def test_a_floor_of_one_face_under_a_small_lamp(told, cells, names):
    size = 6 / cells
    corners = [(size * i, size * j) for i in range(cells) for j in range(cells)]
    things = Things().add("Floor", [sheet((x, y, 0), (x + size, y + size)) for x, y in corners])
    things.add("Lamp", [sheet((2.8, 2.8, 1), (3.2, 3.2), up=False)], emission=100.0)
    assert told(things)["too large"] == names


@pytest.mark.parametrize(("cells", "names"), [(3, ["Floor"]), (5, [])])
def test_small_faces_whose_patches_share_their_light_are_not_too_large(cells, names):
    corners = [(i, j) for i in range(cells) for j in range(cells)]
    scene = Things().add("Floor", [sheet((x, y, 0), (x + 1, y + 1)) for x, y in corners]).scene()
    patches = mesh(scene)
    lines = light_between_corners(scene, patches, np.ones((len(patches.face), 3)), np.full((4 * cells**2, 3), 2.0))
    assert [line.split("'")[1] for line in lines] == names
