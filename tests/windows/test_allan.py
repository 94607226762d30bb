"""Allan deviations of noise whose deviation is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.windows.allan import allan_deviation

RATE = 50.0


def still(seconds: float, walk: float = 0.0, seed: int = 0) -> Block:
    """White noise of 0.05 m/s^2, 0.002 rad/s, and a random walk on the gyroscopes."""
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE)
    acc = [0, -9.81, 0] + 0.05 * rng.standard_normal((n, 3))
    steps = walk / np.sqrt(RATE) * rng.standard_normal((n, 3))
    gyr = 0.002 * rng.standard_normal((n, 3)) + np.cumsum(steps, axis=0)
    return Block.of(np.arange(n) / RATE, acc, gyr)


@pytest.mark.statistical
def test_white_noise_falls_with_the_root_of_time() -> None:
    ratios = []
    for seed in range(4):
        found = allan_deviation(still(900, seed=seed))
        truth = 0.05 / np.sqrt(RATE * found.tau)
        ratios.append(found.deviation[:, :3] / truth[:, None])
        inside = (found.low[:, :3] < truth[:, None]) & (
            truth[:, None] < found.high[:, :3]
        )
        assert inside.mean() > 0.4
        sigma = found.sigma_of_mean(30.0)
        assert sigma[:3] == pytest.approx(0.05 / np.sqrt(30 * RATE), rel=0.35)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.05)


@pytest.mark.statistical
def test_random_walk_tells_when_more_time_is_useless() -> None:
    """White N and walk K meet where N^2/tau = K^2 tau/3: here at 10 s."""
    density = 0.002 / np.sqrt(RATE)
    found = allan_deviation(still(1800, walk=np.sqrt(3) * density / 10))
    assert (found.best[3:] > 5).all() and (found.best[3:] < 22).all()
    at = found.sigma_of_mean(10.0)[3:]
    assert at == pytest.approx(np.sqrt(2 * density**2 / 10), rel=0.2)


def test_what_was_not_measured_is_nan_and_a_nan_is_bridged() -> None:
    block = still(300)
    block.gyr[:] = np.nan
    block.acc[100:110, 0] = np.nan
    found = allan_deviation(block)
    assert np.isnan(found.deviation[:, 3:]).all() and np.isnan(found.best[3:]).all()
    assert np.isfinite(found.deviation[:, :3]).all()


def test_no_mean_is_better_than_the_steps_of_the_outputs_allow() -> None:
    block = still(300)
    step = 0.5  # ten times the noise
    block.acc[:] = step * np.round((block.acc + [0.2, 0.0, 0.0]) / step)
    found = allan_deviation(block)
    assert np.ptp(block.acc[:, 0]) == step and np.ptp(block.acc[:, 2]) == 0
    assert found.sigma_of_mean(60.0)[2] == pytest.approx(step / np.sqrt(12))
    assert (found.sigma_of_mean(60.0)[3:] < 1e-4).all()


def test_what_cannot_be_told_is_refused() -> None:
    with pytest.raises(InputError, match="20 s is too short"):
        allan_deviation(still(20))
    block = still(200)
    late = np.where(block.t > 100, 7.0, 0.0)
    with pytest.raises(InputError, match=r"no samples for 7\.0 s from 100\.00 s"):
        allan_deviation(Block.of(block.t + late, block.acc))
    with pytest.raises(InputError, match="none of ax"):
        allan_deviation(Block.of(block.t, np.full((len(block), 3), np.nan)))
    with pytest.raises(InputError, match="record 400 s at rest"):
        allan_deviation(block).sigma_of_mean(100.0)
