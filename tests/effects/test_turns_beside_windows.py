"""Turns that tell the unit of the rates: those that lie between the windows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.effects.mounting import measured_turns

RATE, WINDOW_S, GAP_S = 10.0, 300.0, 5.0
UP, ASIDE = np.array([0.0, 0.0, 9.8]), np.array([0.0, 9.8, 0.0])


def turns_told(rates: Array) -> int:
    """Number of turns between two windows of 300 s, by rates about x (n,) rad/s."""
    t = np.arange(len(rates)) / RATE
    gyr = rates[:, None] * [1.0, 0.0, 0.0]
    windows = np.array([[0, int(WINDOW_S * RATE)],
                        [int((WINDOW_S + GAP_S) * RATE), len(t)]])  # fmt: skip
    block = Block.of(t, np.zeros((len(t), 3)), gyr)
    recording = SimpleNamespace(
        block=block,
        windows=windows,
        scale=np.ones(6),
        mean=lambda p: block.six[slice(*windows[p])].mean(axis=0),
    )
    return len(measured_turns(cast(Any, recording), [0, 1], np.array([UP, ASIDE])))


def at_rest_with_a_turn_between() -> Array:
    """A quarter of a turn in the five seconds between the windows."""
    t = np.arange(int((2 * WINDOW_S + GAP_S) * RATE)) / RATE
    between = (t >= WINDOW_S) & (t < WINDOW_S + GAP_S)
    return np.where(between, np.pi / 2 / GAP_S, 0.0)


def test_a_bias_that_changes_far_from_the_turn_does_not_hide_it() -> None:
    """It adds up to 3 rad in the last 100 s of a window, and to 0.9 rad in 30 s."""
    rates = at_rest_with_a_turn_between()
    assert turns_told(rates) == 1
    rates[2000:3000] += 0.03
    assert turns_told(rates) == 1


def test_a_turn_twenty_seconds_inside_a_window_is_seen() -> None:
    """What lies between the windows is then a remnant of it."""
    rates = 0.3 * at_rest_with_a_turn_between()
    rates[2800:2830] = np.pi / 2 / 3.0
    assert turns_told(rates) == 0
