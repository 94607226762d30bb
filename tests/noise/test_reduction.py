"""Samples are reduced alike, however they come and wherever a disturbance lies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.noise import estimate_noise, reduction
from fieldcal.noise.disturbed import CELLS_BESIDE, bridge_disturbances
from fieldcal.noise.reduction import Reduction, reduce_recording

RATE, PIECE = 100.0, 6000
SIZE = 0.01
"""White noise of one sample, m/s^2: N = 0.001 at 100 Hz."""


@pytest.fixture(autouse=True)
def _small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reduction, "ROWS", PIECE)


def at_rest(seed: int = 0, rows: int = 5 * PIECE) -> Block:
    rng = np.random.default_rng(seed)
    acc = SIZE * rng.standard_normal((rows, 3)) + [0.0, -9.81, 0.0]
    return Block.of(np.arange(rows) / RATE, acc, 1e-3 * rng.standard_normal((rows, 3)))


def pushed(first: int, shape: Array) -> Block:
    """At rest, but for a push on ax from a row on."""
    block = at_rest()
    block.acc[first : first + len(shape), 0] += shape
    return block


def in_blocks(block: Block, length: int) -> Reduction:
    return reduce_recording(block[i : i + length] for i in range(0, len(block), length))


def half_sine(rows: int) -> Array:
    wave: Array = 0.5 * np.sin(np.pi * (np.arange(rows) + 0.5) / rows)
    return wave


@pytest.mark.parametrize("first", [PIECE - 1200, PIECE - 150, PIECE - 10, PIECE])
@pytest.mark.parametrize("shape", [half_sine(200), np.full(400, 0.5)])
def test_it_does_not_matter_where_blocks_are_cut(first: int, shape: Array) -> None:
    one, *others = (
        in_blocks(pushed(first, shape), length) for length in (30_000, 997, 4096)
    )
    for other in others:
        assert other.bridged == one.bridged
        for a, b in zip(one.stretches, other.stretches, strict=True):
            assert a.samples == b.samples
            np.testing.assert_array_equal(a.means, b.means)
            np.testing.assert_array_equal(a.squares, b.squares)


@pytest.mark.parametrize(
    "first",
    [
        *(0, PIECE - 115, PIECE - 1),
        *(
            pytest.param(first, marks=pytest.mark.thorough)
            for first in (2000, *range(PIECE - 400, PIECE + 60, 57))
        ),
    ],
)
def test_a_push_anywhere_is_no_noise(first: int) -> None:
    """A part of it in the noise would be a random walk."""
    block = pushed(first, half_sine(200))
    block.acc[:, 1:] = block.gyr[:] = np.nan
    told = estimate_noise([in_blocks(block, 1000)])
    white = told.channels["ax"].processes["N"]
    assert abs(white.value - SIZE / np.sqrt(RATE)) < 4 * white.sigma < 1e-4
    assert "K" not in told.channels["ax"].processes


@pytest.mark.parametrize("rows", [0, 1, 2, 999, PIECE, PIECE + 1, 3 * PIECE - 1])
def test_no_sample_is_lost(rows: int) -> None:
    found = in_blocks(at_rest(rows=rows), 700)
    assert sum(s.samples for s in found.stretches) == (rows if rows > 1 else 0)
    assert found.samples == rows


def test_what_is_not_seen_whole_waits_for_the_next_piece() -> None:
    size = 50  # samples of a cell
    rows = np.column_stack([pushed(5800, half_sine(150)).acc[:PIECE]])
    calm, left = bridge_disturbances(rows, 1 / RATE, 3, last=False)
    assert sum(len(c.rows) for c in calm) + len(left) == len(rows)
    assert not any(c.bridged for c in calm)
    assert len(left) >= (4 + CELLS_BESIDE) * size
    np.testing.assert_array_equal(left, rows[len(rows) - len(left) :])
    calm, none = bridge_disturbances(rows, 1 / RATE, 3, last=True)
    assert not len(none) and sum(c.bridged for c in calm) >= 150


def test_a_device_that_is_never_calm_is_not_held_back_for_ever() -> None:
    rng = np.random.default_rng(1)
    rows = (
        rng.standard_normal((PIECE, 3))
        * (1 + 50 * (np.arange(PIECE) % 97 < 49))[:, None]
    )
    calm, left = bridge_disturbances(rows, 1 / RATE, 3, last=False)
    assert calm and len(left) < PIECE // 2


@pytest.mark.parametrize("share", [0.01, 0.05])
@pytest.mark.parametrize("together", [1, 50])
def test_lost_samples_make_no_noise(share: float, together: int) -> None:
    """White noise is that of a sample times its interval, which is the device's."""
    whole = at_rest()
    begins = np.random.default_rng(2).random(len(whole)) < share / together
    lost = np.convolve(begins, np.ones(together))[: len(whole)] > 0
    kept = Block.of(whole.t[~lost], whole.acc[~lost], whole.gyr[~lost])
    (stretch,) = reduce_recording([kept]).stretches
    assert stretch.dt == pytest.approx(1 / RATE, rel=1e-9)
    assert stretch.samples == len(kept)


@pytest.mark.parametrize("kind", ["bursts", "late", "coarse"])
def test_uneven_times_of_which_none_is_missing_count_as_even(kind: str) -> None:
    whole, rng = at_rest(), np.random.default_rng(3)
    t = {
        "bursts": np.repeat(whole.t[9::10], 10) + np.tile(1e-4 * np.arange(10), 3000),
        "late": np.maximum.accumulate(whole.t + rng.exponential(0.02, len(whole))),
        "coarse": np.floor(whole.t / 0.004) * 0.004 + 1e-6 * np.arange(len(whole)),
    }[kind]
    (stretch,) = reduce_recording([Block.of(t, whole.acc, whole.gyr)]).stretches
    assert stretch.dt == pytest.approx(1 / RATE, rel=2e-3)


@pytest.mark.parametrize("period", [1.0, 2.0, 10.0])
def test_a_slow_device_has_no_gap_behind_each_sample(period: float) -> None:
    block, rng = at_rest(rows=600), np.random.default_rng(4)
    t = period * (np.arange(600) + (np.arange(600) >= 400) * 5)
    t += 0.01 * rng.standard_normal(600)
    found = reduce_recording([Block.of(t, block.acc, block.gyr)])
    assert [s.samples for s in found.stretches] == [400, 200]
    assert found.stretches[0].dt == pytest.approx(period, rel=1e-3)


@pytest.mark.parametrize("length", [30, 600])
def test_blank_samples_are_lost_ones_and_no_silence(length: int) -> None:
    """As what a window has without its disturbances; held values have no noise."""
    block = at_rest()
    for first in range(5000, len(block) - length, 5000):
        block.acc[first : first + length] = block.gyr[first : first + length] = np.nan
    found = reduce_recording([block])
    assert found.samples == np.isfinite(block.acc[:, 0]).sum()
    assert len(found.stretches) == (1 if length < RATE else 6)
    found = replace(found, known=np.arange(6) == 0)
    size = estimate_noise([found]).channels["ax"].processes["N"]
    assert abs(size.value - SIZE / RATE**0.5) < 4 * size.sigma
