"""Rates at rest in windows, and the time at rest between them."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.acceptance.rest_steps import (
    CELLS,
    noise_of_samples,
    rest_steps,
    sample_period,
    stops_at_rest,
)
from fieldcal.core.samples import Array, Block

RATE, NOISE = 50.0, 1e-3
AXES = np.arange(3)


def recording(*turns: tuple[float, float]) -> Block:
    """A minute at rest with turns of 0.2 rad/s about z at these times, s."""
    rng = np.random.default_rng(2)
    t = np.arange(3000) / RATE
    gyr = 0.01 + NOISE * rng.standard_normal((3000, 3))
    for start, end in turns:
        gyr[(t >= start) & (t < end), 2] += 0.2
    return Block.of(t, np.zeros((3000, 3)), gyr)


def held(block: Block, *spans: tuple[float, float]) -> list[Block]:
    return [block.between(*span) for span in spans]


def noise(windows: list[Block]) -> Array:
    return noise_of_samples(windows, AXES)


def test_noise_is_that_of_white_noise_and_nan_without_any() -> None:
    windows = held(recording(), (0.0, 30.0), (30.0, 60.0))
    np.testing.assert_allclose(noise(windows), NOISE, rtol=0.15)
    windows[1].gyr[:, 1] = 0.01
    assert np.isnan(noise(windows)).tolist() == [[False] * 3, [False, True, False]]
    assert sample_period(windows[0]) == pytest.approx(1 / RATE)


def test_rest_between_windows_ends_and_begins_with_the_turn() -> None:
    block = recording((25.0, 31.0))
    windows = held(block, (2.0, 22.0), (34.0, 54.0))
    steps = rest_steps(stops_at_rest(windows, block, noise(windows)), AXES)
    count = len(steps) // 2 - 1
    assert CELLS - 2 < count <= CELLS
    before, after = steps[count : count + 2]
    assert before.seconds == pytest.approx(3.0, abs=0.3) and not before.turned
    assert after.seconds == pytest.approx(3.0, abs=0.3) and after.turned
    assert not after.lost and np.isnan([before.rates, after.rates]).all()
    times = [float(step.since_turn) for step in steps[count + 2 :]]
    length = float(steps[0].seconds)
    np.testing.assert_allclose(times, after.seconds + length * np.arange(count))
    assert 20.0 - length < count * length <= 20.0 + 1e-6
    mean = np.mean([step.rates for step in steps if np.isfinite(step.rates).all()], 0)
    np.testing.assert_allclose(mean, 0.01, atol=2e-4)


def test_windows_side_by_side_have_a_turn_between_them() -> None:
    block = recording()
    windows = held(block, (0.0, 30.0), (30.0, 60.0))
    steps = rest_steps(stops_at_rest(windows, block, noise(windows)), AXES)
    turned = [step.turned for step in steps]
    assert turned == [k == CELLS for k in range(2 * CELLS + 1)]
    assert steps[CELLS].seconds == 0.0


def test_samples_that_are_missing_may_hide_a_restart() -> None:
    whole = recording((25.0, 31.0))
    for missing in (0.4, 0.6):
        kept = np.flatnonzero((whole.t < 28.0) | (whole.t > 28.0 + missing))
        block = whole[kept]
        windows = held(block, (2.0, 22.0), (34.0, 54.0))
        steps = rest_steps(stops_at_rest(windows, block, noise(windows)), AXES)
        assert [s.lost for s in steps if s.turned] == [missing > 0.5]


def test_an_axis_without_noise_in_a_window_has_no_rate_there() -> None:
    block = recording()
    block.gyr[:1500, 0] = 0.01
    windows = held(block, (0.0, 30.0), (30.0, 60.0))
    stops = stops_at_rest(windows, block, noise(windows)[:, :2])
    steps = rest_steps(stops, AXES[:2])
    unknown = [np.isnan(step.rates).tolist() for step in steps]
    assert unknown[:CELLS] == [[True, False]] * CELLS
    assert unknown[CELLS + 1 :] == [[False, False]] * CELLS
