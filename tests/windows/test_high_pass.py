"""Outputs that decay toward zero at rest, and those that go elsewhere or stay."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fieldcal.core.samples import Array, Block
from fieldcal.windows.high_pass import decay_time_constant

RATE, HOLD, WAY = 50.0, 20.0, 5.0
FACES = np.array([[0, 0, 9.8], [0, 9.8, 0], [-9.8, 0, 0], [0, -7.0, 7.0], [0, 0, -9.8]])
WINDOWS = [(i * (HOLD + WAY) + 1.0, i * (HOLD + WAY) + HOLD) for i in range(len(FACES))]


def held(seed: int = 0) -> Array:
    """Accelerations (n, 3) of a device that is turned from face to face."""
    t = np.arange(0.0, len(FACES) * (HOLD + WAY), 1 / RATE)
    edges = np.ravel([[i * (HOLD + WAY), i * (HOLD + WAY) + HOLD] for i in range(5)])
    force = np.column_stack(
        [np.interp(t, edges, np.repeat(FACES[:, c], 2)) for c in range(3)]
    )
    return force + np.random.default_rng(seed).normal(0, 0.02, force.shape) + 0.05


def block_of(acc: Array) -> Block:
    return Block.of(np.arange(len(acc)) / RATE, acc)


def passed(acc: Array, tau: float) -> Array:
    kept = np.exp(-1 / RATE / tau)
    begin = (1 - kept) * acc[:1]
    out, _ = lfilter([kept, -kept], [1.0, -kept], acc, axis=0, zi=begin)
    return np.asarray(out)


@pytest.mark.parametrize("tau", [3.0, 10.0, 40.0, 120.0])
def test_the_time_constant_of_a_filter(tau: float) -> None:
    found = decay_time_constant(block_of(passed(held(), tau)), WINDOWS)
    assert found == pytest.approx(tau, rel=0.02)


def test_a_slow_filter_is_left_to_the_model() -> None:
    assert decay_time_constant(block_of(passed(held(), 1000.0)), WINDOWS) is None


def test_what_stays_or_settles_is_no_filter() -> None:
    acc = held()
    assert decay_time_constant(block_of(acc), WINDOWS) is None
    since = np.arange(len(acc)) / RATE % (HOLD + WAY)
    settling = acc + np.exp(-since / 6.0)[:, None] * [0.5, -0.3, 0.4]
    assert decay_time_constant(block_of(settling), WINDOWS) is None
    drifting = acc * (1 - 1e-3 * np.arange(len(acc))[:, None] / RATE)
    assert decay_time_constant(block_of(drifting), WINDOWS) is None


def test_too_little_to_tell() -> None:
    block = block_of(passed(held(), 10.0))
    assert decay_time_constant(block, []) is None
    assert decay_time_constant(block, [None, (0.0, 0.5), (1.0, 1.2)]) is None
    block.acc[:] = np.nan
    assert decay_time_constant(block, WINDOWS) is None
