"""Rows that a program wrote several times, and rows that came together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned, write

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.times.repeats import RepeatFinder, distinct_rows
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.session.folder import Session

RATE = 25.0
ROWS = turned(4, RATE, 1.5)
HEADING = "t (s),ax,ay,az,gx (rad/s),gy (rad/s),gz (rad/s)"


def brought(folder: Path, rows: Array, heading: str = HEADING) -> Block:
    return read_files([write(folder, rows, heading=heading)])[0]


def test_a_session_of_rows_that_were_written_twice_has_each_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, np.repeat(ROWS, 2, axis=0), heading=HEADING)
    assert main(["import", str(path), "-o", str(tmp_path / "s")]) == 0
    block = Session.open(tmp_path / "s").block
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-9)
    said = capsys.readouterr().err
    assert "line 3: repeats the row above, time and values" in said
    assert "left out" not in said and "25 Hz" in said


@pytest.mark.parametrize("times", [2, 3])
@pytest.mark.parametrize("heading", [HEADING, "time,ax,ay,az,gx,gy,gz"])
def test_rows_that_were_written_several_times_are_taken_once(
    tmp_path: Path, times: int, heading: str
) -> None:
    block = brought(tmp_path, np.repeat(ROWS, times, axis=0), heading)
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-9)
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-9)


def test_columns_that_are_not_used_make_no_row_another(tmp_path: Path) -> None:
    """A time of arrival beside the device's, as of a log over two links."""
    twice = np.repeat(ROWS, 2, axis=0)
    arrived = 100 + np.arange(len(twice)) / (2 * RATE)
    heading = "arrival," + HEADING
    block = brought(tmp_path, np.column_stack([arrived, twice]), heading)
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-9)


@pytest.mark.parametrize("heading", [HEADING, "time,ax,ay,az,gx,gy,gz"])
def test_a_counter_of_the_rows_as_written_makes_no_row_another(
    tmp_path: Path, heading: str
) -> None:
    twice = np.repeat(ROWS, 2, axis=0)
    rows = np.column_stack([twice, np.arange(len(twice))])
    block = brought(tmp_path, rows, heading + ",seq")
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-9)
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-9)
    np.testing.assert_array_equal(np.diff(block.seq), 1)  # none is missing


@pytest.mark.parametrize("size", [1, 7, 50])
def test_a_counter_goes_on_behind_rows_that_were_written_again(size: int) -> None:
    t = np.repeat(np.arange(20.0), [1, 2, 3, 1] * 5)
    seq = np.arange(len(t)) + 5.0 * (t >= 9)
    whole = replace(Block.of(t, np.tile(t + 1, (3, 1)).T), seq=seq)
    judge = RowValidator("log", str, repair=False)
    pieces = (whole[i : i + size] for i in range(0, len(t), size))
    found = concat(judge.through(pieces)).seq
    np.testing.assert_array_equal(np.diff(found), 1 + 5.0 * (np.arange(19) == 8))


def test_a_few_rows_that_are_there_twice_need_no_repair(tmp_path: Path) -> None:
    rows = np.insert(ROWS, [200, 300], ROWS[[199, 299]], axis=0)
    block, says = read_files([write(tmp_path, rows, heading=HEADING)])
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-9)
    assert says[-1].startswith("line 202: repeats the row above")
    assert "(2 such rows)" in says[-1]


def test_rows_of_one_time_with_values_of_their_own_are_spread(tmp_path: Path) -> None:
    """A batch of a device that repeats a value by chance is no row written twice."""
    batched = ROWS.copy()
    batched[:, 0] = np.arange(len(ROWS)) // 10 * 10 / RATE
    batched[201] = batched[200]
    block = brought(tmp_path, batched)
    np.testing.assert_allclose(np.diff(block.t), 1 / RATE, atol=1e-6)
    assert len(block) == len(ROWS)


def test_a_clock_of_whole_seconds_hides_no_rows_that_were_written_twice(
    tmp_path: Path,
) -> None:
    coarse = ROWS.copy()
    coarse[:, 0] = np.floor(ROWS[:, 0] + 1e-9)
    block = brought(tmp_path, np.repeat(coarse, 2, axis=0))
    np.testing.assert_allclose(np.diff(block.t), 1 / RATE, atol=1e-6)
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-9)


@given(st.lists(st.integers(0, 12), min_size=1, max_size=4))
def test_a_repeat_is_found_wherever_a_piece_ends(cuts: list[int]) -> None:
    x = np.repeat(np.arange(4.0), 3)
    finder, edges = RepeatFinder(), [0, *sorted(cuts), len(x)]
    parts = [finder.of([x[a:b]]) for a, b in zip(edges, edges[1:], strict=False)]
    np.testing.assert_array_equal(np.concatenate(parts), np.arange(12) % 3 > 0)


@given(
    st.lists(st.integers(1, 3), min_size=2, max_size=30),
    st.lists(st.integers(0, 60), max_size=4),
)
def test_it_is_no_matter_where_blocks_end(many: list[int], cuts: list[int]) -> None:
    n = len(many)
    force = np.column_stack([np.arange(n), np.zeros(n), np.full(n, 9.8)])
    once = Block.of(np.arange(n) / 10.0, force)
    whole = once[np.repeat(np.arange(n), many)]
    edges = [0, *sorted(min(cut, len(whole)) for cut in cuts), len(whole)]
    parts = [whole[a:b] for a, b in zip(edges, edges[1:], strict=False)]
    judge = RowValidator("x", lambda row: f"row {row}", repair=False)
    np.testing.assert_array_equal(concat(judge.through(parts)).t, once.t)
    assert len(judge.says) == (sum(many) > n)
    assert distinct_rows(whole.six, whole.t).sum() == n
