# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchy's tree, the sources on it, the groups of receivers, and the links between them."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.hierarchy import tree as trees
from core.hierarchy.sources import shown_area
from core.hierarchy.splitting import split as split_runs
from core.hierarchy.tree import build_tree
from tests.unit.source_trees import ball, elements_below, measured, random_polygons, sources_of, split


@given(st.integers(1, 200), st.integers(1, 40), st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=40, deadline=None)
def test_the_tree_covers_every_element_once(n, most, seed, gridded):
    rng = np.random.default_rng(seed)
    # Many elements at the same place, too: nothing tells them apart.
    position = rng.integers(0, 3, (n, 3)).astype(float) if gridded else rng.normal(size=(n, 3))
    normal = rng.normal(size=(n, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shade = rng.integers(-5, 6, n).astype(float) if gridded else None
    tree = build_tree(position, normal, shade)
    assert sorted(tree.order) == list(range(n))
    assert len(tree.start) == 2 * n - 1 and (tree.start[0], tree.stop[0]) == (0, n)
    inner = np.flatnonzero(tree.child >= 0)
    left, right = tree.child[inner], tree.child[inner] + 1
    assert (left > inner).all()
    assert sorted(np.concatenate((left, right))) == list(range(1, 2 * n - 1))
    assert (tree.start[left] == tree.start[inner]).all() and (tree.stop[right] == tree.stop[inner]).all()
    assert (tree.stop[left] == tree.start[right]).all() and (tree.size > 0).all()
    assert (tree.size[tree.child < 0] == 1).all()
    assert [first for first, _ in tree.levels] == [0, *(last for _, last in tree.levels[:-1])]
    cut = tree.cut(most)
    assert (tree.size[cut] <= most).all()
    assert list(np.concatenate([elements_below(tree, node) for node in cut])) == list(tree.order)
    # The highest: the parent of each holds too many.
    parent = np.full(len(tree.start), -1)
    parent[left], parent[right] = inner, inner
    assert all(parent[node] < 0 or tree.size[parent[node]] > most for node in cut)


def test_sums_and_extremes_are_those_of_the_elements_below():
    rng = np.random.default_rng(5)
    x = rng.normal(size=(60, 3))
    tree = build_tree(x, np.tile((0.0, 0.0, 1.0), (60, 1)))
    sums, (low, high) = tree.sums(x), tree.extremes(x - 1, x + 2)
    for node in range(len(tree.start)):
        below = x[elements_below(tree, node)]
        assert sums[node] == pytest.approx(below.sum(axis=0), abs=1e-12)
        assert (low[node] == below.min(axis=0) - 1).all() and (high[node] == below.max(axis=0) + 2).all()


def test_the_tree_of_elements_in_a_row_is_no_deeper_than_it_must():
    # Each twice as far as the one before: halving the extent would cut off one at a time.
    x = np.column_stack((2.0 ** np.arange(64), np.zeros((64, 2))))
    tree = build_tree(x, np.tile((0.0, 0.0, 1.0), (64, 1)))
    assert len(tree.levels) <= 12


@pytest.mark.parametrize("other", [(0, 0, 1), (0, 0, -1)])
def test_surfaces_that_look_elsewhere_or_lie_higher_are_subtrees(other):
    # A floor, and above it the back of a thin plate, or a step.
    floor = split([[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]], 2)
    above = floor[:, ::-1] if other[2] < 0 else floor
    tree = sources_of(np.concatenate((floor, above + (0, 0, 0.05 if other[2] < 0 else 0.5)))).tree
    assert {frozenset(elements_below(tree, node) // 16) for node in (1, 2)} == {frozenset({0}), frozenset({1})}


def test_moments_are_those_of_points_spread_over_the_elements():
    corners = random_polygons(np.random.default_rng(1), 9, triangles=0)
    sources = sources_of(corners)
    fine = split(corners, 5)
    at, _, area = measured(fine)
    owner = np.arange(len(fine)) // 4**5
    for node in range(len(sources.area)):
        below = np.isin(owner, elements_below(sources.tree, node))
        share = area[below] / area[below].sum()
        mean = share @ at[below]
        variance = share @ ((at[below] - mean) ** 2).sum(axis=1)
        assert sources.area[node] == pytest.approx(area[below].sum())
        assert sources.centre[node] == pytest.approx(mean, abs=1e-12)
        # What is left of the variance is that within the fine pieces.
        assert sources.radius[node] == pytest.approx(np.sqrt(3 * variance), rel=2e-3)


def test_a_triangle_cut_finely_has_its_own_moments():
    # Legs of one: the variances are 1/18 along both.
    sources = sources_of(split([[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0)]], 4))
    assert sources.centre[0] == pytest.approx((1 / 3, 1 / 3, 0))
    assert sources.radius[0] == pytest.approx(np.sqrt(3 / 9), rel=1e-3)
    assert (sources.quadrature[0][:, :2] ** 2).mean(axis=0) == pytest.approx(np.full(2, 1 / 6), rel=1e-3)


def test_area_vectors_of_a_closed_ball_do_not_vanish():
    corners = ball()
    sources = sources_of(corners)
    total = sources.area[0]
    assert np.linalg.norm(sources.vector[0].sum(axis=0)) < 1e-9 * total
    # A convex body shows a quarter of its area on the mean (Cauchy), a ball from everywhere.
    ways = np.concatenate((np.eye(3), -np.eye(3)))
    assert shown_area(sources, np.zeros(6, int), ways) == pytest.approx(np.full(6, 0.25 * total), rel=0.02)
    assert 0.25 * total < sources.facing[0] < 0.5 * total
    assert not sources.flat[0] and sources.wide[0]


def test_cones_hold_all_normals_below():
    corners = np.concatenate((ball(1), random_polygons(np.random.default_rng(3), 20)))
    sources = sources_of(corners)
    for node in range(len(sources.area)):
        cosine = sources.normals[elements_below(sources.tree, node)] @ sources.normal[node]
        if cosine.min() < -1e-9:
            assert sources.cone[node] == 1
        else:
            assert np.sqrt(max(1 - cosine.min() ** 2, 0)) <= sources.cone[node] + 1e-7


def reach(tree, centre, size):
    """Return the mean radius of the nodes of about so many elements."""
    nodes = tree.cut(size)
    parts = [centre[tree.order[tree.start[node] : tree.stop[node]]] for node in nodes]
    return np.mean([np.sqrt(part.var(axis=0).sum()) for part in parts if len(part) > 1])


def test_compact_clusters_of_clutter_are_smaller():
    centre, normal, _ = measured(random_polygons(np.random.default_rng(3), 2000))
    # What fills a house looks along its axes, most of it.
    normal = np.sign(normal) * (np.abs(normal) == np.abs(normal).max(axis=1, keepdims=True))
    small, plain = (build_tree(centre, normal, compact=compact) for compact in (True, False))
    assert reach(small, centre, 64) < 0.9 * reach(plain, centre, 64)


def test_walls_are_parted_as_before():
    walls = []
    for axis in range(3):
        for side in (0.0, 1.0):
            u, v = np.roll(np.eye(3), -axis, axis=0)[1:]
            a = side * np.eye(3)[axis]
            corners = np.array([a, a + u, a + u + v, a + v])
            walls.append(corners if side == 0 else corners[::-1])
    centre, normal, _ = measured(split(walls, 4))
    small, plain = (build_tree(centre, normal, compact=compact) for compact in (True, False))
    assert (small.order == plain.order).all() and (small.start == plain.start).all()


@pytest.mark.parametrize("compact", [True, False])
def test_a_tree_is_the_same_whoever_splits_and_how_much_at_a_time(monkeypatch, compact):
    rng = np.random.default_rng(7)
    position, normal = rng.normal(size=(2, 3000, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shade = rng.normal(size=3000)
    whole = build_tree(position, normal, shade, compact=compact)
    splits = []
    monkeypatch.setattr(
        trees, "split", lambda order, start, *rest: splits.append(len(start)) or split_runs(order, start, *rest)
    )
    monkeypatch.setattr(trees, "_TOGETHER", 200)
    with ThreadPoolExecutor(3) as workers:
        parted = build_tree(position, normal, shade, compact=compact, workers=workers)
    assert len(splits) > 3 * len(parted.levels)
    assert all(np.array_equal(one, other) for one, other in zip(tree_arrays(whole), tree_arrays(parted), strict=True))


def tree_arrays(tree):
    """Return what a tree is made of."""
    return tree.order, tree.start, tree.stop, tree.child, np.array(tree.levels)
