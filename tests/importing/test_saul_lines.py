"""What the sensor shell of RIOT prints: each device's axes, their units and times."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.importing.text.saul_lines import SaulLines
from fieldcal.session.folder import Session

ROWS = turned(31, 50.0)
START = datetime(2022, 4, 5, 23, 59, 55)  # noqa: DTZ001
MILLI_G = np.round(ROWS[:, 1:4] / G0 * 1000)
TENTHS = np.round(np.rad2deg(ROWS[:, 4:]) * 10)


def device(number: int, name: str, values: Sequence[str], unit: str) -> list[str]:
    """Lines of one device as sys/phydat prints them."""
    axes = [f"\t[{i}] {x} {unit}" for i, x in enumerate(values)]
    alone = [f"\t     {values[0]} {unit}"]
    first, *rest = axes if len(values) > 1 else alone
    return [f"Reading from #{number} ({name})", f"Data:{first}", *rest, ""]


def shell(first: int = 4, force: Array = MILLI_G, unit: str = "mgₙ") -> list[list[str]]:
    """Lines of each row."""
    return [
        [
            *device(0, "Button 1|SENSE_BTN", ["     0"], ""),
            *device(first, "lsm6dsl|SENSE_ACCEL", [f"{x:6.0f}" for x in acc], unit),
            *device(first + 1, "lsm6dsl|SENSE_GYRO", [f"{x:.0f}E-1" for x in w], "dps"),
            *device(first + 2, "lis3mdl|SENSE_MAG", ["12", "-3", "40"], "Gs"),
            *device(first + 3, "lsm6dsl|SENSE_TEMP", ["24.50"], "°C"),
        ]
        for acc, w in zip(force, TENTHS, strict=True)
    ]


def check(block: Array) -> None:
    np.testing.assert_allclose(block[:, :3], MILLI_G * G0 / 1000, rtol=1e-9)
    np.testing.assert_allclose(block[:, 3:], np.deg2rad(TENTHS / 10), rtol=1e-9)


@pytest.mark.parametrize("unit", ["mg", "mgₙ"])
def test_devices_are_rows_behind_the_times_of_a_terminal(
    tmp_path: Path, unit: str
) -> None:
    lines = ["2022-04-05 23:59:54,900 # saul read all"]
    for t, row in zip(ROWS[:, 0], shell(unit=unit), strict=True):
        # each line comes later than the one before
        for i, line in enumerate(row):
            now = START + timedelta(seconds=float(t), milliseconds=i // 6)
            lines.append(
                f"{now:%Y-%m-%d %H:%M:%S},{now.microsecond // 1000:03} # {line}"
            )
    path = tmp_path / "term.log"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    block = Session.open(tmp_path / "out").block
    check(block.six)
    np.testing.assert_allclose(block.t - block.t[0], ROWS[:, 0], atol=1e-3)
    assert (block.temperature == 24.5).all()


def test_two_devices_of_one_driver_are_two(tmp_path: Path) -> None:
    pairs = zip(shell(), shell(8, MILLI_G + 20), strict=True)
    lines = [
        "> saul read all",
        *(line for pair in pairs for row in pair for line in row),
    ]
    path = tmp_path / "shell.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    out = tmp_path / "out"
    assert main(["import", str(path), "--rate", "50", "-o", str(out)]) == 0
    first, second = sorted(out.iterdir())
    check(Session.open(first).block.six)
    away = Session.open(second).block.acc - Session.open(first).block.acc
    np.testing.assert_allclose(away, 0.02 * G0, rtol=1e-6)


@given(st.lists(st.sampled_from(
    ["Reading from #1 (a|SENSE_ACCEL)", "Reading from #2 (b|SENSE_TEMP)",
     "Data:\t[0] 1 g", "\t[2] 3 g", "\t[7] 3", "Data:\t 25 °C", "", "x"]),
    max_size=12))  # fmt: skip
def test_any_lines_of_the_shell_make_rows_of_one_width(lines: list[str]) -> None:
    form = SaulLines.of(lines, None)
    if form is not None:
        read = form.reader()
        found = [*read(lines), *read([])]
        assert {row.count("\t") + 1 for row in found} <= {len(form.names)}
