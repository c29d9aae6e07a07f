# SPDX-License-Identifier: GPL-3.0-or-later
"""What links will take is told before they are made, near what they take then, and refused where it does not fit."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from core.errors import RadiosityError
from core.hierarchy import foresight, linking
from core.hierarchy.clustering import choose_samples
from core.hierarchy.elements import split_patches
from core.hierarchy.linking import hierarchical_transport
from core.hierarchy.quality import QUALITIES
from core.hierarchy.scenery import build_scenery
from core.meshing import mesh
from core.progress import exhaust
from core.rectangles import rectangles_to_scene
from core.scene import Scene
from core.scene_text import read_scene_text
from core.visibility import scene_occluders
from tests.benchmarks import scenes

THESIS = Path(__file__).resolve().parents[2] / "example_blends" / "thesis_room.txt"


def benchmark(name):
    """Return the scene of that name, its emitters turned into radiant exitance."""
    if name == "thesis":
        return rectangles_to_scene(read_scene_text(THESIS))
    parts = [part for item in scenes.SCENES[name]() for part in item.parts]
    faces = [(part.mesh.vertices[list(face)], part) for part in parts for face in part.mesh.faces]
    return Scene.from_polygons(
        [corners for corners, _ in faces],
        np.array([part.reflectance for _, part in faces]),
        np.pi * np.array([part.radiance for _, part in faces]),
    )


@pytest.fixture
def steps():
    """Start to link samples of a scene by that name: `steps(name)`."""
    with ThreadPoolExecutor(2) as pool:

        def start(name):
            scene = benchmark(name)
            patches = mesh(scene)
            occluders = scene_occluders(scene, patches)
            elements = split_patches(patches, occluders, tolerance=1.0, size=1.0)
            scenery = build_scenery(elements, 1 + 20 * elements.emission, 1.0, occluders)
            samples = choose_samples(elements, occluders, 1000)
            return hierarchical_transport(elements, samples, scenery, QUALITIES["preview"].solve, pool)

        yield start


@pytest.mark.parametrize("name", ["thesis", "cornell", "furnished"])
def test_memory_told_in_advance_is_near_what_is_taken(steps, name):
    making = steps(name)
    told = next(making).memory
    rows = exhaust(making).rows
    taken = sum(part.weight.nbytes + part.node.nbytes for part in rows)
    # Links that no light comes through are not foreseen.
    assert 0.9 * taken < told < 2 * taken


def test_what_will_not_fit_is_refused_before_any_link_is_made(steps, monkeypatch):
    making = steps("thesis")
    asked = []
    monkeypatch.setattr(linking, "stream_rows", lambda *_: asked.append(True))
    monkeypatch.setattr(foresight, "available_memory", lambda: 1)
    with pytest.raises(RadiosityError, match=r"[\d.]+ GiB of memory, and [\d.]+ GiB are free: take a lower quality"):
        next(making)
    assert not asked
