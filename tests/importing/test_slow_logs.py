"""Logs slower than usual, and temperatures that are raw counts."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import SIDES, G, turned, write

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array

RNG = np.random.default_rng(3)
NAMES = "time,ax,ay,az,gx (rad/s),gy (rad/s),gz (rad/s)"


def slow(step: float, each: int = 30) -> Array:
    """Rows of a device that lies on a side for some of them, and is turned between."""
    six = np.hstack([G * np.repeat(np.array(SIDES, float), each, axis=0),
                     np.zeros((each * len(SIDES), 3))])  # fmt: skip
    six += RNG.normal(0, 0.005, six.shape)
    return np.column_stack([step * np.arange(len(six)), six])


@pytest.mark.parametrize("step", [2.0, 4.0])
@pytest.mark.parametrize("begins", [0.0, 1.7e9])
def test_a_log_below_one_hertz_is_not_taken_for_a_fast_one(
    tmp_path: Path, step: float, begins: float
) -> None:
    rows = slow(step)
    rows[:, 0] += begins
    path = write(tmp_path, rows, heading=NAMES)
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), step)


def test_a_short_log_that_may_be_slow_is_asked_about(tmp_path: Path) -> None:
    rows = turned(4, 50.0, 0.5)
    rows[:, 0] = 2.0 * np.arange(len(rows))  # some rows more would be 5 s in ms
    with pytest.raises(InputError, match=r"0.5 Hz in s or 500 Hz in ms"):
        read_files([write(tmp_path, rows, heading=NAMES)])


@pytest.mark.parametrize("step", [1.3e-5, 4e-5])
def test_rows_faster_than_an_imu_are_asked_about(tmp_path: Path, step: float) -> None:
    # a loop that does not wait for the sensor, or times in hours
    rows = turned(4, 50.0, 0.5)
    rows[:, 0] = 0.57 + step * np.arange(len(rows))
    path = write(tmp_path, rows, heading=NAMES.replace("time", "t"))
    asked = rf"Hz in s, more than .*--time-unit h \({1 / 3600 / step:.3g} Hz\)"
    with pytest.raises(InputError, match=asked):
        read_files([path])
    stated = write(tmp_path, rows, "stated.csv", NAMES.replace("time", "t (s)"))
    block, _ = read_files([stated])
    np.testing.assert_allclose(np.diff(block.t), step, rtol=1e-3)


@pytest.mark.parametrize("size", [1e6, 1e9])
@pytest.mark.parametrize("rows", [7, 3000])
def test_a_day_tells_the_unit_of_a_thousand_rows_a_second(
    tmp_path: Path, size: float, rows: int
) -> None:
    """In a coarser unit it would be one row a second, in the year 50000."""
    moved = turned(4, 1000.0, 1.0)[:rows]
    stamps = (1730147632 * round(size) + np.arange(rows) * round(size / 1e3)).tolist()
    cells = ([f"{x:.9g}" for x in row] for row in moved[:, 1:])
    lines = [",".join([str(at), *row]) for at, row in zip(stamps, cells, strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([NAMES, *lines]) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 1e-3, atol=1e-6)


@pytest.mark.parametrize(
    "rate", [100.0, pytest.param(250.0, marks=pytest.mark.thorough), 500.0]
)
def test_a_fast_log_in_ms_is_one(tmp_path: Path, rate: float) -> None:
    rows = turned(4, rate, 1.0)
    rows[:, 0] *= 1e3
    block, _ = read_files([write(tmp_path, rows, heading=NAMES)])
    np.testing.assert_allclose(np.diff(block.t), 1 / rate)


@pytest.mark.parametrize(
    ("heading", "step"), [(NAMES, 1), (NAMES, 10), ("", 2), ("", 10)]
)
def test_a_clock_that_is_written_out_is_never_in_ms(
    tmp_path: Path, heading: str, step: int
) -> None:
    rows, began = slow(step), datetime(2024, 5, 3, 14, 20, 31)
    lines = [heading] if heading else []
    lines += [
        ",".join([f"{began + timedelta(seconds=t)}", *(f"{x:.6f}" for x in six)])
        for t, *six in rows.tolist()
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), step)


@pytest.mark.parametrize("count", [-2500, -4200, 7000])
def test_counts_that_would_be_no_usual_temperature_are_asked_about(
    tmp_path: Path, count: int
) -> None:
    rows = turned(4, 25.0, 1.0)
    rows = np.column_stack([rows, count + RNG.integers(0, 9, len(rows))])
    with pytest.raises(InputError, match="--temp-unit count"):
        read_files([write(tmp_path, rows, heading=f"{NAMES},temp")])


def test_counts_beside_those_of_a_gyroscope_are_asked_about(tmp_path: Path) -> None:
    rows = turned(4, 25.0, 1.0)
    rows[:, 4:] = np.round(np.rad2deg(rows[:, 4:]) * 131)
    rows = np.column_stack([rows, 2500 + RNG.integers(0, 9, len(rows))])
    with pytest.raises(InputError, match="--temp-unit count"):
        read_files([write(tmp_path, rows, heading="time,ax,ay,az,gx,gy,gz,temp")])


def test_hundredths_of_a_degree_of_a_sensor_at_work_are_taken(tmp_path: Path) -> None:
    rows = turned(4, 25.0, 1.0)
    rows = np.column_stack([rows, 2500 + RNG.integers(0, 9, len(rows))])
    block, _ = read_files([write(tmp_path, rows, heading=f"{NAMES},temp")])
    np.testing.assert_allclose(block.temperature, 25, atol=0.1)
