# SPDX-License-Identifier: GPL-3.0-or-later
"""The kernels of the hierarchy: how nodes light points from afar and from close by."""

import numpy as np
import pytest

from core.form_factors import point_to_polygon
from core.hierarchy.kernels import far_form_factors, near_form_factors
from core.hierarchy.links import find_links
from core.hierarchy.receivers import group_receivers
from tests.unit.source_trees import ball, measured, sources_of, split


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
