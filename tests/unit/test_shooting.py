# SPDX-License-Identifier: GPL-3.0-or-later
"""The shooting solver against direct solutions of the same equations, shot by shot (T8)."""

import numpy as np
import pytest

from core.progress import exhaust
from core.shooting import shooting
from core.transport import DenseTransport


class Counted:
    """A transport that hands out columns only, and notes which."""

    def __init__(self, transport):
        self.transport, self.area, self.asked = transport, transport.area, []

    def column(self, j):
        self.asked.append(j)
        return self.transport.column(j)


def room(n=40, seed=0):
    """Return a reciprocal transport that loses some light, emission and reflectance."""
    rng = np.random.default_rng(seed)
    area = rng.uniform(0.5, 1.5, n)
    K = rng.random((n, n)) * np.minimum(area[:, None], area) * 2.1 / n
    K = (K + K.T) / 2
    np.fill_diagonal(K, 0.0)
    F = (K / area[:, None]).astype(np.float32)
    E = np.where(rng.random((n, 1)) < 0.2, rng.random((n, 3)), 0.0)
    return DenseTransport(F, area, F.sum(axis=1), n * n, 0), E, rng.uniform(0.1, 0.9, (n, 3))


def direct(transport, E, rho):
    F = transport.matrix.astype(float)
    return np.stack([np.linalg.solve(np.eye(len(F)) - rho[:, c, None] * F, E[:, c]) for c in range(3)], axis=1)


def test_the_solution_is_that_of_the_equations():
    transport, E, rho = room()
    solution = exhaust(shooting(Counted(transport), E, rho, iterations=10**5, tolerance=1e-9))
    assert solution.converged and solution.residual <= 1e-9
    np.testing.assert_allclose(solution.radiosity, direct(transport, E, rho), rtol=1e-6)
    np.testing.assert_allclose(solution.radiosity, E + rho * solution.irradiance, rtol=1e-12)


def test_the_largest_unshot_energy_goes_first_and_is_gone_then():
    transport, E, rho = room()
    counted = Counted(transport)
    unshot = E.copy()
    for step in shooting(counted, E, rho, iterations=60, tolerance=1e-9):
        energy = transport.area * unshot.sum(axis=1)
        j = counted.asked[-1]
        assert energy[j] == energy.max()
        arriving = transport.column(j)[:, None] * unshot[j]
        unshot[j] = 0.0
        unshot += rho * arriving
        left = (transport.area[:, None] * unshot).sum() / (transport.area[:, None] * E).sum()
        assert step.unshot == pytest.approx(left, rel=1e-12)
        assert step.iteration == len(counted.asked)


def test_what_is_shown_has_an_ambient_that_vanishes():
    transport, E, rho = room()
    A, exact = transport.area[:, None], direct(transport, E, rho)
    shown = [step.radiosity.copy() for step in shooting(transport, E, rho, iterations=10**5, tolerance=1e-9)]
    plain = exhaust(shooting(transport, E, rho, iterations=1, tolerance=1e-9)).radiosity
    # After one shot it is nearer to the end than the light shot so far, and it does not stay in the solution.
    assert (A * np.abs(shown[0] - exact)).sum() < 0.8 * (A * np.abs(plain - exact)).sum()
    assert (shown[0] >= plain).all() and (shown[0] > plain).any()
    np.testing.assert_allclose(shown[-1], exact, rtol=1e-6)


def test_the_ambient_is_what_even_light_would_become():
    # Uniform reflectance, all of it unshot: the estimate for the whole is exact in the mean.
    n = 16
    F = np.full((n, n), 1.0 / (n - 1), dtype=np.float32)
    np.fill_diagonal(F, 0.0)
    transport = DenseTransport(F, np.ones(n), np.ones(n), n * n, 0)
    E, rho = np.ones((n, 3)), np.full((n, 3), 0.5)
    first = next(shooting(transport, E, rho, iterations=5, tolerance=1e-3))
    assert first.radiosity.mean() == pytest.approx(2.0, rel=1e-6)


def test_both_stop_rules():
    transport, E, rho = room()
    few = exhaust(shooting(transport, E, rho, iterations=5, tolerance=1e-9))
    assert (few.iterations, few.converged) == (5, False) and few.residual > 1e-9
    loose = exhaust(shooting(transport, E, rho, iterations=10**5, tolerance=1e-2))
    tight = exhaust(shooting(transport, E, rho, iterations=10**5, tolerance=1e-4))
    assert loose.converged and tight.converged and loose.iterations < tight.iterations


def test_progress_ends_at_one():
    transport, E, rho = room()
    fractions = [step.fraction for step in shooting(transport, E, rho, iterations=10**5, tolerance=1e-4)]
    assert min(fractions) >= 0.0 and fractions[-1] == 1.0
    assert next(shooting(transport, E, rho, iterations=10, tolerance=0.0)).fraction == pytest.approx(0.1)


def test_without_emission_nothing_is_shot():
    transport, E, rho = room()
    counted = Counted(transport)
    solution = exhaust(shooting(counted, 0.0 * E, rho, iterations=5, tolerance=1e-4))
    assert (solution.iterations, solution.converged, counted.asked) == (0, True, [])


def test_no_patches_at_all():
    transport = DenseTransport(np.zeros((0, 0), np.float32), np.zeros(0), np.zeros(0), 0, 0)
    solution = exhaust(shooting(transport, np.zeros((0, 3)), np.zeros((0, 3)), iterations=5, tolerance=1e-4))
    assert solution.radiosity.shape == (0, 3) and solution.converged
