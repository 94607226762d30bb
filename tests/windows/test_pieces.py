"""Windows in pieces: what was calm counts, what lay otherwise does not."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from fieldcal.core.errors import Moved
from fieldcal.core.samples import Array, Block, Grain
from fieldcal.windows import PiecedWindow, average
from fieldcal.windows.window import Window

NOISE = np.array([0.02] * 3 + [2e-3] * 3)
AT_REST = np.array([0.1, -9.8, 0.2, 1e-3, -2e-3, 3e-3])


def rest(
    rng: np.random.Generator, start: float, seconds: float, off: Array, hz: float = 100
) -> Block:
    """White noise about where the device lies."""
    t = start + np.arange(round(hz * seconds)) / hz
    six = AT_REST + off + NOISE * rng.standard_normal((len(t), 6))
    return Block.of(t, six[:, :3], six[:, 3:])


def fed(pieces: PiecedWindow, block: Block) -> None:
    for first in range(0, len(block), 40):
        pieces.add(block[first : first + 40])
        if pieces.disturbance:
            return


def gust(rng: np.random.Generator, start: float, seconds: float, push: float) -> Block:
    """Rest, and then a push of 0.8 s."""
    block = rest(rng, start, seconds + 0.8, np.zeros(6))
    block.acc[-80:, 2] += push * np.sin(np.linspace(0, np.pi, 80))
    return block


def in_gusts(seed: int, off: Array | None = None) -> PiecedWindow:
    """Three pieces of 9, 9 and 12 s, the last one off by so much."""
    rng = np.random.default_rng(seed)
    pieces = PiecedWindow(None, Grain())
    for start in (0.0, 12.0):
        fed(pieces, gust(rng, start, 9.0, 0.4))
        moved = pieces.disturbance
        assert moved is not None and start + 8.5 < moved.at < start + 9.9
        pieces.keep_undisturbed(moved)
    fed(pieces, rest(rng, 24.0, 12.0, np.zeros(6) if off is None else off))
    return pieces


@pytest.mark.thorough
def test_pieces_add_up_and_the_error_of_their_mean_holds() -> None:
    pulls = []
    for seed in range(8):
        pieces = in_gusts(seed)
        found = pieces.average()
        if found is not None:
            assert len(pieces.gaps) == 2
            pulls.append((found.mean - AT_REST) / found.sigma)
    assert len(pulls) >= 7, "chance alone gives up what was before"
    spread = float(np.sqrt(np.mean(np.square(pulls))))
    # of 48 numbers: the 2 sigma that 0.15 are of 96
    assert 0.79 < spread < 1.21, spread


def test_what_is_left_out_is_between_the_pieces() -> None:
    pieces = in_gusts(3)
    found = pieces.average()
    assert found is not None
    (first, second) = pieces.gaps
    assert 8.0 < first[0] < 9.4 and first[1] == pytest.approx(12.0)
    assert 20.0 < second[0] < 21.4 and second[1] == pytest.approx(24.0)
    assert found.start == 0.0 and found.end == pytest.approx(35.99)
    clean = sum(b - a for a, b in ((0.0, first[0]), (12.0, second[0]), (24.0, 36.0)))
    assert found.n == pytest.approx(100 * clean, abs=3)
    white = NOISE / np.sqrt(found.n)
    assert (0.6 * white < found.sigma).all() and (found.sigma < 1.8 * white).all()


@pytest.mark.parametrize("channel", [1, 3])
def test_a_device_that_lies_otherwise_afterwards_begins_again(channel: int) -> None:
    """A tilt of a fortieth of a degree, or a bias that jumped: no mean of both."""
    off = np.zeros(6)
    off[channel] = 6 * NOISE[channel] / np.sqrt(900)
    pieces = in_gusts(5, off)
    assert pieces.average() is None and pieces.dropped > 15.0
    assert not pieces.gaps
    found = pieces.average()
    assert found is not None and found.start == pytest.approx(24.0)


def test_what_is_too_short_to_be_judged_is_not_kept() -> None:
    rng = np.random.default_rng(1)
    pieces = PiecedWindow(None, Grain())
    fed(pieces, gust(rng, 0.0, 2.0, 2.0))
    moved = pieces.disturbance
    if moved is None:  # so short a piece may not even show it
        fed(pieces, gust(rng, 2.8, 1.0, 2.0))
        moved = pieces.disturbance
    assert moved is not None and pieces.keep_undisturbed(moved) == 0.0
    fed(pieces, rest(rng, 10.0, 8.0, np.zeros(6)))
    found = pieces.average()
    assert found is not None and found.start == pytest.approx(10.0)
    assert not pieces.gaps and pieces.dropped == 0.0


def test_what_is_no_window_together_is_given_up_and_ends() -> None:
    """The last piece counts once, however often the mean is asked for."""
    off = np.zeros(6)
    off[1] = 40 * NOISE[1] / np.sqrt(900)
    pieces = in_gusts(7, off)
    before = pieces.elapsed
    assert pieces.average() is None
    assert pieces.elapsed < before and pieces.elapsed == pytest.approx(12.0, abs=0.1)
    assert not pieces.is_full(30.0) and pieces.is_full(11.0)
    found = pieces.average()
    assert found is not None and found.n == pytest.approx(1200, abs=2)


@pytest.mark.parametrize("hz", [2.0, 5.0, 7.0, 20.0])
def test_pieces_of_a_slow_device_last_as_long_as_was_asked_for(hz: float) -> None:
    """What is kept of 40 s is what was undisturbed, and the rest of 60 s follows."""
    rng = np.random.default_rng(8)
    pieces, first = PiecedWindow(None, Grain()), rest(rng, 0.0, 40.0, np.zeros(6), hz)
    first.acc[first.t > 36.0, 2] += 0.5
    pieces.add(first)
    moved = pieces.disturbance
    assert moved is not None and 34.0 < moved.at < 38.0
    end = moved.at - max(0.5, moved.seconds)
    kept = pieces.keep_undisturbed(moved)
    assert kept == pytest.approx(end, abs=0.3 + 1 / hz)
    later = rest(rng, 60.0, 60.0 - kept + 2 / hz, np.zeros(6), hz)
    for i in range(len(later) - 4):
        pieces.add(later[i : i + 1])
    assert not pieces.is_full(60.0)
    pieces.add(later[len(later) - 4 :])
    assert pieces.is_full(60.0)
    found = pieces.average()
    assert found is not None and found.n == pytest.approx(60 * hz, abs=2 + hz / 5)


def test_a_piece_of_too_few_samples_to_be_tested_is_not_kept() -> None:
    """Ten seconds of 2 Hz are twenty samples, and show no disturbance."""
    rng = np.random.default_rng(9)
    for seconds, kept in ((10.0, False), (30.0, True)):
        pieces = PiecedWindow(None, Grain())
        pieces.add(rest(rng, 0.0, seconds, np.zeros(6), 2.0))
        assert (pieces.keep_undisturbed(Moved("", seconds, "ax", 1.0)) > 0) is kept
        pieces.add(rest(rng, 60.0, 12.0, np.zeros(6), 2.0))
        assert pieces.is_full(11.0) is not kept


def test_outputs_that_are_missing_do_not_keep_pieces_apart() -> None:
    rng = np.random.default_rng(5)
    pieces = []
    for start, off in ((0.0, 0.0), (30.0, 0.0), (60.0, 0.2)):
        block = rest(rng, start, 20.0, np.full(6, off))
        block.gyr[:] = np.nan
        pieces.append(average(block))
    before, same, other = (cast(Window, mean) for mean in pieces)  # alike in both
    assert PiecedWindow._agree(before, same)
    assert not PiecedWindow._agree(before, other)


def test_what_is_kept_is_tested_again_from_its_beginning() -> None:
    """A push at 20 s, of which nobody knew when another one ended it at 30 s."""
    rng = np.random.default_rng(2)
    pieces, block = PiecedWindow(None, Grain()), rest(rng, 0.0, 32.0, np.zeros(6))
    block.acc[2000:2080, 2] += 0.4 * np.sin(np.linspace(0, np.pi, 80))
    pieces.add(block)
    kept = pieces.keep_undisturbed(Moved("", 30.0, "az", 0.1))
    assert 18.0 < kept < 20.0
    pieces.add(rest(rng, 40.0, 12.0, np.zeros(6)))
    assert pieces.average() is not None
    ((end, start),) = pieces.gaps
    assert end < 20.0 and start == pytest.approx(40.0)


def test_noise_is_learned_from_each_piece_and_a_stated_step_counts_in_all() -> None:
    rng, grain = np.random.default_rng(2), Grain(0.3, 0.02)
    block = rest(rng, 0.0, 12.0, np.zeros(6))
    for piece, step in ((block, Grain()), (rest(rng, 30.0, 12.0, np.zeros(6)), grain)):
        pieces = PiecedWindow(None, step)
        pieces.add(block)
        window = Window(None, None, step)
        window.add(block)
        window.truncate(10.0)
        learned = window.noise
        pieces.keep_undisturbed(Moved("", 11.0, "ax", 1.0))
        begun = pieces._now._before  # the next piece begins with it
        assert begun is not None and learned is not None
        assert learned.shape_likelihood.any()
        np.testing.assert_array_equal(begun.shape_likelihood, learned.shape_likelihood)
        pieces.add(piece if piece is not block else rest(rng, 30.0, 12.0, np.zeros(6)))
        found = pieces.average()
        assert found is not None
        white = NOISE / np.sqrt(found.n)
        ratio = (found.sigma / white).min()
        # values within a step of 15 and 10 times the noise say little of where it is
        assert ratio > 10 if step is grain else ratio < 2


def test_all_pieces_together_are_good_enough_if_they_are_at_rest() -> None:
    """By the error of both; by a test of both as one window."""
    pieces = in_gusts(3)
    sigma = float(np.nanmax(pieces.sigma[:3]))
    assert pieces.reason_to_stop(None) is None
    assert pieces.reason_to_stop(0.9 * sigma) is None
    whole = pieces.average()
    assert whole is not None
    one = PiecedWindow(None, Grain())
    one.add(rest(np.random.default_rng(3), 0.0, 30.0, np.zeros(6)))
    assert one.reason_to_stop(1.1 * float(np.nanmax(one.sigma[:3]))) is not None
    assert pieces.reason_to_stop(1.1 * sigma) is not None
