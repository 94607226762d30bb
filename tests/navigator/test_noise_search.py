"""The noise of a navigation solution, and how the search for it climbs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldcal.navigator.noise_search import NOISE_LEAST, NOISE_MOST, likeliest_noise
from fieldcal.navigator.run_rows import (
    RunRows,
    RunSetup,
    evidence_slopes,
    run_posterior,
    run_rows,
)
from fieldcal.navigator.solution import NavigationSolution, runs_in_windows

SIZES = np.repeat([0.1, 1e-2, 1e-3, 1e-3], 3)


def white(rate_hz: float, seconds: float, seed: int) -> NavigationSolution:
    """Noise alone: 1 m/s and 1 m."""
    t = np.arange(int(seconds * rate_hz) + 1) / rate_hz
    return NavigationSolution(
        t, np.random.default_rng(seed).standard_normal((len(t), 6))
    )


def rows_of(noise: float) -> list[RunRows]:
    run = runs_in_windows(white(10.0, 100.0, 3), [(0.0, 100.0)])[0]
    attitudes = np.stack([np.eye(3), np.eye(3)[[1, 2, 0]]])
    earth, set_to = np.array([0.0, -5e-5, 4e-5]), np.full(2, 1e-3)
    setup = RunSetup(earth, 9.8, attitudes, np.full(3, 1e-3), set_to, range(6))
    out = [run_rows(run, setup, r) for r in range(2)]
    return [replace(one, y=noise * one.y) for one in out]


@pytest.mark.parametrize("rate_hz", [0.1, 1.0, 10.0])
def test_between_two_samples_noise_is_less_by_a_known_share(rate_hz: float) -> None:
    """The variance of instants over their shares is that of a sample, by many draws.

    Of ten seconds between samples there are no more instants than samples.
    """
    window = (0.0, 97.0)
    squares = []
    for seed in range(200):
        (run,) = runs_in_windows(white(rate_hz, 100.0, seed), [window])
        squares.append(run.values[:, :3] ** 2 / run.noise_share[:, None])
    each = np.array(squares)
    assert each.shape[1] == (9 if rate_hz == 0.1 else 24)
    assert each.mean() == pytest.approx(1.0, abs=5 * np.sqrt(2 / each.size))
    assert run.noise_share.min() < 0.7  # some lie between


@pytest.mark.parametrize("which", range(5))
def test_slopes_are_those_of_the_evidence(which: int) -> None:
    """By numerical differences; every noise is of a size that matters."""
    rows, noise = rows_of(0.01), np.array([3e-3, 3e-5, 1e-2, 3e-2, 1e-3])
    step = np.exp(1e-4 * np.eye(5)[which])
    above, below = (
        run_posterior(rows, SIZES, n).score for n in (noise * step, noise / step)
    )
    slope = evidence_slopes(rows, run_posterior(rows, SIZES, noise), noise)[which]
    assert abs(slope) > 1e-3
    assert slope == pytest.approx((above - below) / 2e-4, rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("which", range(5))
def test_any_noise_within_its_bounds_has_an_evidence(which: int) -> None:
    """Where one is as large as it may be, and all others are as small."""
    noise = np.array(NOISE_LEAST)
    noise[which] = NOISE_MOST[which]
    rows = rows_of(0.01)
    found = run_posterior(rows, SIZES, noise)
    assert np.isfinite([found.score, *evidence_slopes(rows, found, noise)]).all()


@pytest.mark.parametrize(
    "start",
    [None, NOISE_LEAST, pytest.param(NOISE_MOST, marks=pytest.mark.thorough)],
)
def test_the_noise_is_that_of_the_outputs_from_any_start(
    start: tuple[float, ...] | None,
) -> None:
    """Far below it the evidence is flat, as at its maximum."""
    found = likeliest_noise(
        rows_of(0.01), SIZES, None if start is None else np.array(start)
    )
    np.testing.assert_allclose(found[2:4], 0.01, rtol=0.2)
    again = likeliest_noise(rows_of(0.01), SIZES, found)
    np.testing.assert_allclose(np.log(again / found), 0.0, atol=0.05)
