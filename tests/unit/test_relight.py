# SPDX-License-Identifier: GPL-3.0-or-later
"""New light on links that are there already."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from core.hierarchy.quality import QUALITIES
from core.hierarchy.relight import prepare_relighting, refine, relight, relit_patches
from core.hierarchy.solve import solve
from core.meshing import mesh
from core.progress import exhaust
from core.scene_text import parse_scene_text, rectangles_to_scene
from core.visibility import scene_occluders

ROOM = """
R 6 (0,0,0) (0,0,1) (1,0,1) (1,0,0) (0,1,0) (1,1,1,0.7)
R 6 (0,1,0) (1,1,0) (1,1,1) (0,1,1) (0,-1,0) (1,1,1,0.7)
R 6 (0,0,0) (1,0,0) (1,1,0) (0,1,0) (0,0,1) (1,1,1,0.7)
R 6 (0,0,1) (0,1,1) (1,1,1) (1,0,1) (0,0,-1) (1,1,1,0.7)
R 6 (0,0,0) (0,1,0) (0,1,1) (0,0,1) (1,0,0) (1,0.1,0.1,0.6)
R 6 (1,0,0) (1,0,1) (1,1,1) (1,1,0) (-1,0,0) (0.2,1,0.2,0.5)
E 2 (0.3,0.9,0.3) (0.7,0.9,0.3) (0.7,0.9,0.7) (0.3,0.9,0.7) (0,-1,0) (1,1,1,10)
"""
MEDIUM = QUALITIES["medium"]


@pytest.fixture(scope="module")
def room():
    """Return the patches of a small room, their occluders, and its light."""
    scene = rectangles_to_scene(parse_scene_text(ROOM))
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    with ThreadPoolExecutor(1) as workers:
        lit = exhaust(solve(patches, occluders, MEDIUM, workers, tolerance=1e-6))
    return patches, occluders, lit


def changed(patches):
    """Return the room with a yellow lamp and darker walls."""
    dimmed = patches.reflectance * [0.9, 0.8, 0.5]
    return replace(patches, emission=patches.emission * [1, 0.8, 0.1], reflectance=dimmed)


def difference(one, other, area):
    """Return the root mean square difference of two radiosities over the mean of the second."""
    weight = area[:, None] / area.sum() / 3
    return np.sqrt((weight * (one - other) ** 2).sum()) / (weight * other).sum()


def test_the_same_light_gives_the_same_solution(room):
    patches, _, lit = room
    again = relit_patches(relight(prepare_relighting(lit), patches, sweeps=8), patches)
    assert difference(again.radiosity, relit_patches(lit, patches).radiosity, patches.area) < 1e-3


def test_new_light_is_what_a_new_solution_finds(room):
    patches, occluders, lit = room
    new = changed(patches)
    quick = relit_patches(relight(prepare_relighting(lit), new), new)
    with ThreadPoolExecutor(1) as workers:
        full = relit_patches(exhaust(solve(new, occluders, MEDIUM, workers)), new)
    assert difference(quick.radiosity, full.radiosity, patches.area) < 0.02


def test_every_sweep_comes_closer(room):
    patches, _, lit = room
    relighting = prepare_relighting(lit)
    new = changed(patches)
    residuals = [relight(relighting, new, sweeps=sweeps).solution.residual for sweeps in (1, 2, 4, 8)]
    assert residuals == sorted(residuals, reverse=True)
    assert residuals[-1] < 1e-2 * residuals[0]


def test_light_that_falls_elsewhere_takes_another_sweep(room):
    patches, _, lit = room
    relighting = prepare_relighting(lit)
    glowing = np.zeros_like(patches.emission)
    glowing[patches.face == 4] = 20.0
    for new, sweeps, most in ((changed(patches), 2, 1e-3), (replace(patches, emission=glowing), 3, 4e-3)):
        found, settled = relight(relighting, new), relight(relighting, new, sweeps=40)
        assert found.solution.iterations == sweeps
        area = lit.elements.area
        assert difference(found.solution.radiosity, settled.solution.radiosity, area) < most


def test_colors_that_were_dark_are_relit_as_well(room):
    patches, _, lit = room
    dark = replace(lit, solution=replace(lit.solution, radiosity=lit.solution.radiosity * [1, 1, 0]))
    found = relight(prepare_relighting(dark), patches).solution.radiosity
    settled = relight(prepare_relighting(lit), patches, sweeps=40).solution.radiosity
    assert difference(found, settled, lit.elements.area) < 4e-3


def links_to(lit, patches, face):
    """Return how many links lead to what shines of a face."""
    tree = lit.transport.sources.tree
    first = patches.face[lit.elements.patch[tree.order[tree.start]]] == face
    return sum(int(first[rows.node].sum()) for rows in lit.transport.rows)


def test_links_are_refined_only_where_new_light_falls(room):
    patches, _, lit = room
    relighting = prepare_relighting(lit)
    with ThreadPoolExecutor(1) as workers:
        _, untouched = exhaust(refine(relight(relighting, patches), patches, MEDIUM.solve, workers))
        glowing = np.zeros_like(patches.emission)
        glowing[patches.face == 4] = 20.0
        new = replace(patches, emission=glowing)
        refined, count = exhaust(refine(relight(relighting, new), new, MEDIUM.solve, workers))
    assert untouched == 0
    assert 0 < count <= len(lit.transport.receivers)
    assert links_to(refined, patches, 4) > links_to(lit, patches, 4)


def test_samples_learn_of_new_light_as_well(room):
    patches, occluders, _ = room
    sparse = replace(MEDIUM, samples=80)
    other = changed(patches)
    with ThreadPoolExecutor(1) as workers:
        lit = exhaust(solve(patches, occluders, sparse, workers, tolerance=1e-6))
        anew = exhaust(solve(other, occluders, sparse, workers, tolerance=1e-6))
    assert not lit.transport.samples.single
    found = relit_patches(relight(prepare_relighting(lit), other, sweeps=8), other)
    assert difference(found.radiosity, relit_patches(anew, other).radiosity, patches.area) < 0.02
