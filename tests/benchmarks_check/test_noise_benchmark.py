"""What the benchmark of noise counts."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.noise import scored
from benchmarks.noise.peers import allan_variance
from benchmarks.noise.processes import bound, covariance, noise


def test_scores_are_densities_and_bands_hold_two_thirds() -> None:
    rng = np.random.default_rng(0)
    nu, variance = np.full(4000, 9.0), np.full(4000, 4.0)
    deviation = np.sqrt(variance * rng.chisquare(nu) / nu)
    _, held = scored(variance, nu, deviation)
    assert np.mean(held) == pytest.approx(0.68, abs=0.03)
    grid = np.linspace(-4, 4, 2000)
    density = np.exp(scored(np.ones(2000), np.full(2000, 9.0), np.exp(grid))[0])
    assert np.trapezoid(density, grid) == pytest.approx(1.0, abs=1e-3)


def test_the_bound_of_white_noise_is_the_textbooks() -> None:
    """One of n - 1 squares about an unknown mean."""
    found = bound(50, 0.1, {"N": 3.0})
    assert found == pytest.approx(np.array([1 / np.sqrt(2 * 49)]))


@pytest.mark.parametrize("process", ["N", "Q", "K", "B"])
def test_simulated_processes_have_their_covariance(process: str) -> None:
    """By the variance of the difference of halves, which no mean enters."""
    rng = np.random.default_rng(1)
    values = noise(rng, 400, 0.1, 3000, **{process: 2.0})
    half = np.repeat([-1.0, 1.0], 200) / 200
    truth = 4.0 * half @ covariance(400, 0.1, process) @ half
    # Kasdin's flicker begins when the recording does
    allowed = 0.25 if process == "B" else 0.1
    assert np.var(half @ values) == pytest.approx(truth, rel=allowed)


def test_the_peer_is_asked_for_the_same_sizes() -> None:
    pytest.importorskip("allan_variance")
    values = noise(np.random.default_rng(2), 20_000, 0.1, 3, N=2.0, K=0.1)
    found = allan_variance(values, 0.1, {"N": 2.0, "K": 0.1})
    assert found[:, 0] == pytest.approx(2.0, rel=0.1)
