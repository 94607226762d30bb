"""Decays of outputs whose steps hide their noise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from smoothed_outputs import held, smoothed

from fieldcal.windows.decays import rounded_at_random, share_by_decays

STEP = np.full(3, 0.01)


def test_steps_that_hide_the_noise_leave_the_decays() -> None:
    pulls = []
    for seed in range(12):
        x, windows = held(seed, noise=1e-3)
        y = np.round(smoothed(x, math.exp(-1 / 90)), 2)
        one = share_by_decays([y[a:b] for a, b in windows], STEP)
        assert one is not None and one.samples_sigma < 5
        pulls.append((one.samples - 90) / one.samples_sigma)
    assert abs(np.mean(pulls)) < 1.5
    assert np.std(pulls) < 2.5


@pytest.mark.parametrize("power", [1, 2, 3])
def test_a_way_to_rest_that_ends_is_no_decay(power: int) -> None:
    n = np.arange(2000.0)
    left = np.clip(1 - n / 150, 0, None) ** power
    y = np.round(left[:, None] * [5.0, -3.0, 2.0], 2)
    assert share_by_decays([y] * 4, STEP) is None


def test_decays_of_several_time_constants_say_none() -> None:
    n = np.arange(2000.0)[:, None]
    rests = [np.round(4 * np.exp(-n / [20, 55, 130]) + i, 2) for i in range(4)]
    assert share_by_decays(rests, STEP) is None
    alike = [np.round(4 * np.exp(-n / [55, 55, 55]) + i, 2) for i in range(4)]
    one = share_by_decays(alike, STEP)
    assert one is not None and one.samples == pytest.approx(55, rel=0.02)


def test_noise_of_a_step_or_more_is_rounded_at_random() -> None:
    rng = np.random.default_rng(1)
    y = np.round(rng.normal(0, [0.001, 0.01, 0.1], (500, 3)), 2)
    assert rounded_at_random(y, STEP).tolist() == [False, True, True]
    slow = np.round(np.cumsum(rng.normal(0, 0.001, (500, 3)), axis=0), 2)
    assert not rounded_at_random(slow, STEP).any()
