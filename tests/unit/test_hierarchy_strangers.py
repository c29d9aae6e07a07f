# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners that do not see who looks for them do not show what is seen there."""

from types import SimpleNamespace

import numpy as np
import pytest

from core.hierarchy import clustering
from core.hierarchy.blending import blended
from core.hierarchy.clustering import _hidden, choose_samples
from core.hierarchy.elements import Elements
from core.hierarchy.neighbourhoods import find_neighbourhoods
from core.hierarchy.samples import Samples
from core.hierarchy.strangers import along_mesh

LINE = (np.arange(9), np.arange(1, 10))


def places(point, normal):
    none = np.zeros((len(point), 3))
    corners = np.repeat(point[:, None], 4, axis=1)
    one = np.ones(len(point))
    return Elements(corners, point, normal, one, np.zeros(len(point), int), none, none, one)


def only_within(share):
    """Segments are blocked that cross a multiple of `share` in height."""
    return SimpleNamespace(
        blocked=lambda one, other: np.floor(one[:, 2] / share) != np.floor(other[:, 2] / share),
        nearest=lambda origins, _: (
            np.full(len(origins), -1),
            np.zeros(len(origins)),
            np.ones(len(origins), bool),
        ),
    )


def test_light_runs_on_evenly_between_those_who_know():
    light = np.array([[1.0], *[[9.0]] * 8, [2.0]])
    stranger = (light == 9)[:, 0]
    told, learned = along_mesh(light, stranger, np.zeros(10, bool), LINE)
    np.testing.assert_allclose(told[:, 0], np.linspace(1, 2, 10), atol=0.02)
    assert np.array_equal(learned, stranger)


def test_nobody_learns_across_a_gap_or_from_what_is_covered():
    light = np.array([[1.0], [9.0], [9.0], [0.0], [9.0], [0.0], [9.0], [9.0], [9.0], [9.0]])
    stranger = (light == 9)[:, 0]
    dark = (light == 0)[:, 0]
    told, learned = along_mesh(light, stranger, dark, LINE)
    assert learned.nonzero()[0].tolist() == [1, 2]
    np.testing.assert_allclose(told[:3], 1)
    np.testing.assert_allclose(told[4:], light[4:])


def test_it_is_known_who_does_not_see_the_sample_of_its_cluster(monkeypatch):
    rng = np.random.default_rng(0)
    point, normal = rng.uniform(0, 1, (4000, 3)), np.tile((0.0, 0.0, 1.0), (4000, 1))
    elements, blockers = places(point, normal), only_within(0.01)
    monkeypatch.setattr(clustering, "_LIFT", 0.0)
    monkeypatch.setattr(clustering, "_OVER", 1.0)
    samples = choose_samples(elements, blockers, 50)
    hidden = _hidden(point, normal, np.arange(4000), samples.element[samples.cluster], blockers)
    assert hidden.mean() > 0.1
    assert samples.stranger[hidden].all()
    # Of the others those whose sample is hidden from many.
    share, size = np.bincount(samples.cluster, hidden), np.bincount(samples.cluster)
    untold = samples.stranger & ~hidden
    assert (share > 0.25 * size)[samples.cluster[untold]].all()
    assert not samples.stranger[samples.element].any()
    # What is chosen from those knows it, too.
    fewer = choose_samples(elements, blockers, 20, finer=samples)
    assert fewer.stranger[samples.stranger].all()
    assert fewer.stranger.mean() > samples.stranger.mean()


def test_a_sample_that_its_cluster_does_not_see_tells_nobody_beside_it():
    point = np.stack([np.arange(10.0), np.zeros(10), np.zeros(10)], axis=1)
    cluster = np.repeat([0, 1], 5)
    within = point - point[[2, 7]][cluster]
    arm, slope = np.zeros((2, 3)), np.zeros((2, 3, 3))
    samples = Samples(
        np.array([2, 7]), cluster, np.array([5.0, 5.0]), np.array([0, 1]), arm, slope, within, np.arange(10),
        np.array([0, 5]), np.zeros(10, bool),
    )  # fmt: skip
    hidden = Samples(**{**vars(samples), "stranger": cluster == 1})
    normal, alone = np.tile((0.0, 0.0, 1.0), (10, 1)), np.zeros(2, bool)
    values = np.array([[1.0, 1, 1], [1.1, 1.1, 1.1]])
    both, one = (blended(some, values, point, normal, LINE, alone) for some in (samples, hidden))
    assert both[4, 0] > 1.01
    assert one[4, 0] == pytest.approx(1)


def test_where_sheets_lie_everywhere_those_that_look_the_same_way_still_stand_together():
    rng = np.random.default_rng(0)
    point = rng.uniform(0, 1, (3000, 3))
    normal = np.eye(3)[rng.integers(0, 3, 3000)] * np.sign(rng.uniform(-1, 1, (3000, 1)))
    around = find_neighbourhoods(places(point, normal), only_within(2.0))
    nodes, _ = around.smallest(300)
    assert len(nodes) < 400
    np.testing.assert_allclose(around.cosine[nodes], 1)
