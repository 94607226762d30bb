"""The integral of the outputs, held against a high-pass filter and known courses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.passed_outputs import PassedOutputs

T = np.arange(0.0, 120.0, 0.01)
NOMINAL = {"acc_scale": np.array([-2.0, 2.1, 1.9]), "gyr_scale": np.ones(3)}


def stairs() -> Array:
    """Outputs, (n, 6), that change every half minute, with a ramp between."""
    levels = np.array([[9.8, 0, 0], [0, 9.8, 0], [-6, 0, 7.5], [0, 0, -9.8], [1, 2, 3]])
    course = np.column_stack(
        [np.interp(T % 30.0, [0.0, 27.0, 30.0], [0.0, 0.0, 1.0]) for _ in range(3)]
    )
    at = (T // 30.0).astype(int)
    acc = levels[at] + course * (levels[at + 1] - levels[at])
    return np.hstack([acc, 0.01 * acc[:, ::-1]])


def block_of(six: Array) -> Block:
    return Block.of(T + 5.0, six[:, :3], six[:, 3:])


@pytest.mark.parametrize("tau", [3.0, 40.0, 4e3])
def test_it_is_what_a_high_pass_takes_away(tau: float) -> None:
    """For any time constant, also one that is short beside the recording."""
    kept = np.exp(-0.01 / tau)
    plain = stairs()
    begin = (1 - kept) * plain[:1]
    y, _ = lfilter([kept, -kept], [1.0, -kept], plain, axis=0, zi=begin)
    passed = PassedOutputs.of(block_of(y), NOMINAL)
    scale = np.array([2.0, 2.0, 2.0, 1.0, 1.0, 1.0])
    restored = y + passed.at(T + 5.0) * scale / tau
    error = np.abs(restored - plain).max()
    assert error < 0.1 / tau, "a sample's interval times 9.8 m/s^2, of 1200 m/s"


def test_a_mean_over_a_row_at_rest() -> None:
    six = np.tile([2.0, 0.0, -4.0, 0.1, 0.0, 0.0], (len(T), 1))
    passed = PassedOutputs.of(block_of(six), NOMINAL)
    row = passed.mean(np.array([35.0]), np.array([20.0]))[0]
    # over 2 outputs per m/s^2, 30 s after the start
    np.testing.assert_allclose(row, [30.0, 0.0, -60.0, 3.0, 0.0, 0.0], atol=1e-9)


def test_what_is_missing_keeps_its_value() -> None:
    six = np.ones((len(T), 6))
    whole = PassedOutputs.of(block_of(six), NOMINAL)
    six[500:900, 2] = np.nan
    holed = PassedOutputs.of(block_of(six), NOMINAL)
    np.testing.assert_allclose(holed.values, whole.values)
    never = replace(block_of(six), gyr=np.full((len(T), 3), np.nan))
    assert not PassedOutputs.of(never, NOMINAL).values[:, 3:].any()
