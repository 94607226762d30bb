"""Against draws of the Earth's direction."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.acceptance.earth_rate_alone import earth_rate_alone
from fieldcal.acceptance.rest_steps import RestStep
from fieldcal.acceptance.tracked_bias import SENT_AFTER
from fieldcal.core.frames import EARTH_RATE

DENSITY = np.full(3, 4e-9)


def two_windows(rng: np.random.Generator) -> list[RestStep]:
    steps = []
    for _ in range(2):
        way = rng.standard_normal(3)
        rate = EARTH_RATE * way / np.linalg.norm(way)
        steps.append(RestStep(0.5, 0.0, np.full(3, np.nan), turned=True))
        for k in range(4):
            seen = rate + 3e-5 * rng.standard_normal(3)
            steps.append(RestStep(3.0, 0.5 + 3.0 * k, seen))
    return steps


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("blind", [0.0, 3.0])
def test_it_is_the_mean_over_all_directions(seed: int, blind: float) -> None:
    rng = np.random.default_rng(seed)
    steps = two_windows(rng)
    way = rng.standard_normal((60_000, 3))
    every = EARTH_RATE * way / np.linalg.norm(way, axis=1)[:, None]
    var = DENSITY[0] * (1 + SENT_AFTER) / 3.0
    expected = 0.0
    for window in (steps[:5], steps[5:]):
        used = [s.rates for s in window[1:] if s.since_turn >= blind]
        off = np.array(used)[:, None] - every
        logs = -0.5 * (off**2).sum(axis=(0, 2)) / var
        expected += float(np.logaddexp.reduce(logs) - np.log(len(every)))
        expected -= 1.5 * len(used) * np.log(var)
    found = earth_rate_alone(steps, DENSITY, blind)
    assert found == pytest.approx(expected, abs=0.05)


def test_it_takes_three_axes() -> None:
    steps = [RestStep(3.0, 0.0, np.zeros(2))]
    assert earth_rate_alone(steps, DENSITY[:2], 0.0) == -np.inf
    unknown = RestStep(3.0, 0.0, np.array([0.0, np.nan, 0.0]))
    assert earth_rate_alone([unknown], DENSITY, 0.0) == pytest.approx(0.0, abs=1e-6)
