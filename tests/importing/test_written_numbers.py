"""Numbers and tables as other programs write them, and files of thermometers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, turned, write

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array

ROWS = turned(4, 25.0, 1.0)
NAMES = "t (s),ax (m/s^2),ay (m/s^2),az (m/s^2),gx (rad/s),gy (rad/s),gz (rad/s)"
SHORT = NAMES.replace(" (m/s^2)", "").replace(" (rad/s)", "").split(",")[1:]


def fortran() -> str:
    rows = ("  ".join(f"{x: .9E}".replace("E", "D") for x in row) for row in ROWS)
    return "\n".join([NAMES.replace(" (", "(").replace(",", "  "), *rows])


def units(between: str) -> str:
    found = ["t (s)," + ",".join(SHORT)]
    for t, *six in ROWS.tolist():
        cells = [f"{x / G:.9f}{between}g" for x in six[:3]]
        cells += [f"{np.rad2deg(x):.9f}{between}°/s" for x in six[3:]]
        found.append(",".join([f"{t:.3f}", *cells]))
    return "\n".join(found)


def points() -> str:
    found = []
    for i, (t, *six) in enumerate(ROWS.tolist()):
        pairs = zip(SHORT, six, strict=True)
        fields = ",".join(f"{name}={x:.9f}" for name, x in pairs)
        stamp = 1714746031000000000 + round(t * 1e9)
        found.append(f"imu,host=pi {fields},n={i}i {stamp}")
        found += [f"cpu,host=pi load=0.5 {stamp}"] if i % 3 == 0 else []
    return "\n".join(found)


def long(head: bool) -> str:
    found = ["time,name,value"] if head else []
    for t, *six in ROWS.tolist():
        pairs = zip(SHORT, six, strict=True)
        found += [f"{t:.3f},{name},{x:.9f}" for name, x in pairs]
    return "\n".join(found)


@pytest.mark.parametrize(
    "text",
    [fortran(), units(" "), units(""), points(), long(True), long(False)],
    ids=["fortran", "units", "units beside", "points", "long", "long without names"],
)
def test_what_is_written_otherwise_is_the_same(tmp_path: Path, text: str) -> None:
    path = tmp_path / "log.txt"
    path.write_text(text + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=2e-6)
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-7)


def test_a_cell_in_another_unit_is_no_number(tmp_path: Path) -> None:
    text = units(" ").split("\n")
    text[40] = text[40].replace(" g", " mg")
    path = tmp_path / "log.csv"
    path.write_text("\n".join(text) + "\n")
    with pytest.raises(InputError, match="line 41"):
        read_files([path])


def warm(many: int) -> Array:
    t = np.arange(0.0, ROWS[-1, 0] + 2, 2.0)
    other = 40 + 10 * np.random.default_rng(1).random((len(t), many))
    return np.column_stack([t, 25 + 0.1 * t, other])


@pytest.mark.parametrize(
    "heading",
    [
        "time (s),temperature (C),humidity",
        "time (s),temp (C),pressure (hPa),humidity (%),co2 (ppm)",
        "time (s),temp (C),ambient temp (C),dew point temp (C)",
        "time (s),temp (C),battery (V),status",
    ],
)
def test_a_thermometer_with_more_columns_needs_no_option(
    tmp_path: Path, heading: str
) -> None:
    rows = warm(heading.count(",") - 1)
    if "pressure" in heading:
        rows[:, 2] += 970.0  # as a g in mg would read
    paths = [write(tmp_path, ROWS, heading=NAMES),
             write(tmp_path, rows, "warm.csv", heading)]  # fmt: skip
    block, _ = read_files(paths)
    np.testing.assert_allclose(block.temperature, 25 + 0.1 * ROWS[:, 0], atol=1e-6)


@pytest.mark.parametrize("more", ["temp 1 (C),temp 2 (C)", "temp (C),x,y,z"])
def test_a_thermometer_that_may_be_another_is_asked_about(
    tmp_path: Path, more: str
) -> None:
    rows = warm(more.count(","))
    paths = [write(tmp_path, ROWS, heading=NAMES),
             write(tmp_path, rows, "warm.csv", f"time (s),{more}")]  # fmt: skip
    with pytest.raises(InputError, match="--columns"):
        read_files(paths)
