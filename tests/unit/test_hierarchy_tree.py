# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchy's tree, the sources on it, the groups of receivers, and the links between them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.form_factors import point_to_polygon
from core.hierarchy.elements import centres, quarters
from core.hierarchy.kernels import far_form_factors, near_form_factors
from core.hierarchy.links import find_links
from core.hierarchy.rays import SourcePoints, visible_share
from core.hierarchy.receivers import group_receivers
from core.hierarchy.sources import build_sources, shown_area
from core.hierarchy.tree import build_tree
from core.meshing import mesh
from core.scene import Scene
from core.visibility import scene_occluders


def measured(corners):
    """Return centres, unit normals and areas of planar patches."""
    vector = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area = np.sqrt((vector**2).sum(axis=1))
    return centres(corners), vector / area[:, None], area


def split(polygons, times):
    corners = np.array(polygons, float)
    for _ in range(times):
        corners = quarters(corners)
    return corners


def sources_of(corners, shade=None):
    return build_sources(corners, *measured(corners), shade)


def elements_below(tree, node):
    return tree.order[tree.start[node] : tree.stop[node]]


def ball(times=2):
    """An octahedron's triangles, split and pushed out to the unit sphere."""
    corners = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            for sz in (-1, 1):
                face = [(sx, 0, 0), (0, sy, 0), (0, 0, sz)][:: sx * sy * sz]
                corners.append([*face, face[-1]])
    corners = split(corners, times)
    return corners / np.linalg.norm(corners, axis=2, keepdims=True)


def random_polygons(rng, count, triangles=0.5):
    """Return rectangles and triangles of any size and orientation, here and there."""
    frame = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    u, v = frame[:, 0] * rng.uniform(0.1, 1, (count, 1)), frame[:, 1] * rng.uniform(0.1, 1, (count, 1))
    a = rng.uniform(-2, 2, (count, 3))
    corners = np.stack((a, a + u, a + u + v, a + v), axis=1)
    triangle = rng.random(count) < triangles
    corners[triangle, 3] = corners[triangle, 2]
    return corners


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


@pytest.mark.parametrize("times", [0, 2])
def test_four_points_of_a_rectangle_are_those_of_gauss(times):
    a, u, v = np.array((1.0, 2.0, 3.0)), np.array((0.0, 3.0, 4.0)), np.array((2.0, 0.0, 0.0))
    corners = split([(a, a + u, a + u + v, a + v)], times)
    sources = sources_of(corners)
    places = (1 - 1 / np.sqrt(3)) / 2, (1 + 1 / np.sqrt(3)) / 2
    gauss = np.array([a + s * u + t * v for s in places for t in places])
    apart = np.linalg.norm(gauss[:, None] - sources.quadrature[0][None], axis=2)
    assert apart.min(axis=1) == pytest.approx(np.zeros(4), abs=1e-12)
    assert sources.flat.all()
    assert sources.vector[0] == pytest.approx(np.tile(np.cross(u, v) / 4, (4, 1)))


def test_four_points_of_anything_flat_integrate_quadratics():
    # Two parallelograms, far from square and apart.
    polygon = np.array([(0, 0, 0), (2, 0, 0), (2.5, 1, 0), (0.5, 1, 0)], float)
    corners = np.concatenate((split([polygon], 2), split([polygon * 0.3 + (3, 1, 0)], 1)))
    sources = sources_of(corners)
    fine = split(corners, 4)
    at, _, area = measured(fine)
    for power in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)):
        value = np.prod(at[:, :2] ** power, axis=1) @ area / area.sum()
        points = np.prod(sources.quadrature[0][:, :2] ** power, axis=1).mean()
        assert points == pytest.approx(value, rel=1e-3)


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


def test_a_far_ball_lights_as_a_point_of_its_size():
    sources = sources_of(ball())
    radius = np.sqrt(sources.area[0] / (4 * np.pi))
    up = np.array([(0.0, 0.0, 1.0)])
    for way in np.concatenate((np.eye(3), [(0.6, 0.0, 0.8)])):
        point = sources.centre[:1] - 20 * radius * way
        # The form factor of a sphere: the share of the hemisphere that it fills, by the cosine (Howell C-11).
        expected = max(way @ up[0], 0) / 20**2
        factor = far_form_factors(point, up, sources, np.zeros(1, int))[0]
        assert factor == pytest.approx(expected, rel=0.03, abs=1e-4)


def test_cones_hold_all_normals_below():
    corners = np.concatenate((ball(1), random_polygons(np.random.default_rng(3), 20)))
    sources = sources_of(corners)
    for node in range(len(sources.area)):
        cosine = sources.normals[elements_below(sources.tree, node)] @ sources.normal[node]
        if cosine.min() < -1e-9:
            assert sources.cone[node] == 1
        else:
            assert np.sqrt(max(1 - cosine.min() ** 2, 0)) <= sources.cone[node] + 1e-7


@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_the_far_kernel_errs_with_the_fourth_power_of_the_angle(offset):
    corners = split([[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]], 2) + offset
    sources = sources_of(corners)
    errors = []
    for distance in (3.0, 6.0, 12.0):
        point = offset + distance * np.array([(0, 0, 1), (0.6, 0, 0.8), (0.5, 0.7, 0.5)])
        normal = -(point - offset) / distance
        root = np.zeros(3, int)
        exact = np.array([point_to_polygon(point, normal, np.tile(c, (3, 1, 1))) for c in corners]).sum(axis=0)
        errors.append(np.abs(far_form_factors(point, normal, sources, root) / exact - 1).max())
    # Single precision ends it at about 1e-7.
    assert errors[0] < 0.02
    assert errors[1] < errors[0] / 12 and errors[2] < errors[1] / 10


def test_the_far_kernel_sees_nothing_behind_either():
    sources = sources_of(np.array([[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]], float))
    point = np.array([(0, 0, 5), (0, 0, -5), (0, 0, 5)], float)
    normal = np.array([(0, 0, -1), (0, 0, 1), (0, 0, 1)], float)
    factors = far_form_factors(point, normal, sources, np.zeros(3, int))
    assert factors[0] > 0 and (factors[1:] == 0).all()


def test_the_near_kernel_is_exact_next_to_a_wall():
    square = np.array([[(0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)]], float)
    # At the foot of an endless wall it would be one half.
    wide = square * (1, 2e4, 1e4) - (0, 1e4, 0)
    assert near_form_factors(np.array([(1e-3, 0, 0.0)]), np.array([(0, 0, 1.0)]), wide) == pytest.approx(0.5, abs=1e-4)


def test_a_ball_from_afar_is_a_disc():
    # A sphere of radius r at distance d fills (r / d)^2.
    corners = ball(3)
    sources = sources_of(corners)
    point = 8 * np.array([(1, 0, 0), (0.6, 0.8, 0), (0.48, 0.64, 0.6)])
    receivers = group_receivers(point, -point / 8, size=1)
    bright = np.ones(len(sources.area))
    links = find_links(receivers, np.arange(3), sources, bright, angle=0.4, error=1e-5)
    far = ~links.near
    factor = far_form_factors(receivers.point[links.group], receivers.normal[links.group], sources, links.node)
    assert far.all()
    assert np.bincount(links.group, factor) == pytest.approx(np.full(3, 1 / 64), rel=0.02)


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
