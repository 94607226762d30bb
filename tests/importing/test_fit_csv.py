"""Messages of a FIT file as text: samples of both sensors within cells."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import G, turned

from fieldcal.core.samples import Array
from fieldcal.importing.text.fit_csv import HEADING, FitCsv

RATE, EACH = 50.0, 20
ROWS = turned(12, RATE, 2.0)
ROWS = ROWS[: len(ROWS) // EACH * EACH]
TOP = [f"{HEADING},Field 2,Value 2,Units 2",
       "Definition,0,file_id,type,1,,time_created,1,,",
       'Data,0,file_id,type,"4",,time_created,"1083000000",,']  # fmt: skip


def cell(name: str, values: Sequence[object], unit: str) -> str:
    return f'{name},"{"|".join(map(str, values))}",{unit}'


def message(kind: str, t: Array, axes: Array, name: str, unit: str) -> str:
    """One message, which holds the samples at times (n,)."""
    since = 1_083_000_000 + t[0]
    return ",".join([
        "Data", "4", kind, cell("timestamp", [int(since)], "s"),
        cell("timestamp_ms", [round(since % 1 * 1e3)], "ms"),
        cell("sample_time_offset", np.round((t - t[0]) * 1e3).astype(int), "ms"),
        *(cell(f"{name}_{a}", [f"{x:.7g}" for x in column], unit)
          for a, column in zip("xyz", axes.T, strict=True)), "", "", "",
    ])  # fmt: skip


def log(with_rates: bool = True, late: float = 0.0) -> list[str]:
    found = [*TOP]
    for rows in np.split(ROWS, len(ROWS) // EACH):
        found.append(message("accelerometer_data", rows[:, 0], rows[:, 1:4] / G,
                             "calibrated_accel", "g"))  # fmt: skip
        if with_rates:
            found.append(message("gyroscope_data", rows[:, 0] + late,
                                 np.rad2deg(rows[:, 4:]), "calibrated_gyro",
                                 "deg/s"))  # fmt: skip
    return found


@pytest.mark.parametrize("late", [0.0, 0.004])
def test_samples_of_both_sensors_go_together(tmp_path: Path, late: float) -> None:
    path = tmp_path / "activity.csv"
    path.write_text("\n".join(log(late=late)) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 1 / RATE, atol=2e-3)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-5)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-6)


def test_an_accelerometer_may_be_alone(tmp_path: Path) -> None:
    path = tmp_path / "activity.csv"
    path.write_text("\n".join(log(with_rates=False)) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-5)
    assert np.isnan(block.gyr).all()


def test_counts_are_taken_where_nothing_is_calibrated() -> None:
    t = ROWS[:EACH, 0]
    raw = 32768 + np.round(ROWS[:EACH, 1:4] * 400)
    lines = [*TOP, message("accelerometer_data", t, raw, "accel", "counts")]
    form = FitCsv.of(lines, None)
    assert form is not None
    assert form.names == ("time [s]", "accel_x", "accel_y", "accel_z")
    first = form.reader()(lines)[0].split(",")
    assert [float(x) for x in first[1:]] == raw[0].tolist()


TURNS = {
    "accel": ("0", "accel_cal_factor", 1, 4096, np.eye(3)[[1, 0, 2]] * [1, 1, -1]),
    "gyro": ("1", "gyro_cal_factor", 5, 82, np.eye(3)[[2, 0, 1]] * [-1, 1, -1]),
}
OFFSETS = {"accel": [-12, 30, 5], "gyro": [-23, 19, -12]}


def calibration(kind: str, one: int) -> str:
    """A message with the calibration of a sensor, whose matrix has so many in one."""
    number, name, factor, divisor, turn = TURNS[kind]
    matrix = (turn * one).astype(int if one > 1 else float).ravel().tolist()
    return ",".join([
        "Data", "5", "three_d_sensor_calibration", cell("timestamp", [900], "s"),
        cell(name, [factor], ""), cell("calibration_divisor", [divisor], "counts"),
        cell("level_shift", [32768], ""), cell("offset_cal", OFFSETS[kind], ""),
        cell("orientation_matrix", matrix, ""), cell("sensor_type", [number], ""),
    ])  # fmt: skip


def counts(kind: str, values: Array) -> Array:
    """Counts (n, 3) of values (n, 3) in g or deg/s in the device's axes."""
    _, _, factor, divisor, turn = TURNS[kind]
    in_chip = values @ turn * divisor / factor
    rounded: Array = np.round(in_chip + 32768 + OFFSETS[kind]).astype(int)
    return rounded


@pytest.mark.parametrize("one", [1, 65535])
def test_counts_are_calibrated_as_messages_say(tmp_path: Path, one: int) -> None:
    found = [*TOP, calibration("gyro", one), calibration("accel", one)]
    for rows in np.split(ROWS, len(ROWS) // EACH):
        for kind, values in (("accel", rows[:, 1:4] / G),
                             ("gyro", np.rad2deg(rows[:, 4:]))):  # fmt: skip
            name = "accelerometer_data" if kind == "accel" else "gyroscope_data"
            found.append(message(name, rows[:, 0], counts(kind, values), kind,
                                 "counts"))  # fmt: skip
    path = tmp_path / "activity.csv"
    path.write_text("\n".join(found) + "\n")
    block, says = read_files([path])
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=0.51 * G / 4096)
    np.testing.assert_allclose(
        np.rad2deg(block.gyr), np.rad2deg(ROWS[:, 4:]), atol=0.51 * 5 / 82
    )
    assert any("calibrated as its own messages say" in said for said in says)


@given(st.lists(st.text(alphabet='Data,4_accelerometer_data"|0.x-', max_size=60)))
def test_no_line_breaks_the_reader(lines: list[str]) -> None:
    known = log()
    form = FitCsv.of(known, None)
    assert form is not None
    read = form.reader()
    assert len([*read([*lines, *known]), *read([])]) == len(ROWS)
    cut = [line[:n] for line in known for n in (30, 90)]
    assert len(form.reader()(cut)) == 0
