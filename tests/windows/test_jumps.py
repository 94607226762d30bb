"""Recordings of rests alone, told by how rows go from one position to the next."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laid_about import G, turned, write

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block
from fieldcal.session.folder import Session
from fieldcal.windows import jumps as jump_module
from fieldcal.windows.jumps import JumpFinder

HZ, NOISE = 50.0, 0.012


def rests(seed: int, lengths: list[int], wild: float = 0.0) -> Array:
    """Rows (n, 3) of a device laid down so often, for so many rows, with wild rows."""
    rng = np.random.default_rng(seed)
    up = rng.normal(size=(len(lengths), 3))
    up *= G / np.linalg.norm(up, axis=1, keepdims=True)
    acc = np.repeat(up, lengths, axis=0) + [0.3, -0.2, 0.4]
    acc += rng.normal(0, NOISE, acc.shape)
    hit = rng.random(len(acc)) < wild
    acc[hit, 1] += 0.15 * rng.choice([-1, 1], hit.sum())
    return acc


def found(acc: Array, cut: int = 10**9) -> list[tuple[float, float]]:
    """Positions of rows that come in blocks of so many."""
    jumps, t = JumpFinder(), np.arange(len(acc)) / HZ
    for first in range(0, len(acc), cut):
        some = slice(first, first + cut)
        jumps.add(Block.of(t[some], acc[some]))
    return jumps.positions


@pytest.mark.parametrize("seed", range(9))
def test_every_rest_is_a_position_from_its_first_row_to_its_last(seed: int) -> None:
    lengths = np.random.default_rng(seed).integers(20, 200, 30).tolist()
    ends = np.cumsum(lengths)
    spans = np.column_stack([ends - lengths, ends - 1]) / HZ
    np.testing.assert_allclose(found(rests(seed, lengths)), spans)
    # a wild row now and then is none that was laid down for itself
    # one beside a jump does not move it
    near = found(rests(seed, lengths, wild=0.01))
    np.testing.assert_allclose(near, spans)


@settings(max_examples=15, deadline=None)
@given(cut=st.integers(1, 300), seed=st.integers(0, 50))
def test_it_is_no_matter_how_the_rows_are_cut(cut: int, seed: int) -> None:
    acc = rests(seed, [60, 33, 100, 45])
    # what a row's noise is, the first block tells
    first = 50
    jumps, t = JumpFinder(), np.arange(len(acc)) / HZ
    jumps.add(Block.of(t[:first], acc[:first]))
    for a in range(first, len(acc), cut):
        jumps.add(Block.of(t[a : a + cut], acc[a : a + cut]))
    assert jumps.positions == found(acc)


def test_what_was_recorded_while_it_turned_is_no_such_recording() -> None:
    assert found(turned(3, HZ)[:, 1:4]) == []
    angle = np.deg2rad(0.85 * np.arange(2000))
    noise = np.random.default_rng(1).normal(0, NOISE, (2000, 3))
    slow = G * np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)]) + noise
    assert found(slow) == []
    assert found(noise + [0, 0, G]) == [] and found(slow[:6]) == []
    # two positions are too few to tell it from a device that was knocked over
    assert found(rests(4, [100, 100])) == []
    # a coarse output flips between two steps
    coarse = np.round((noise + [0.1, 0.2, G]) / 0.04) * 0.04
    assert found(coarse) == []


def test_a_position_ends_with_its_last_row_whatever_the_rate_of_the_others() -> None:
    """Rows of the later rests are three times as far apart."""
    lengths, jumps = [50, 40, 70, 60], JumpFinder()
    t = np.cumsum(np.repeat([0.02, 0.06], [91, 129]))
    jumps.add(Block.of(t, rests(3, lengths)))
    last = np.cumsum(lengths) - 1
    ends = [end for _, end in jumps.positions]
    np.testing.assert_allclose(ends, t[last], atol=2e-3)


@pytest.mark.parametrize("dead", [False, True])
def test_who_walks_about_rests_nowhere(dead: bool) -> None:
    """Nor does who has an axis that gives the same number all the time."""
    for seed in (2, 4, 5, 6):
        rng = np.random.default_rng(seed)
        beat = np.outer(np.arange(270), [0.42, 0.84, 0.63]) + [0, 1, 2]
        walk = [0, G, 0] + 3.4 * np.sin(beat) + rng.normal(0, 2.0, (270, 3))
        rest = np.repeat([[-1.0, 9.6, -1.3], [2.7, 9.4, -0.3]], [60, 120], axis=0)
        rest += rng.normal(0, 5 * NOISE, rest.shape)
        acc = np.vstack([rest[:60], walk, rest[60:]])
        acc[:, 2] = -1.0 if dead else acc[:, 2]
        assert found(acc) == []


def test_coarse_rows_of_which_some_stay_and_others_flicker_rest_alike() -> None:
    acc = np.round(rests(1, [80, 60, 90]) / 0.15) * 0.15
    acc[:80] = acc[40]
    assert len(found(acc)) == 3


def apart_by(some: Array) -> Array:
    """Four rests of 60 rows, the same every time, and some rows (m, 3) between two."""
    held = np.split(rests(8, [60] * 4), 4)
    parts = [held[0]]
    for one in held[1:]:
        parts += [parts[-1][-1] + some, one]
    return np.vstack(parts)


def test_a_jump_may_have_a_wild_row_beside_it_and_no_turn_of_rows() -> None:
    """A row in the middle is one; a turn of three rows was recorded, if a quick one."""
    assert len(found(apart_by(np.full((1, 3), 30.0)))) == 4
    held = np.split(rests(8, [60] * 4), 4)
    way = np.linspace(0, 1, 5)[1:4, None]
    parts = [held[0]]
    for one in held[1:]:
        parts += [parts[-1][-1] + way * (one[0] - parts[-1][-1]), one]
    assert found(np.vstack(parts)) == []


def test_what_is_no_rest_for_a_few_rows_is_no_position_and_no_harm() -> None:
    """While it was carried: eighteen rows that drift by the noise of a row each."""
    drift = 1.0 + NOISE * np.arange(18)[:, None] * np.ones(3)
    spans = found(apart_by(drift))
    starts = np.arange(4) * (60 + 18) / HZ
    np.testing.assert_allclose([start for start, _ in spans], starts, atol=1.5 / HZ)


@pytest.mark.parametrize(("times", "count"), [(3.5, 4), (8.0, 0)])
def test_rests_have_about_the_same_noise(times: float, count: int) -> None:
    """Where the noisiest is what the noise of a row is told from."""
    acc = rests(2, [60, 50, 70, 60])
    acc[:60] = acc[:60].mean(axis=0) + times * (acc[:60] - acc[:60].mean(axis=0))
    assert len(found(acc, 60)) == count


def test_one_axis_may_be_coarser_than_the_others() -> None:
    """Its steps are as large as its resolution, and those of rests alone no jumps."""
    lengths = [80, 60, 90, 70]
    acc, rng = rests(3, lengths), np.random.default_rng(1)
    flips = rng.random(len(acc)) < 0.3
    acc[:, 2] = np.round(acc[:, 2]) + 0.5 * flips
    ends = np.cumsum(lengths)
    spans = np.column_stack([ends - lengths, ends - 1]) / HZ
    np.testing.assert_allclose(found(acc), spans)


def test_rows_that_are_missing_are_no_jumps() -> None:
    acc = rests(6, [50, 70, 40, 60])
    holed = acc.copy()
    holed[60:63, 1] = np.nan
    with warnings.catch_warnings(action="error"):
        for cut in (1, 7, 10**9):
            assert found(np.full((90, 3), np.nan), cut) == []
            assert len(found(holed, cut)) == 4
            assert found(acc[:1], cut) == []
        turns = acc.copy()
        turns[np.arange(len(acc)), np.arange(len(acc)) % 3] = np.nan
        assert found(turns) == []  # no row has all three axes


def test_a_log_of_rests_without_times_needs_no_more_than_its_rate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    acc = rests(5, [60] * 8) / G
    path = write(tmp_path, acc, heading="ax,ay,az")
    assert main(["import", str(path), "-o", str(tmp_path / "s"), "--rate", "100"]) == 0
    said = capsys.readouterr().err
    assert "only its rests were recorded" in said
    assert "8 still stretches\n" in said  # of 0.6 s
    assert "8 of 8 last less than 1 s, too short for their means to have an err" in said
    assert "or import a table of their means with --sigma 0.005,0.0005" in said
    made = Session.open(tmp_path / "s")
    assert len(made.about.positions) == 8
    # with times of their own the pauses between the rests would show
    timed = np.column_stack([np.arange(len(acc)) / 100, acc])
    path = write(tmp_path, timed, "timed.csv", "t (s),ax,ay,az")
    assert main(["import", str(path), "-o", str(tmp_path / "timed")]) == 0
    assert "only its rests" not in capsys.readouterr().err


def test_rests_of_less_than_a_second_are_told_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, turned(3, 200.0, 0.5), heading="t,ax,ay,az,gx,gy,gz")
    call = ["import", str(path), "-o", str(tmp_path / "s"), "--still", "0.3"]
    assert main(call) == 0
    said = capsys.readouterr().err
    assert "0 still stretches of 1 s or more" in said
    assert "hold each for 3 s or more, or import a table of their means with" in said


def test_a_position_in_which_it_was_nudged_is_two(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # by 1.2 deg within a second, so by less than eight times the noise in five rows
    acc = rests(5, [90] * 8)
    angle = np.deg2rad(1.2) * np.clip((np.arange(90) - 36) / 20, 0, 1)
    held = acc[270:360]
    across = np.cross(held.mean(axis=0), [0.0, 0.0, 1.0])
    across *= G / np.linalg.norm(across)
    held += angle[:, None] * across
    path = write(tmp_path, acc, heading="ax,ay,az")
    call = ["import", str(path), "-o", str(tmp_path / "s"), "--gravity", str(G)]
    assert main([*call, "--rate", "20"]) == 0
    assert "1 of them is cut where it was moved" in capsys.readouterr().err
    parts = [p for p in Session.open(tmp_path / "s").about.windows if p is not None]
    assert len(parts) == 9
    began, ended = 13.5 + 36 / 20, 13.5 + 56 / 20
    assert began - 0.5 < parts[3][1] <= parts[4][0] < ended + 0.5


def test_the_noise_of_a_row_is_that_of_its_steps_and_at_least_a_step() -> None:
    """The least step that is one; without any, the noise is none."""
    deviation = np.random.default_rng(3).normal(0, [0.1, 0.2, 0.3], (40_001, 3))
    white = np.abs(np.diff(deviation, axis=0))
    np.testing.assert_allclose(jump_module._noise(white), [0.1, 0.2, 0.3], rtol=0.03)
    coarse = np.array([[0.0, 0.4, 0.0], [0.5, 0.0, 0.0], [1.5, 0.0, 0.0], [0, 0.2, 0]])
    np.testing.assert_array_equal(jump_module._least_jump(coarse), [0.5, 0.2, np.inf])
    # medians: a quarter, a tenth and nothing
    usual = np.array([0.25, 0.1, 0.0]) * 1.4826 / np.sqrt(2)
    least = np.maximum(usual, [0.5, 0.2, 0.0])
    np.testing.assert_allclose(jump_module._noise(coarse), least, rtol=1e-4)
    assert np.isnan(jump_module._noise(coarse[:0])).all()
