# SPDX-License-Identifier: GPL-3.0-or-later
"""Links of the hierarchy: every receiver meets all that it can see once, as finely as its light is worth."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.form_factors import point_to_polygon
from core.hierarchy.kernels import far_form_factors, near_form_factors
from core.hierarchy.links import find_links
from core.hierarchy.pieces import centres
from core.hierarchy.rays import visible_share
from core.hierarchy.receivers import group_receivers
from core.hierarchy.source_points import SourcePoints
from core.hierarchy.sources import most_shown_area, shown_area
from core.meshing import mesh
from core.scene import Scene
from core.visibility import scene_occluders
from tests.unit.source_trees import ball, elements_below, measured, random_polygons, sources_of, split


def test_groups_hold_neighbours_that_look_the_same_way(box):
    corners = split(box((3.0, 2.0, 1.0)), 3)
    point, normal, _ = measured(corners)
    receivers = group_receivers(point, normal)
    assert sorted(receivers.index) == list(range(len(point)))
    assert (receivers.point == point[receivers.index]).all() and (receivers.normal == normal[receivers.index]).all()
    assert np.diff(receivers.first).max() <= 16 and receivers.first[-1] == len(point)
    for group in range(len(receivers)):
        run = slice(receivers.first[group], receivers.first[group + 1])
        apart = receivers.point[run] - receivers.centre[group]
        assert np.linalg.norm(apart, axis=1).max() <= receivers.radius[group] * (1 + 1e-12)
        axis = receivers.axis[group]
        assert (np.abs(apart @ axis) <= receivers.depth[group] + 1e-12).all()
        # Only where walls meet does one group hold more than one of them, and never two that face each other.
        cosine = receivers.normal[run] @ axis
        assert cosine.min() > 0
        assert np.sqrt(np.clip(1 - cosine**2, 0, 1)).max() <= receivers.cone[group] + 1e-7
    assert (receivers.cone == 0).mean() > 0.5


def assert_links_cover(corners, size, error):
    """Check that nothing is linked twice, and that only what no receiver of a group can see is not linked."""
    at, normals, _ = measured(corners)
    sources = sources_of(corners)
    receivers = group_receivers(at, normals, size=size)
    bright = np.ones(len(sources.area))
    groups = np.arange(len(receivers))
    links = find_links(receivers, groups, sources, bright, angle=0.7, error=error)
    tree = sources.tree
    # Some links go to clusters, some near ones to elements, or this would say little.
    assert tree.size[links.node].max() > 1 and links.near.any() and not links.near.all()
    assert (tree.child[links.node[links.near]] < 0).all()
    for group in groups:
        held = [elements_below(tree, node) for node in links.node[links.group == group]]
        held = np.concatenate([*held, np.zeros(0, int)])
        assert len(np.unique(held)) == len(held)
        dropped = np.setdiff1d(np.arange(len(corners)), held)
        run = slice(receivers.first[group], receivers.first[group + 1])
        for point, normal in zip(receivers.point[run], receivers.normal[run], strict=True):
            above = ((corners[dropped] - point) @ normal).max(axis=1, initial=-np.inf) > 1e-6
            facing = ((point - corners[dropped, 0]) * normals[dropped]).sum(axis=1) > 1e-6
            assert not (above & facing).any()


@pytest.mark.parametrize("size", [1, 16])
@pytest.mark.parametrize(("where", "error"), [("room", 0.01), ("clutter", 0.5)])
def test_links_cover_what_is_seen_once_and_drop_what_is_not(box, where, error, size):
    room = [*split(box((3.0, 2.0, 1.0)), 2), *split(box((0.5, 0.5, 0.5), (1.0, 0.8, 0.1), inward=False), 1)]
    clutter = 0.3 * random_polygons(np.random.default_rng(11), 150, triangles=0) * (1, 1, 0.2)
    assert_links_cover(np.array(room) if where == "room" else clutter, size, error)


def test_links_cover_tilted_triangles():
    assert_links_cover(np.concatenate((ball(1), ball(1) * 0.5 + (2.5, 0, 0))), 1, 0.003)


def test_finer_detail_opens_what_is_bright(box):
    corners = split(box(), 3)
    sources = sources_of(corners)
    receivers = group_receivers(*measured(corners)[:2])
    groups = np.arange(len(receivers))
    bright = np.ones(len(sources.area))

    def count(error, factor=1.0):
        return len(find_links(receivers, groups, sources, factor * bright, angle=0.7, error=error).node)

    assert count(0.05) < count(0.005) < count(0.0005)
    # Brightness counts as error does.
    assert count(0.05, 10.0) == count(0.005)


def test_estimates_bound_the_form_factors(box):
    corners = split(box((3.0, 2.0, 1.0)), 2)
    sources = sources_of(corners)
    receivers = group_receivers(*measured(corners)[:2])
    links = find_links(receivers, np.arange(len(receivers)), sources, np.ones(len(sources.area)), angle=0.7, error=0.01)
    far = ~links.near
    first = receivers.first[links.group[far]]
    factor = far_form_factors(receivers.point[first], receivers.normal[first], sources, links.node[far])
    assert (factor <= links.form_factor[far] * (1 + 1e-5)).all()


def test_points_lie_on_the_patches_of_their_node_evenly_by_weight():
    corners = np.concatenate((random_polygons(np.random.default_rng(7), 12), ball(0)))
    sources = sources_of(corners)
    at, normals, area = measured(corners)
    weight = area * np.arange(1, len(area) + 1)
    targets = SourcePoints(sources, corners, weight)
    u, v = (axis.ravel() for axis in np.meshgrid((np.arange(4000) + 0.5) / 4000, (np.arange(20) + 0.5) / 20))
    for node in (0, 1, 2, int(np.flatnonzero(sources.tree.child < 0)[0])):
        below = elements_below(sources.tree, node)
        point, normal = targets.draw(np.full(len(u), node), u, v)
        # Which patch: the one in whose plane, and inside whose edges, the point lies.
        edge = np.roll(corners, -1, axis=1) - corners
        hit = np.zeros(len(u), int)
        for patch in below:
            off = np.abs((point - at[patch]) @ normals[patch])
            inside = [np.cross(edge[patch, k], point - corners[patch, k]) @ normals[patch] for k in range(4)]
            here = (off < 1e-9) & (np.min(inside, axis=0) > -1e-9) & (normal == normals[patch]).all(axis=1)
            hit += here
            share = weight[patch] / weight[below].sum()
            assert here.mean() == pytest.approx(share, abs=4e-3)
            # Spread evenly over it: their mean is its centre.
            assert point[here].mean(axis=0) == pytest.approx(at[patch], abs=0.03)
        assert (hit == 1).all()


SQUARE = np.array([[(0, 0, 2), (0, 1, 2), (1, 1, 2), (1, 0, 2)]], float)


def shade(blocker, rays):
    """A receiver under a unit square two metres up, with a blocker one metre up."""
    square = SQUARE
    sources = sources_of(square)
    targets = SourcePoints(sources, square, np.ones(1))
    scene = Scene.from_polygons([square[0], np.array(blocker, float)], 0.5, 0.0)
    occluders = scene_occluders(scene, mesh(scene))
    point, normal = np.array([(0.5, 0.5, 0.0)]), np.array([(0.0, 0.0, 1.0)])
    one = np.zeros(1, int)
    return visible_share(point, normal, one, one, np.array([rays]), one, targets, occluders)


@pytest.mark.parametrize(
    ("blocker", "expected", "within", "middle", "cast"),
    [
        ([(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], 0.0, 0.0, 0.0, 8),
        ([(3, 0, 1), (4, 0, 1), (4, 1, 1), (3, 1, 1)], 1.0, 0.0, 0.5, 8),
        ([(0.5, 0, 1), (1, 0, 1), (1, 1, 1), (0.5, 1, 1)], 0.5, 0.02, 0.254, 256),
    ],
)
def test_a_blocker_takes_its_share(blocker, expected, within, middle, cast):
    seen = shade(blocker, 256)
    assert seen.share[0] == pytest.approx(expected, abs=within)
    # Of a square half hidden, the light comes from the middle of the other half.
    assert seen.middle[0, 0] == pytest.approx(middle, abs=0.1 if cast == 8 else 0.01)
    # The square itself is exactly known: over pi, what is brought is its form factor, of what is seen of it.
    whole = near_form_factors(np.array([(0.5, 0.5, 0.0)]), np.array([(0.0, 0.0, 1.0)]), SQUARE)[0]
    assert seen.brought[0] / np.pi == pytest.approx(seen.share[0] * whole, rel=0.15)
    # Where the first rays agree, no more are cast.
    assert seen.cast == cast


@given(st.integers(0, 10**6))
def test_what_faces_an_observer_shows_whatever_else_there_is(seed):
    rng = np.random.default_rng(seed)
    corners = random_polygons(rng, 30)
    # Most of them look up, a few look down.
    corners[:, :, 2] *= 1e-3
    sources = sources_of(corners)
    _, normal, area = measured(corners)
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    node = np.arange(len(sources.area))
    shown = np.array([(area * np.maximum(normal @ way, 0))[elements_below(sources.tree, one)].sum() for one in node])
    ways = np.tile(way, (len(node), 1))
    assert (most_shown_area(sources, node, ways) >= shown * (1 - 1e-9)).all()
    assert (shown_area(sources, node, ways) >= 0.25 * shown * (1 - 1e-9)).all()


def test_a_long_cluster_with_one_end_near_is_opened():
    # A strip of floor that runs below a receiver on a wall, from far behind it to just before it.
    strip = np.array([[(x, 0, 0), (x + 0.25, 0, 0), (x + 0.25, 0.5, 0), (x, 0.5, 0)] for x in np.arange(-5, 0.5, 0.25)])
    receivers = group_receivers(np.array([(0.0, 0.25, 0.2)]), np.array([(1.0, 0, 0)]))
    sources = sources_of(strip)
    dim = np.full(len(sources.area), 0.05)
    links = find_links(receivers, np.zeros(1, int), sources, dim, angle=0.6, error=0.001)
    exact = point_to_polygon(receivers.point[[0] * len(strip)], receivers.normal[[0] * len(strip)], strip).sum()
    far, near = links.node[~links.near], links.node[links.near]
    at, axis = receivers.point[:1], receivers.normal[:1]
    told = far_form_factors(at.repeat(len(far), 0), axis.repeat(len(far), 0), sources, far).sum()
    leaves = strip[sources.tree.order[sources.tree.start[near]]]
    told += near_form_factors(at.repeat(len(near), 0), axis.repeat(len(near), 0), leaves).sum()
    assert told == pytest.approx(exact, rel=0.02)


def test_a_receiver_at_an_edge_takes_the_exact_kernel_for_what_it_nearly_touches():
    floor = split([np.array([(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)], float)], 4)
    sources = sources_of(floor)
    receivers = group_receivers(np.array([[2.0, 0.0, 1e-3]]), np.array([[0.0, 1.0, 0.0]]))
    one = np.ones(len(sources.area))
    links = find_links(receivers, np.array([0]), sources, one, angle=0.8, error=0.02)
    leaf = sources.tree.child[links.node] < 0
    element = sources.tree.order[sources.tree.start[links.node]]
    beside = leaf & (np.abs(centres(floor[element])[:, :2] - (2.0, 0.125)) < 0.2).all(axis=1)
    # Each of the two is a quarter of all that it sees, though their middles are next to its own plane.
    assert beside.sum() == 2
    at, way = (np.repeat(part, 2, axis=0) for part in (receivers.point, receivers.normal))
    np.testing.assert_allclose(near_form_factors(at, way, floor[element[beside]]), 0.25, atol=0.01)
    assert links.near[beside].all()
