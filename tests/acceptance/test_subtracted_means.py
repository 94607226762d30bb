"""Means that a device subtracts are found in its outputs, sample by sample."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.acceptance.rest_steps import RestStep, noise_of_samples, stops_at_rest
from fieldcal.acceptance.subtracted_means import PARTS, WAYS, steps_before_means
from fieldcal.core.samples import Array, Block

RATE, HELD, AWAY = 100.0, 20, 8
AXES = np.arange(3)
COUNT, PAUSE = int(HELD * RATE), int(AWAY * RATE)


def recording(delay: float, time: float) -> tuple[list[Block], Block, Array]:
    """Four windows with a turn before each; the outputs, and the rates before.

    The device begins its mean so long after the turn, which ends 2 s before a window.
    """
    rng = np.random.default_rng(3)
    total = 4 * (COUNT + PAUSE)
    before = 5e-4 + 1e-5 * rng.standard_normal((total, 3))
    outputs, subtracted = before.copy(), np.zeros(3)
    for k in range(4):
        start = k * (COUNT + PAUSE)
        before[start : start + PAUSE - 200] += 0.3
        end = start + COUNT + PAUSE
        outputs[start:end] = before[start:end] - subtracted
        if k:
            first = start + PAUSE - 200 + round(delay * RATE)
            last = first + round(time * RATE)
            subtracted = before[first:last].mean(axis=0)
            outputs[last:end] = before[last:end] - subtracted
    block = Block.of(np.arange(total) / RATE, np.zeros((total, 3)), outputs)
    spans = [(k * (COUNT + PAUSE) + PAUSE, (k + 1) * (COUNT + PAUSE)) for k in range(4)]
    return [block[a:b] for a, b in spans], block, before


def by_window(steps: list[RestStep]) -> list[list[RestStep]]:
    """The parts of each window."""
    parts = [step for step in steps if step.rates.ndim == 2]
    return [parts[k : k + PARTS + 1] for k in range(0, len(parts), PARTS + 1)]


@pytest.mark.parametrize(("delay", "time"), [(0.0, 1.0), (0.5, 4.0), (1.0, 8.0)])
def test_the_rates_before_are_those_without_a_subtraction(
    delay: float, time: float
) -> None:
    held, block, before = recording(delay, time)
    way = int(np.argmin(np.abs(WAYS - [delay, delay + time]).sum(axis=1)))
    np.testing.assert_allclose(WAYS[way], [delay, delay + time])
    stops = stops_at_rest(held, block, noise_of_samples(held, AXES))
    outputs, raw = steps_before_means(stops, block, AXES)
    assert sum(step.turned for step in raw) == 3
    for window, steps in zip(held, by_window(raw), strict=True):
        span = before[np.searchsorted(block.t, window.t)]
        lengths = [np.broadcast_to(s.seconds, (len(WAYS), 1))[way, 0] for s in steps]
        rates = np.array([np.nan_to_num(s.rates[way]) for s in steps])
        assert sum(lengths) == pytest.approx(HELD, abs=0.02)
        mean = np.average(rates, axis=0, weights=lengths)
        np.testing.assert_allclose(mean, span.mean(axis=0), atol=1e-7)
    # the last of them differ from the outputs by all that was subtracted
    assert np.abs(outputs[-1].rates[way]).max() < 1e-5
    np.testing.assert_allclose(raw[-1].rates[way], 5e-4, atol=1e-5)


def test_a_mean_that_was_not_recorded_is_none() -> None:
    held, block, _ = recording(0.0, 1.0)
    kept = np.any([(block.t >= w.t[0]) & (block.t <= w.t[-1]) for w in held], axis=0)
    block.gyr[~kept] = np.nan
    stops = stops_at_rest(held, block, noise_of_samples(held, AXES))
    assert [stop.settled for stop in stops] == [0.0] * 4
    block.gyr[:] = np.nan
    for one, other in zip(*steps_before_means(stops, block, AXES), strict=True):
        np.testing.assert_array_equal(one.rates, other.rates)


def test_a_window_shorter_than_the_mean_ends_before_it() -> None:
    held, block, _ = recording(0.0, 1.0)
    short = [one[:100] for one in held]
    stops = stops_at_rest(short, block, noise_of_samples(short, AXES))
    outputs, raw = steps_before_means(stops, block, AXES)
    way = int(np.argmax(WAYS[:, 1]))  # 9 s, of a stop of 22 s
    for steps in by_window(raw):  # one part, all of it before the cut
        assert [np.isfinite(s.rates[way]).all() for s in steps] == [True] + [False] * 4
    assert len(outputs) == len(raw)


def test_a_lost_sample_changes_a_mean_by_little() -> None:
    held, block, before = recording(0.0, 1.0)
    block.gyr[np.searchsorted(block.t, held[2].t[0]) - 150] = np.nan
    stops = stops_at_rest(held, block, noise_of_samples(held, AXES))
    _, raw = steps_before_means(stops, block, AXES)
    way = int(np.argmin(np.abs(WAYS - [0.0, 1.0]).sum(axis=1)))
    last = by_window(raw)[3][-1].rates[way]
    np.testing.assert_allclose(last, before[-400:].mean(axis=0), atol=2e-6)
