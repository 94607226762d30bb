"""Timers of devices that count down, or up to the end of a number with a sign."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned, write

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.times.row_times import RowTimes
from fieldcal.session.folder import Session

ROWS = turned(11, 50.0, 2.0)
LEFT = np.column_stack([np.round(90 - ROWS[:, 0], 3), ROWS[:, 1:]])
"""What the device measured, with the time that was left."""

HEAD = "t_left,ax,ay,az,gx,gy,gz"


def counted(true: Array, cuts: list[int], scale: str = "s") -> tuple[Array, list[str]]:
    """Times of rows that are handed over in pieces, and what is said of them."""
    times, edges = RowTimes(ReadOptions(time_unit=scale)), [0, *sorted(cuts), len(true)]
    parts = [times.of({"t": true[a:b]}, b - a)
             for a, b in zip(edges, edges[1:], strict=False) if b > a]  # fmt: skip
    return np.concatenate(parts), times.says


@given(st.sampled_from([16, 32]), st.integers(1, 9), st.lists(st.integers(0, 400)))
def test_a_counter_with_a_sign_goes_on_behind_its_end(
    bits: int, step: int, cuts: list[int]
) -> None:
    half = 2 ** (bits - 1)
    true = half - 200 * step + step * np.arange(400)
    wrapped = (np.mod(true + half, 2 * half) - half).astype(float)
    got, says = counted(wrapped, cuts)
    np.testing.assert_array_equal(got, true)
    ends = f"its clock ends at {half:g} s and begins again at {-half:g} s: the times"
    assert says == [f"{ends} behind go on"]


def test_a_counter_with_a_sign_may_be_divided_before_it_is_written() -> None:
    us = 2**31 - 4_000_000 + 20_000 * np.arange(400)
    wrapped = ((us + 2**31) % 2**32 - 2**31) / 1e6
    got, _ = counted(wrapped, [])
    np.testing.assert_allclose(got, us / 1e6, atol=1e-6)


@pytest.mark.parametrize("unit", [1.0, 1e3])
def test_a_timer_that_counts_down_is_told_by_the_turns(
    tmp_path: Path, unit: float
) -> None:
    rows = LEFT * np.array([unit, *[1.0] * 6])
    block, says = read_files([write(tmp_path, rows, heading=HEAD)])
    np.testing.assert_allclose(block.t - block.t[0], ROWS[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-6)
    assert [one for one in says if "its timer counts down" in one]


def test_rows_that_were_written_newest_first_are_no_countdown(tmp_path: Path) -> None:
    path = write(tmp_path, ROWS[::-1], heading=HEAD)
    with pytest.raises(InputError, match="newest first; sort its rows .* column -t in"):
        read_files([path])


def test_without_turns_the_user_says_that_a_timer_counts_down(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A list of columns may begin with a minus, as the question has it."""
    path, out = write(tmp_path, LEFT[:, :4]), tmp_path / "out"
    call = ["import", str(path), "-o", str(out), "--columns"]
    assert main([*call, "t,ax,ay,az"]) == 2
    assert "name that column -t in --columns" in capsys.readouterr().err
    assert main([*call, "-t,ax,ay,az"]) == 0
    t = Session.open(out).block.t
    np.testing.assert_allclose(t - t[0], ROWS[:, 0], atol=1e-6)


@given(st.integers(0, 999), st.lists(st.integers(0, 400)))
def test_parts_of_a_second_go_on_in_the_next(began: int, cuts: list[int]) -> None:
    ms = began + 10 * np.arange(400)
    t, says = counted(ms % 1000.0, cuts, "ms")
    np.testing.assert_allclose(np.diff(t), 0.01, atol=1e-9)
    assert says == ["its clock ends at 1 s and begins again: the times behind go on"]
