# SPDX-License-Identifier: GPL-3.0-or-later
"""The gathering solver against direct solutions of the same equations (T1, T5, T6)."""

import numpy as np
import pytest

from core.gathering import gathering
from core.progress import exhaust
from core.transport import DenseTransport


def closed_room(n, seed=0):
    """Return a reciprocal, closed transport between n patches of unequal size, and emission and reflectance."""
    rng = np.random.default_rng(seed)
    K = rng.random((n, n))
    K = K + K.T
    np.fill_diagonal(K, 0.0)
    # Scaled until closed: rows sum to the areas, and stay symmetric (as View3D does it).
    area = rng.uniform(0.5, 1.5, n)
    for _ in range(200):
        scale = np.sqrt(area / K.sum(axis=1))
        K = scale[:, None] * K * scale
    F = (K / area[:, None]).astype(np.float32)
    transport = DenseTransport(F, area, F.sum(axis=1, dtype=np.float64), n * n, 0)
    emission = np.where(rng.random((n, 1)) < 0.2, rng.random((n, 3)), 0.0)
    return transport, emission, rng.uniform(0.1, 0.9, (n, 3))


def direct(transport, emission, reflectance):
    """Solve (1 - rho F) B = E for each channel."""
    F = transport.matrix.astype(float)
    one = np.eye(len(F))
    return np.stack([np.linalg.solve(one - reflectance[:, c, None] * F, emission[:, c]) for c in range(3)], axis=1)


@pytest.mark.parametrize("sweep", ["in-place", "jacobi", "accelerated"])
def test_the_solution_is_that_of_the_equations(sweep):
    transport, E, rho = closed_room(200)
    solution = exhaust(gathering(transport, E, rho, tolerance=1e-6, sweep=sweep))
    assert solution.converged and solution.residual <= 1e-6
    np.testing.assert_allclose(solution.radiosity, direct(transport, E, rho), rtol=1e-5)
    # B = E + rho H holds whatever the sweep.
    np.testing.assert_allclose(solution.radiosity, E + rho * solution.irradiance, rtol=1e-14)


@pytest.mark.parametrize("sweep", ["in-place", "jacobi", "accelerated"])
def test_one_iteration_is_direct_light(sweep):
    transport, E, rho = closed_room(50)
    solution = exhaust(gathering(transport, E, rho, iterations=1, sweep=sweep))
    assert solution.iterations == 1 and not solution.converged
    np.testing.assert_allclose(solution.irradiance, transport.matrix @ E, rtol=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_in_place_converges_faster(seed):
    transport, E, rho = closed_room(150, seed)
    sweeps = {
        sweep: exhaust(gathering(transport, E, rho, tolerance=1e-5, sweep=sweep)).iterations
        for sweep in ("in-place", "jacobi")
    }
    assert sweeps["in-place"] < 0.8 * sweeps["jacobi"]


@pytest.mark.parametrize("telling", [20_000, 50])
def test_mixed_sweeps_end_in_half_the_time(monkeypatch, telling):
    # A few patches tell as well as all how sweeps are mixed.
    monkeypatch.setattr("core.acceleration._TELLING", telling)
    transport, E, rho = closed_room(300)
    solutions = [
        exhaust(gathering(transport, E, rho, tolerance=1e-6, sweep=sweep)) for sweep in ("accelerated", "jacobi")
    ]
    mixed, plain = solutions
    assert mixed.converged and mixed.iterations < 0.5 * plain.iterations
    np.testing.assert_allclose(mixed.radiosity, direct(transport, E, rho), rtol=1e-5)


def test_both_stop_rules():
    transport, E, rho = closed_room(60)
    few = exhaust(gathering(transport, E, rho, iterations=3, tolerance=1e-6))
    assert (few.iterations, few.converged) == (3, False) and few.residual > 1e-6
    loose = exhaust(gathering(transport, E, rho, iterations=200, tolerance=1e-2))
    tight = exhaust(gathering(transport, E, rho, iterations=200, tolerance=1e-5))
    assert loose.converged and tight.converged and loose.iterations < tight.iterations < 200
    # No tolerance: until nothing changes in any bit, or the iterations run out.
    assert exhaust(gathering(transport, E, rho, iterations=40, tolerance=0.0)).iterations >= tight.iterations


def test_progress_tells_how_far_it_is():
    transport, E, rho = closed_room(60)
    steps = list(gathering(transport, E, rho, tolerance=1e-5, sweep="jacobi"))
    assert [step.iteration for step in steps] == list(range(1, len(steps) + 1))
    fractions = [step.fraction for step in steps]
    assert fractions == sorted(fractions) and fractions[-1] == 1.0
    # What a Jacobi sweep changes is exactly the light that is reflected once more.
    A, F = transport.area[:, None], transport.matrix.astype(float)
    unshot = E
    for step in steps[:6]:
        unshot = rho * (F @ unshot)
        assert step.unshot == pytest.approx((A * unshot).sum() / (A * E).sum(), rel=1e-4)
        assert 0.0 < step.residual <= 1.0
    assert steps[-1].radiosity.shape == (60, 3)


def test_black_patches_are_done_at_once():
    transport, E, rho = closed_room(40)
    solution = exhaust(gathering(transport, E, 0.0 * rho, tolerance=0.0))
    assert (solution.iterations, solution.converged, solution.residual) == (1, True, 0.0)
    np.testing.assert_array_equal(solution.radiosity, E)
    np.testing.assert_allclose(solution.irradiance, transport.matrix @ E, rtol=1e-5)


def test_without_emission_all_stays_dark():
    transport, E, rho = closed_room(10)
    solution = exhaust(gathering(transport, 0.0 * E, rho))
    np.testing.assert_array_equal(solution.radiosity, 0.0)
    assert solution.converged


def test_a_transport_without_rows_is_swept_as_a_whole():
    transport, E, rho = closed_room(30)

    class Whole:
        area = transport.area
        gather = staticmethod(transport.gather)

    solution = exhaust(gathering(Whole(), E, rho, tolerance=1e-6))
    np.testing.assert_allclose(solution.radiosity, direct(transport, E, rho), rtol=1e-5)
