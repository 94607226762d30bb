"""Allan deviations of what comes, and the bands that hold them."""

from __future__ import annotations

import numpy as np
import pytest
from few_channels import only

from benchmarks.noise.processes import covariance, noise, recording
from fieldcal.core.samples import Array
from fieldcal.noise import estimate_noise, reduce_recording
from fieldcal.noise.measured import measured_allan_deviation
from fieldcal.noise.processes import (
    DIFFERENCES_PER_TIME,
    UNCORRELATED_TIMES,
    allan_variance,
    degrees_of_freedom,
    difference_covariances,
)

ONE = np.zeros(1)


def test_allan_variances_are_those_of_the_standard() -> None:
    tau = np.array([0.5, 3.0, 40.0])
    for term, expected in (
        ("N", 1 / tau),
        ("Q", 3 / tau**2),
        ("K", tau / 3),
        ("B", 2 * np.log(2) / np.pi + 0 * tau),
    ):
        assert allan_variance((term,), ONE, tau, 0.01) == pytest.approx(expected)
    u = tau / 5.0
    markov = 2 * 5.0 / tau * (1 - (3 - 4 * np.exp(-u) + np.exp(-2 * u)) / (2 * u))
    found = allan_variance(("G",), np.array([0.0, np.log(5.0)]), tau, 0.01)
    assert found == pytest.approx(markov)


def test_flicker_up_to_a_long_time_is_flicker() -> None:
    tau = np.array([1.0, 10.0, 100.0])
    x = np.array([0.0, np.log(1e6)])
    assert allan_variance(("BT",), x, tau, 1e-3) == pytest.approx(
        2 * np.log(2) / np.pi, rel=0.02
    )


@pytest.mark.parametrize(("term", "time"), [("N", 1.0), ("K", 1.0), ("G", 30.0)])
def test_estimates_scatter_as_they_are_said_to(term: str, time: float) -> None:
    """The exact variance of the estimate from a dense covariance."""
    n, m = 240, 16
    x = np.array([0.0, np.log(time)]) if term == "G" else ONE
    r = difference_covariances(
        (term,), x, float(m), 0.1, UNCORRELATED_TIMES * DIFFERENCES_PER_TIME
    )
    bends = np.array(
        [
            np.concatenate(
                [np.zeros(i), -np.ones(m), np.ones(m), np.zeros(n - i - 2 * m)]
            )
            for i in range(n - 2 * m + 1)
        ]
    )
    whole = bends @ covariance(n, 1.0, term, time) @ bends.T
    exact = np.trace(whole) ** 2 / np.sum(whole**2)
    assert degrees_of_freedom(r, float(m), float(n)) == pytest.approx(exact, rel=0.1)


def halves(values: Array, dt: float) -> tuple[list[bool], list[float]]:
    """Whether the first half's bands hold the second half, and the log scores."""
    middle = len(values) // 2
    model = estimate_noise([reduce_recording([recording(values[:middle], dt)])])
    second = reduce_recording([recording(values[middle:], dt)])
    held: list[bool] = []
    scores: list[float] = []
    for i, name in enumerate(("ax", "ay", "az", "gx", "gy", "gz")):
        seen = measured_allan_deviation(second.stretches, i)
        length = middle * dt
        asked = (seen.tau >= 10) & (seen.tau <= min(1000, length / 4))
        said = model.channels[name].predict_allan(seen.tau[asked], length)
        deviation = seen.deviation[asked]
        held += ((said.low < deviation) & (deviation < said.high)).tolist()
        scores += said.log_score(deviation).tolist()
    return held, scores


@pytest.mark.statistical
def test_bands_hold_what_they_say() -> None:
    rng = np.random.default_rng(17)
    values = np.hstack(
        [
            noise(rng, 24_000, 0.1, 2, N=1.0),
            noise(rng, 24_000, 0.1, 2, N=1.0, K=0.05),
            noise(rng, 24_000, 0.1, 2, N=1.0, B=0.5),
        ]
    )
    held, _ = halves(values, 0.1)
    # neighbouring averaging times are not independent: about 15 that are, of which
    # 0.683 +- 0.12 are held
    assert 0.43 < np.mean(held) < 0.93


def test_sizes_are_drawn_from_their_likelihood() -> None:
    """The log of a variance from n samples of white noise scatters by sqrt(2/n)."""
    values = noise(np.random.default_rng(19), 400, 0.1, 6, N=1.0)
    spread = []
    for channel in estimate_noise(
        [reduce_recording([recording(values, 0.1)])]
    ).channels.values():
        alone = [d.x[0] for d in channel.drawn if d.terms == ("N",)]
        if channel.dispersion == 1 and len(alone) > 50:
            spread.append(np.std(alone) / np.sqrt(2 / 400))
    assert len(spread) >= 3
    assert np.mean(spread) == pytest.approx(1.0, abs=0.12)


def test_the_score_is_a_density() -> None:
    values = only(noise(np.random.default_rng(18), 6000, 0.1, 6, N=1.0), 0)
    model = estimate_noise([reduce_recording([recording(values, 0.1)])]).channels["ax"]
    said = model.predict_allan(np.array([20.0]), 600.0)
    grid = np.linspace(np.log(said.median[0]) - 3, np.log(said.median[0]) + 3, 400)
    density = [np.exp(said.log_score(np.exp(np.array([g])))[0]) for g in grid]
    assert np.trapezoid(density, grid) == pytest.approx(1.0, abs=0.01)
