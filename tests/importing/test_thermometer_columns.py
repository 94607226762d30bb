"""The thermometer of an IMU, by the names and units of columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

from fieldcal.importing.headings.heading import Column
from fieldcal.importing.headings.headings import match_headings
from fieldcal.importing.read_options import ReadOptions

BARE = ("t", "ax", "ay", "az", "gx", "gy", "gz")
ROWS = turned(57, 50.0, 2.0)


def test_a_barometer_is_the_last_thermometer_that_is_taken() -> None:
    (found,) = match_headings([Column("", n) for n in (*BARE, "baro_temp")], "_")
    assert found.columns[-1] == "temperature" and "that of the baro" in found.says[0]
    (found,) = match_headings(
        [Column("", n) for n in (*BARE, "baro_temp", "temp")], "_"
    )
    assert found.columns[-2:] == ("_", "temperature") and not found.says


@pytest.mark.parametrize(
    ("name", "unit"),
    [("imu_degC", "degC"), ("temp (C)", "degC"), ("°C", "degC"), ("T_K", "K"),
     ("die [°C]", "degC"), ("mpu.celsius", "degC"), ("temp_F", "degF"),
     ("temp (F)", "degF"),
     ("Temperature (°F)", "degF"), ("T [K]", "K"), ("sensor degF", "degF")],
)  # fmt: skip
def test_a_thermometer_that_only_its_unit_names_is_taken(name: str, unit: str) -> None:
    (found,) = match_headings([Column("", n) for n in (*BARE, name)], "_")
    assert found.columns[-1] == "temperature"
    assert found.taken(ReadOptions()).temp_unit == unit


@pytest.mark.parametrize(
    "name",
    [
        "roll (°)",
        "heading [°]",
        "quat_c",
        "step_k",
        "mag_x (K)",
        "roll_F",
        "x (°C)",
        "C",
    ],
)
def test_what_may_be_something_else_is_no_thermometer(name: str) -> None:
    (found,) = match_headings([Column("", n) for n in (*BARE, name)], "_")
    assert found.columns[-1] == "_"


def test_thermometers_that_only_units_name_leave_no_choice() -> None:
    def columns(*names: str) -> tuple[str, ...]:
        (found,) = match_headings([Column("", n) for n in (*BARE, *names)], "_")
        return found.columns[len(BARE) :]

    assert columns("a_degC", "b_degC") == ("_", "_")
    assert columns("a_degC", "motor_degC") == ("temperature", "_")
    assert columns("a_degC", "temp") == ("_", "temperature")


@pytest.mark.parametrize("unit", ["K", "degF"])
def test_a_thermometer_in_other_units_reads_deg_c(tmp_path: Path, unit: str) -> None:
    warm = {"K": 300.15, "degF": 80.6}[unit]
    table = np.column_stack([ROWS, np.full(len(ROWS), warm)])
    path = write(tmp_path, table, heading=",".join([*BARE, f"temp [{unit}]"]))
    block, _ = read_files([path])
    np.testing.assert_allclose(block.temperature, 27.0)
