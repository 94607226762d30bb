"""Outputs from which somebody took the mean, and outputs that are merely small."""

from __future__ import annotations

import numpy as np

from fieldcal.acceptance.centred import biases_taken_out, centred, tracked
from fieldcal.core.samples import Block
from fieldcal.windows import Average

SIGMA = 1e-5
COUNT = 3000


def windows(rng: np.random.Generator, size: float, bias: float = 0.0) -> list[Average]:
    """Six windows whose gyroscopes are off by some part of their standard error."""
    return [
        Average(
            np.concatenate([np.zeros(3), bias + size * SIGMA * rng.standard_normal(3)]),
            np.eye(6) * SIGMA**2,
            21.0,
            COUNT,
            0.0,
            30.0,
        )
        for _ in range(6)
    ]


def recording(rng: np.random.Generator, mean: float) -> Block:
    acc = mean + rng.standard_normal((COUNT, 3))
    return Block.of(np.arange(COUNT) / 100.0, acc, np.zeros((COUNT, 3)))


def test_a_bias_that_is_exactly_zero_is_no_bias_taken_out() -> None:
    rng = np.random.default_rng(1)
    chances = [tracked(windows(rng, 1.0))[0] for _ in range(400)]
    # uniform, as a probability of what chance makes is
    assert 0.4 < np.mean(chances) < 0.6 and min(chances) > 1e-4
    assert 0.02 < np.mean(np.array(chances) < 0.1) < 0.2
    assert tracked(windows(rng, 1.0, bias=1e-3))[0] > 0.999


def test_a_bias_that_is_tracked_leaves_less_than_noise() -> None:
    rng = np.random.default_rng(2)
    found = [tracked(windows(rng, 0.2)) for _ in range(50)]
    assert max(chance for chance, _ in found) < 1e-4
    assert "18 means" in found[0][1]
    assert tracked(windows(rng, 0.2)[:2]) == (1.0, "")


def test_a_recording_without_its_mean() -> None:
    rng = np.random.default_rng(3)
    chances = [p for _ in range(200) for _, p in centred(recording(rng, 0.0))]
    assert 0.4 < np.mean(chances) < 0.6 and np.mean(np.array(chances) < 1e-2) < 0.04
    block = recording(rng, 5.0)
    assert all(p == 1.0 for _, p in centred(block))
    block.acc[:] -= block.acc.mean(axis=0)
    assert [name for name, p in centred(block) if p < 1e-9] == ["ax", "ay", "az"]


def test_both_are_told_apart_and_said() -> None:
    rng = np.random.default_rng(4)
    sound, block = windows(rng, 1.0, bias=1e-3), recording(rng, 5.0)
    assert biases_taken_out(sound, block, 1e-4) == []
    (said,) = biases_taken_out(windows(rng, 0.1), block, 1e-4)
    assert "takes its bias out while it rests" in said
    block.acc[:, 1] -= block.acc[:, 1].mean()
    (said,) = biases_taken_out(sound, block, 1e-4)
    assert "is zero in ay, closer" in said
