"""Dataflash logs as text: rows of one IMU from messages of one kind or of two."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laid_about import turned

from fieldcal.cli import main
from fieldcal.importing.files.packed_stream import PIECE
from fieldcal.session.folder import Session

ROWS = turned(5, 50.0, 2.0)
TOP = [
    "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
    "FMT, 129, 31, PARM, QNf, TimeUS,Name,Value",
    "FMT, 131, 39, IMU, QBffffffIIfBBHH, TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,"
    "T,GH,AH,GHz,AHz",
    "FMT, 132, 39, ACC, QBQfff, TimeUS,I,SampleUS,AccX,AccY,AccZ",
    "FMT, 133, 39, GYR, QBQfff, TimeUS,I,SampleUS,GyrX,GyrY,GyrZ",
    "PARM, 1000, INS_ACCOFFS_X, 0.1",
]
OLD = [
    "", "0", "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
    "FMT, 131, 39, IMU, IffffffIIf, TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,Temp",
]  # fmt: skip


def cells(*values: float) -> str:
    return ", ".join(f"{x:.9g}" for x in values)


def one_kind() -> list[str]:
    found = [*TOP]
    for t, *row in ROWS.tolist():
        for i in (0, 1):
            acc = [x + i for x in row[:3]]
            found.append(f"IMU, {9e6 + t * 1e6:.0f}, {i}, {cells(*row[3:], *acc)},"
                         " 0, 0, 38.5, 1, 1, 1000, 1000")  # fmt: skip
        found.append(f"ATT, {9e6 + t * 1e6:.0f}, 0.1, 0.2, 0.3")
    return found


def two_kinds() -> list[str]:
    found = [*TOP]
    for t, *row in ROWS.tolist():
        us = 9e6 + t * 1e6
        for i in (0, 1):
            acc, gyr = [x + i for x in row[:3]], row[3:]
            found.append(f"ACC, {us + 90:.0f}, {i}, {us:.0f}, {cells(*acc)}")
            found.append(f"GYR, {us + 95:.0f}, {i}, {us + 10:.0f}, {cells(*gyr)}")
    found.insert(len(found) // 2, "ACC, 9e6, 0, 12, 3")
    return found


def old() -> list[str]:
    return OLD + [f"IMU, {9e3 + t * 1e3:.0f}, {cells(*row[3:], *row[:3])}, 0, 0, 38.5"
                  for t, *row in ROWS.tolist()]  # fmt: skip


def shown(lines: list[str], defined: bool) -> list[str]:
    """The messages as mavlogdump shows them."""
    said = (line.split(", ") for line in lines if line.startswith("FMT"))
    names = {row[3]: row[5].split(",") for row in said}
    found = []
    for line in lines:
        name, *row = line.split(", ")
        fields = names.get(name, [*"abc"])
        if name == "FMT":
            # what names columns holds commas
            fields, row = ["Name", "Format", "Columns"], row[2:]
        pairs = ", ".join(map("{} : {}".format, fields, row))
        if defined or name != "FMT":
            found.append(f"2023-04-05 10:11:12.00: {name} {{{pairs}}}")
    return found


def shown_one_kind() -> list[str]:
    return shown(one_kind(), True)


def shown_two_kinds() -> list[str]:
    return shown(two_kinds(), False)


@pytest.mark.parametrize(
    "lines", [one_kind, two_kinds, old, shown_one_kind, shown_two_kinds]
)
def test_the_first_imu_is_read(tmp_path: Path, lines: object) -> None:
    assert callable(lines)
    path = tmp_path / "flight.log"
    path.write_text("\n".join(lines()) + "\n")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    block = Session.open(tmp_path / "out").block
    assert len(block) == len(ROWS)
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-6)
    warm, none = block.temperature, lines in (two_kinds, shown_two_kinds)
    assert np.isnan(warm).all() if none else (warm == 38.5).all()


def test_rates_of_a_flight_are_not_asked_about(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    found = [*TOP]
    for i in range(2000):
        row = cells(*rng.normal(0, 0.1, 3), *rng.normal([0, 0, -9.8], 0.5))
        found.append(f"IMU, {9000000 + 20000 * i}, 0, {row},"
                     " 0, 0, 38.5, 1, 1, 1000, 1000")  # fmt: skip
    path = tmp_path / "flight.log"
    path.write_text("\n".join(found) + "\n")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0


def test_a_log_may_lack_the_gyroscope_that_it_defines(tmp_path: Path) -> None:
    path, rows = tmp_path / "log.log", 1200
    row = "ACC, {0}, 0, {0}, 0.1, 0.2, 9.8".format
    path.write_text("\n".join([*TOP, *(row(10_000 * i) for i in range(rows))]) + "\n")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    block = Session.open(tmp_path / "out").block
    assert len(block) == rows
    assert np.isnan(block.gyr).all()


def test_the_imu_may_begin_far_behind_what_defines_it(tmp_path: Path) -> None:
    before = "ATT, 5000000, 0.1, 0.2, 0.3, 0.01, 0.02, 0.03, 0.123456789"
    lines = [*TOP, *[before] * (PIECE // len(before) + 100), *one_kind()[len(TOP) :]]
    path = tmp_path / "flight.log"
    path.write_text("\n".join(lines) + "\n")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    assert len(Session.open(tmp_path / "out").block) == len(ROWS)
