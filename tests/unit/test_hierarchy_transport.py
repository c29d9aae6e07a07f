# SPDX-License-Identifier: GPL-3.0-or-later
"""Elements, links filled with form factors, and the transport they make."""

from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from core.dense.matrix import dense_transport
from core.errors import RadiosityError
from core.hierarchy import foresight as module
from core.hierarchy.elements import split_patches
from core.hierarchy.exchange import build_rows, stream_rows
from core.hierarchy.linking import closures, hierarchical_transport
from core.hierarchy.pieces import centres, quarters
from core.hierarchy.quality import QUALITIES
from core.hierarchy.receivers import group_receivers
from core.hierarchy.rows import gather, received
from core.hierarchy.samples import each
from core.hierarchy.scenery import build_scenery
from core.meshing import mesh
from core.occlusion.surfaces import occluder_polygons
from core.progress import exhaust
from core.scene import Scene
from core.visibility import scene_occluders
from tests.at_once import AtOnce


class Never(Executor):
    """Runs the first task and leaves all others waiting."""

    def __init__(self):
        self.futures = []

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        if not self.futures:
            future.set_result(fn(*args, **kwargs))
        self.futures.append(future)
        return future


def prepared(scene, quality="medium", **fields):
    """Return patches, occluders, elements and scenery, lit evenly."""
    detail = QUALITIES[quality]
    patches = mesh(scene)
    occluders = scene_occluders(scene, patches)
    elements = split_patches(patches, occluders, tolerance=fields.get("tolerance", 1.0), size=fields.get("size", 1.0))
    scenery = build_scenery(elements, np.ones((len(elements), 3)), 1.0, occluders)
    return patches, occluders, elements, scenery, detail.solve


def linked(scene, quality="medium"):
    *_, elements, scenery, detail = prepared(scene, quality)
    return exhaust(hierarchical_transport(elements, each(elements), scenery, detail, AtOnce()))


@pytest.fixture
def furnished(box):
    """A closed room in which a box floats, eight by eight patches a wall."""

    def build(divisions=8, at=(0.31, 0.22, 0.43)):
        polygons = [*box(), *box((0.3, 0.4, 0.2), at, inward=False)]
        return Scene.from_polygons(polygons, 0.5, 1.0, divisions=np.repeat((divisions, max(divisions // 2, 1)), 6))

    return build


def lamp_room(box, gap, divisions=2):
    lamp = [(0.4, 0.4, 1 - gap), (0.4, 0.6, 1 - gap), (0.6, 0.6, 1 - gap), (0.6, 0.4, 1 - gap)]
    emission = np.zeros((7, 3))
    emission[6] = 10
    return Scene.from_polygons(
        [*box(), np.array(lamp, float)], 0.5, emission, divisions=np.array([divisions] * 6 + [1])
    )


def test_quarters_make_the_whole():
    quad, triangle = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], [(0, 0, 1), (3, 0, 1), (1, 2, 2), (1, 2, 2)]
    corners = np.array([quad, triangle], float)
    vector = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    parts = quarters(corners)
    vectors = 0.5 * np.cross(parts[:, 2] - parts[:, 0], parts[:, 3] - parts[:, 1])
    assert vectors == pytest.approx(np.repeat(vector / 4, 4, axis=0))
    assert centres(parts).reshape(2, 4, 3).mean(axis=1) == pytest.approx(centres(corners))
    assert ((parts[:, 2] == parts[:, 3]).all(axis=1) == [False] * 4 + [True] * 4).all()


@pytest.mark.parametrize(("tolerance", "size"), [(1.0, 1.0), (1e-4, 1.0), (1.0, 1 / 32)])
def test_elements_keep_the_area_and_place_of_their_patches(box, tolerance, size):
    patches, _, elements, *_ = prepared(lamp_room(box, 0.05), tolerance=tolerance, size=size)
    count = len(patches.area)
    assert (np.diff(elements.patch) >= 0).all()
    assert np.bincount(elements.patch, elements.area, count) == pytest.approx(patches.area)
    middle = centres(elements.corners)
    for k in range(3):
        mean = np.bincount(elements.patch, elements.area * middle[:, k], count) / patches.area
        assert mean == pytest.approx(patches.centre[:, k])
    assert elements.normal == pytest.approx(patches.normal[elements.patch])
    diagonal = np.linalg.norm(np.ptp(patches.corners.reshape(-1, 3), axis=0))
    # As large as they may be, but for what there may be at most.
    assert elements.area.max() <= (size * diagonal) ** 2 or len(elements) > 3 * count


def test_patches_are_split_where_something_stands_on_them(box):
    polygons = [*box(), *box((0.2, 0.2, 0.2), (0.3, 0.3, 0.0), inward=False)]
    patches, _, elements, *_ = prepared(Scene.from_polygons(polygons, 0.5, 1.0, divisions=np.repeat((2, 1), 6)))
    pieces = np.bincount(elements.patch)
    stands = (patches.face == 0) & (np.abs(patches.centre[:, :2] - 0.25).max(axis=1) < 0.1)
    assert pieces[stands].min() > 1
    assert (pieces[patches.face == 1] == 1).all()


@pytest.mark.parametrize(("quality", "mean", "worst"), [("medium", 1e-2, 0.06), ("production", 1e-3, 0.02)])
def test_rows_add_up_to_one_in_a_closed_room(furnished, quality, mean, worst):
    transport = linked(furnished(), quality)
    sums = transport.row_sums()
    assert abs(transport.area @ sums / transport.area.sum() - 1) < mean
    assert np.abs(sums - 1).max() < worst
    assert transport.gather(np.ones((len(sums), 1)))[:, 0] == pytest.approx(sums, abs=1e-6)


def test_balance_lets_all_that_is_sent_arrive(furnished):
    transport = linked(furnished())
    B = np.random.default_rng(2).uniform(0.5, 2, (len(transport.area), 3))
    balanced = transport.balanced(B)
    arrived = float(transport.area @ balanced.gather(B).sum(axis=1))
    sent = float((transport.area * transport.sums) @ B.sum(axis=1))
    assert arrived == pytest.approx(sent, rel=1e-6)
    # What each sends is received by somebody.
    sends = transport.area * transport.arrives
    assert float(sends @ B[:, 0]) == pytest.approx(float(transport.area @ transport.gather(B)[:, 0]), rel=1e-5)


@pytest.mark.parametrize("scene", ["cube", "furnished"])
def test_what_is_gathered_is_what_the_whole_matrix_gathers(furnished, cube, scene):
    scene = furnished(6) if scene == "furnished" else cube(divisions=8)
    patches, occluders, elements, scenery, detail = prepared(scene, "production")
    transport = exhaust(hierarchical_transport(elements, each(elements), scenery, detail, AtOnce()))
    dense = exhaust(dense_transport(patches, occluders, surfaces=occluder_polygons(scene, patches)))
    B = 1 + np.sin(4 * patches.centre)
    light = transport.gather(B[elements.patch])
    whole = np.stack([np.bincount(elements.patch, elements.area * light[:, k]) for k in range(3)], axis=1)
    error = whole / patches.area[:, None] - dense.gather(B)
    assert float(np.sqrt(patches.area @ error**2 / patches.area.sum()).max()) < 0.01 * dense.gather(B).mean()


def test_columns_are_what_is_gathered_from_one(cube):
    transport = linked(cube(divisions=4))
    B = np.random.default_rng(3).uniform(size=(len(transport.area), 1))
    columns = np.stack([transport.column(j) for j in range(len(B))], axis=1)
    assert columns @ B[:, 0] == pytest.approx(transport.gather(B)[:, 0], rel=1e-4)
    # A wall is not lit by itself.
    assert np.abs(columns[:16, :16]).max() == 0


def test_received_is_gathered_the_other_way_round(furnished):
    *_, elements, scenery, detail = prepared(furnished(4))
    receivers = group_receivers(elements.centre, elements.normal)
    rows = build_rows(receivers, np.arange(len(receivers)), scenery, detail)
    rng = np.random.default_rng(4)
    nodes = rng.uniform(size=len(scenery.brightness)).astype(np.float32)
    area = rng.uniform(size=len(elements))
    there = area @ gather(rows, receivers, nodes[:, None])[:, 0]
    assert received(rows, receivers, area, len(nodes)) @ nodes == pytest.approx(there, rel=1e-5)


def test_closure_mends_little_and_only_where_it_is_shut():
    sums = np.array([(0.0, 0.98), (0.3, 0.68), (0.0, 0.98), (0.0, 0.8), (0.99, 0.001)])
    closure = closures(sums, np.array([True, True, False, True, True]), QUALITIES["medium"].solve)
    assert closure == pytest.approx([1 / 0.98, 0.7 / 0.68, 1, 1, 1])


def test_nobody_sees_more_than_all_that_is_around_with_a_way_out_or_without():
    sums = np.array([(0.3, 1.1), (0.0, 1.43), (0.0, 1.05), (1.2, 0.1), (1.2, 0.0)])
    detail = QUALITIES["medium"].solve
    for shut in (False, True):
        closure = closures(sums, np.full(5, shut), detail)
        # As many rows are a little too small as are too large: with a way out a little is left to them.
        assert closure == pytest.approx([0.7 / 1.1, 1 / 1.43, 1 / 1.05 if shut else 1, 0, closure[4]])
        assert (closure >= 0).all()
    # Single rays scatter too widely for that.
    assert closures(sums, np.zeros(5, bool), replace(detail, most_rays=1)) == pytest.approx(np.ones(5))


def same(a, b):
    parts = [np.array_equal(x.weight, y.weight) and np.array_equal(x.node, y.node) for x, y in zip(a, b, strict=True)]
    return all(parts)


def test_rows_are_the_same_bits_whoever_computes_them(furnished, monkeypatch):
    monkeypatch.setattr("core.hierarchy.exchange.TASK", 16)
    *_, elements, scenery, detail = prepared(furnished(10))
    receivers = group_receivers(elements.centre, elements.normal)
    alone = list(stream_rows(receivers, scenery, detail, AtOnce()))
    assert len(alone) > 1
    for workers in (1, 2, 4):
        with ThreadPoolExecutor(workers) as pool:
            assert same(alone, list(stream_rows(receivers, scenery, detail, pool)))


def test_closing_early_cancels_what_has_not_begun(furnished, monkeypatch):
    monkeypatch.setattr("core.hierarchy.exchange.TASK", 4)
    *_, elements, scenery, detail = prepared(furnished(8))
    workers = Never()
    steps = hierarchical_transport(elements, each(elements), scenery, detail, workers)
    assert next(steps).memory > 0
    assert 0 < next(steps).fraction < 1
    waiting = workers.futures[1:]
    assert waiting and not any(future.cancelled() for future in waiting)
    steps.close()
    assert all(future.cancelled() for future in waiting)


def test_links_that_do_not_fit_are_refused(furnished, monkeypatch):
    monkeypatch.setattr(module, "available_memory", lambda: 0)
    monkeypatch.setattr("core.hierarchy.exchange.TASK", 4)
    *_, elements, scenery, detail = prepared(furnished(8))
    with pytest.raises(RadiosityError, match=r"[\d.]+ GiB of memory, and [\d.]+ GiB are free"):
        exhaust(hierarchical_transport(elements, each(elements), scenery, detail, AtOnce()))


def test_sent_is_what_arrives_times_the_balance(cube):
    transport = linked(cube(divisions=2))
    half = replace(transport, balance=np.full(len(transport.area), 0.5))
    assert half.sent() == pytest.approx(0.5 * transport.sent())
    ones = np.ones((len(transport.area), 1))
    assert half.gather(ones) == pytest.approx(0.5 * transport.gather(ones), rel=1e-6)
