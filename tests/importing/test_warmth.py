"""A file of an IMU joined with that of a slow thermometer."""

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
from fieldcal.core.samples import Array, Block
from fieldcal.importing.session.warmth import Warmth
from fieldcal.session.folder import Session

RATE = 25.0
ROWS = turned(7, RATE, 1.5)
T = ROWS[:, 0]
HEADING = "time,ax,ay,az,gx,gy,gz"


def warm(t: Array) -> Array:
    return 20 + 0.1 * t


def thermometer(folder: Path, t: Array, size: float = 1.0, zero: float = 0.0) -> str:
    rows = zip((size * (zero + t)).tolist(), warm(t).tolist(), strict=True)
    lines = [f"{time:.13g},{degrees:.6f}" for time, degrees in rows]
    (folder / "room.csv").write_text("\n".join(["time,temperature", *lines]))
    return str(folder / "room.csv")


@pytest.mark.parametrize("step", [1.0, 5.0])
@pytest.mark.parametrize(("size", "zero"), [(1.0, 0.0), (1e3, 1.7e9)])
def test_temperatures_are_interpolated_and_no_row_is_lost(
    tmp_path: Path, step: float, size: float, zero: float
) -> None:
    rows = ROWS + [[zero, *[0] * 6]]
    lines = [",".join(f"{x:.13g}" for x in row) for row in rows.tolist()]
    (tmp_path / "log.csv").write_text("\n".join([HEADING, *lines]))
    imu = str(tmp_path / "log.csv")
    slow = thermometer(tmp_path, np.arange(2.0, T[-1] - 1, step), size, zero)
    block, says = read_files([imu, slow])
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
    last = np.arange(2.0, T[-1] - 1, step)[-1]
    np.testing.assert_allclose(
        block.temperature, warm(np.clip(T, 2.0, last)), atol=1e-3
    )
    assert f"temperatures, about {step:g} s apart, are interpolated" in says[-1]
    assert "held up to" in says[-1]


def test_an_imu_and_a_thermometer_are_one_session(tmp_path: Path) -> None:
    imu = str(write(tmp_path, ROWS, heading=HEADING))
    call = [imu, thermometer(tmp_path, np.arange(0.0, T[-1] + 1)), "--join"]
    assert main(["import", *call, "-o", str(tmp_path / "s")]) == 0
    block = Session.open(tmp_path / "s").block
    np.testing.assert_allclose(block.temperature, warm(T), atol=1e-6)


def test_a_thermometer_of_another_time_is_refused(tmp_path: Path) -> None:
    imu = write(tmp_path, ROWS, heading="t (s),ax,ay,az,gx,gy,gz")
    slow = thermometer(tmp_path, np.arange(1000.0, 1040.0))
    with pytest.raises(InputError, match=r"room.csv: no sample of log.csv lies within"):
        read_files([imu, slow])


def test_a_thermometer_alone_is_no_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = thermometer(tmp_path, np.arange(40.0))
    assert main(["import", slow, "-o", str(tmp_path / "s")]) == 2
    assert "holds temperatures alone" in capsys.readouterr().err


@given(st.lists(st.integers(0, 400), max_size=4))
def test_it_is_no_matter_how_the_samples_come(cuts: list[int]) -> None:
    t = np.arange(3.0, 15.0)
    reads = Warmth([Block.of(t, np.full((12, 3), np.nan), None, warm(t))])
    parts = np.split(T[:400], sorted(cuts))
    found = np.concatenate([reads.at(part) for part in parts])
    np.testing.assert_allclose(found, warm(np.clip(T[:400], 3.0, 14.0)))
    assert reads.within == int(((T[:400] >= 3) & (T[:400] <= 14)).sum())
