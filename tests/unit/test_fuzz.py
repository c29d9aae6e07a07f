# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes and files that nobody would make on purpose, and that come all the same.

A few with fixed seeds in the suite; `make fuzz` tries many more, and tells the seed of what fails.
"""

import os
from dataclasses import replace

import numpy as np
import pytest

from core.errors import RadiosityError
from core.lighting.round_lamps import PointLamp, SunLamp
from core.scene import AUTO, BACK, BOTH, FRONT, Scene
from core.scene_text import parse_scene_text, write_scene_text

# How many scenes, how many texts, and the first seed.
SCENES = int(os.environ.get("FUZZ_SCENES", "10"))
TEXTS = int(os.environ.get("FUZZ_TEXTS", "200"))
FIRST = int(os.environ.get("FUZZ_SEED", "0"))


# What is computed with numbers that are none would be told on the console.
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def quad(rng, size=1.0):
    u, v = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2] * size
    at = rng.uniform(-2, 2, 3)
    return at + np.array([0 * u, u, u + v, v])


def on_lattice(rng):
    """Return an upright or level square with corners on a lattice, so that faces meet, touch and coincide."""
    axis = np.roll([0, 1, 2], rng.integers(3))
    corners = np.zeros((4, 3))
    corners[:, axis[:2]] = [(0, 0), (1, 0), (1, 1), (0, 1)]
    return (corners + rng.integers(-1, 2, 3))[:: rng.choice([-1, 1])]


def star(rng):
    """Return an n-gon that turns left and right, or crosses itself."""
    count = int(rng.integers(5, 30))
    turn = np.sort(rng.uniform(0, 2 * np.pi, count)) if rng.random() < 0.7 else rng.uniform(0, 2 * np.pi, count)
    radius = rng.uniform(0.1, 1.0, count)
    flat = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(count)], axis=1)
    return flat @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.uniform(-1, 1, 3)


def frame(rng):
    """Return a square with a square hole, joined by a bridge that runs there and back."""
    outer = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
    inner = 0.5 * outer[::-1]
    flat = np.concatenate([outer, inner])
    return np.column_stack([flat, np.full(len(flat), rng.uniform(-1, 1))])


def repeated(rng):
    corners = quad(rng)
    return corners[rng.integers(0, 4, rng.integers(3, 8))]


def sliver(rng):
    corners = quad(rng)
    corners[2:] = corners[1::-1] + rng.normal(size=3) * 10.0 ** rng.uniform(-9, -2)
    return corners


def nowhere(rng):
    corners = quad(rng)
    corners[rng.integers(4), rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf, 1e13, 1e200])
    return corners


def twisted(rng):
    return quad(rng) + rng.normal(size=(4, 3))


KINDS = {
    "quad": quad,
    "tiny": lambda rng: quad(rng, 10.0 ** rng.uniform(-7, -2)),
    "huge": lambda rng: quad(rng, 10.0 ** rng.uniform(1, 6)),
    "far": lambda rng: quad(rng) + rng.normal(size=3) * 10.0 ** rng.uniform(2, 6),
    "lattice": on_lattice,
    "star": star,
    "frame": frame,
    "repeated": repeated,
    "sliver": sliver,
    "nowhere": nowhere,
    "twisted": twisted,
    "triangle": lambda rng: rng.uniform(-1, 1, (3, 3)),
    "point": lambda rng: np.tile(rng.uniform(-1, 1, 3), (4, 1)),
}


def some_light(rng, count, most):
    """Return colours, a few of them none."""
    values = rng.uniform(0, most, (count, 3)) * (rng.random((count, 1)) < 0.7)
    wrong = rng.random((count, 3)) < 0.03
    values[wrong] = rng.choice([np.nan, np.inf, -1.0, 1e30, 1e6], wrong.sum())
    return values


def ugly_scene(rng):
    """Return a soup of a few kinds of faces, with a few lamps or none."""
    chosen = rng.choice(list(KINDS), rng.integers(1, 5))
    polygons = [KINDS[str(rng.choice(chosen))](rng) for _ in range(int(rng.integers(1, 60)))]
    polygons += [
        polygons[index][:: rng.choice([-1, 1])] for index in rng.integers(0, len(polygons), rng.integers(0, 4))
    ]
    count = len(polygons)
    normals = None
    if rng.random() < 0.3:
        normals = rng.normal(size=(sum(map(len, polygons)), 3)) * rng.choice([0.0, 1.0, 1e-20])
        normals[rng.random(len(normals)) < 0.05] = np.nan
    lamps = []
    if rng.random() < 0.3:
        lamps.append(PointLamp("Point", np.full(3, 10.0), rng.uniform(-2, 2, 3), radius=rng.choice([0.0, 0.2])))
    if rng.random() < 0.3:
        way = rng.normal(size=3)
        lamps.append(SunLamp("Sun", np.full(3, 2.0), way / np.linalg.norm(way)))
    return Scene.from_polygons(
        polygons,
        some_light(rng, count, rng.choice([0.0, 0.5, 1.3])),
        np.where(rng.random((count, 1)) < 0.5, some_light(rng, count, rng.choice([0.0, 1.0, 1e6])), 0.0),
        corner_normals=normals,
        sides=rng.choice([AUTO, FRONT, BACK, BOTH], count, p=[0.7, 0.1, 0.1, 0.1]),
        face_object=rng.integers(0, 3, count),
        object_names=["A", "B", "C"],
        lamps=lamps,
    )


def clearer(scene, rng):
    """Let light through some faces, in half of all scenes."""
    count = len(scene.face_object)
    if rng.random() < 0.5:
        return scene
    beyond = np.where(rng.random((count, 1)) < 0.5, some_light(rng, count, rng.choice([0.0, 0.5, 1.3])), 0.0)
    clear = rng.random(count) < 0.2
    return replace(scene, transmittance=beyond, tint=rng.random((count, 3)), occludes=~clear, shades=~clear)


# The last ones have faces at the same place that once lit each other without end, or did so until the iterations ended.
@pytest.mark.parametrize("seed", [*range(FIRST, FIRST + SCENES), 31, 52, 774])
def test_any_scene_is_lit_or_refused_in_words(seed, light):
    rng = np.random.default_rng(seed)
    scene = clearer(ugly_scene(rng), np.random.default_rng([seed, 1]))
    try:
        baked = light(scene, "hierarchical", quality="preview", max_edge=rng.choice([None, 0.7]))
    except RadiosityError as error:
        assert len(str(error)) > 20 and "\n" not in str(error)
        return
    assert baked.corner_radiance.shape == (len(scene.corner_vertex), 3)
    assert np.isfinite(baked.corner_radiance).all()
    assert baked.corner_radiance.min(initial=0.0) >= 0.0
    # Nearly white faces at the same place pass light on for longer than there are iterations, which the report tells.
    assert baked.report.energy.error <= 0.01 or not baked.report.converged
    assert all("\n" not in line for line in baked.report.warnings)


GOOD = "R 2 (0, 0, 0) (1, 0, 0) (1, 1, 0) (0, 1, 0) (0, 0, 1) (0.5, 0.5, 0.5, 1)\n"
LETTERS = "RE0123456789().,+-e# \t\n\rx\0\u00e9\u2028"


@pytest.mark.parametrize("seed", range(FIRST, FIRST + max(1, TEXTS // 100)))
def test_any_text_is_read_or_refused_with_its_line(seed):
    rng = np.random.default_rng(seed)
    for _ in range(100):
        letters = list(GOOD * int(rng.integers(0, 4)) or "R")
        for _ in range(int(rng.integers(1, 8))):
            # Something goes in, goes, or comes twice.
            place, width = int(rng.integers(len(letters) + 1)), int(rng.integers(0, 10))
            piece = [str(rng.choice(list(LETTERS))) for _ in range(int(rng.integers(1, 6)))]
            there = letters[place : place + width]
            letters[place : place + width] = [piece + there, piece, [], 2 * there][rng.integers(4)]
        text = "".join(letters)
        try:
            rectangles = parse_scene_text(text)
        except RadiosityError as error:
            assert str(error).startswith("Line ")
            continue
        assert parse_scene_text(write_scene_text(rectangles))[0].corners.shape == (4, 3)
