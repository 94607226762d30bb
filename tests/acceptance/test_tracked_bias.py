"""Against dense covariances of a bias that is followed in short steps of time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fieldcal.acceptance.rest_steps import RestStep
from fieldcal.acceptance.tracked_bias import (
    CASE,
    SENT_AFTER,
    Cases,
    log_likelihoods,
)
from fieldcal.core.samples import Array

DENSITY = 2.5e-9
RESTART = 9e-7
NO_RATE = np.full(1, np.nan)


def case(tau: float, blind: float = 0.0, walk: float = 0.0) -> Cases:
    one = (tau, 4e-8, 3e-9, 2e-8, walk, blind, 1.0)
    return np.array([one], dtype=CASE)


def steps(rng: np.random.Generator, lost: bool) -> list[RestStep]:
    """Two windows, with rest before and after the turn between them."""
    out = [RestStep(2.0, 2.0 * k, 1e-4 * rng.standard_normal(1)) for k in range(4)]
    out += [RestStep(0.75, 8.0, NO_RATE), RestStep(0.5, 0.0, NO_RATE, True, lost)]
    return out + [
        RestStep(1.5, 0.5 + 1.5 * k, 1e-4 * rng.standard_normal(1)) for k in range(5)
    ]


def reference(
    every: list[RestStep], tau: float, blind: float, walk: float, fine: int
) -> float:
    """Log density of the means, by the integral of (1) in short steps.

    u and the output are linear in u at first, w of each window, what the turn puts in,
    and the noise of each short step; the covariance is that of these together.
    """
    cells = len(every)
    one = case(tau)[0]
    turns = [k for k, step in enumerate(every) if step.turned]
    width = 1 + 2 * (1 + len(turns)) + fine * cells + cells
    var, u, window = np.zeros(width), np.zeros(width), 0
    u[0], var[0] = 1.0, one["start"]
    var[1 : 2 + len(turns)] = one["felt"]
    rows: list[Array] = []
    means, own = [], list[float]()
    for k, step in enumerate(every):
        if step.turned:
            window += 1
            put = 1 + 1 + len(turns) + window
            u[put], var[put] = 1.0, one["put_in"] + (RESTART if step.lost else 0.0)
        h, total = step.seconds / fine, np.zeros(width)
        for i in range(fine):
            noise = 3 + 2 * len(turns) + fine * k + i
            var[noise] = DENSITY / h
            output = u.copy()
            output[1 + window] += 1.0
            output[noise] += 1.0
            # the middle of the short step, for the second order in h
            u = u - output * (h / tau) * (1 - h / tau / 2)
            total += output / fine
        u[width - cells + k], var[width - cells + k] = 1.0, walk * step.seconds
        if np.isfinite(step.rates[0]) and step.since_turn >= blind:
            rows.append(total)
            means.append(step.rates[0])
            own.append(SENT_AFTER * DENSITY / float(step.seconds))
    map_ = np.array(rows)
    cov = (map_ * var) @ map_.T + np.diag(own)
    dense = multivariate_normal(cov=cov).logpdf(means)
    return float(dense + 0.5 * len(means) * np.log(2 * np.pi))


@pytest.mark.parametrize("tau", [0.5, 5.0, 80.0, np.inf])
@pytest.mark.parametrize(("blind", "lost"), [(0.0, False), (0.0, True), (3.0, True)])
def test_the_filter_has_the_density_of_all_means_together(
    tau: float, blind: float, lost: bool
) -> None:
    every = steps(np.random.default_rng(5), lost)
    for walk in (0.0, 1e-10):
        found, _, count = log_likelihoods(
            every, np.array([DENSITY]), RESTART, case(tau, blind, walk)
        )
        coarse, fine = (reference(every, tau, blind, walk, n) for n in (100, 200))
        expected = 2 * fine - coarse  # without the error of first order
        assert count[0] == (9 if not blind else 5)
        assert found[0] == pytest.approx(expected, abs=0.02)


def test_axes_add_up_and_an_axis_without_rates_adds_nothing() -> None:
    rng = np.random.default_rng(6)
    rates = 1e-4 * rng.standard_normal((6, 2))
    both = [RestStep(2.0, 2.0 * k, rate) for k, rate in enumerate(rates)]
    parts = [
        log_likelihoods(
            [RestStep(2.0, s.since_turn, s.rates[a : a + 1]) for s in both],
            np.array([DENSITY]), RESTART, case(5.0),
        )
        for a in range(2)
    ]  # fmt: skip
    alone = [float(part[0][0]) for part in parts]
    found, chi2, count = log_likelihoods(both, np.full(2, DENSITY), RESTART, case(5.0))
    assert found[0] == pytest.approx(sum(alone), rel=1e-12)
    assert chi2[0] == pytest.approx(sum(float(p[1][0]) for p in parts), rel=1e-12)
    assert count[0] == 12
    rates[:, 1] = np.nan
    found, _, count = log_likelihoods(both, np.full(2, DENSITY), RESTART, case(5.0))
    assert (found[0], count[0]) == (pytest.approx(alone[0], rel=1e-12), 6)
