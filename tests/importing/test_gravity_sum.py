"""Accelerations without gravity, and gravity in a file or in columns beside them."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from laid_about import turned, write

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

RATE = 50.0
ROWS = turned(6, RATE, 2.0)
T, FORCE, RATES = ROWS[:, :1], ROWS[:, 1:4], ROWS[:, 4:]
GRAVITY = np.round(FORCE, 1)
FREE = FORCE - GRAVITY
HEADING = "time,seconds_elapsed,z,y,x"


def table(three: Array, late: float = 0.0) -> Array:
    return np.hstack([1.7e18 + 1e9 * (T + late), T + late, three[:, ::-1]])


def files(folder: Path, late: float = 0.0, acc: Array = FREE) -> list[str]:
    made = {"Accelerometer": (acc, 0.0), "Gravity": (GRAVITY, late),
            "Gyroscope": (RATES, 3e-3)}  # fmt: skip
    return [str(write(folder, table(*one), f"{name}.csv", HEADING))
            for name, one in made.items()]  # fmt: skip


def packed(folder: Path, paths: list[str]) -> list[str]:
    with zipfile.ZipFile(folder / "log.zip", "w") as archive:
        for path in paths:
            archive.write(path, Path(path).name)
    return [str(folder / "log.zip")]


@pytest.mark.parametrize("way", ["zip", "join"])
@pytest.mark.parametrize("late", [0.0, 4e-3])
def test_files_of_both_parts_are_added(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], way: str, late: float
) -> None:
    paths = files(tmp_path, late)
    call = packed(tmp_path, paths) if way == "zip" else [*paths[::-1], "--join"]
    assert main(["import", *call, "-o", str(tmp_path / "s")]) == 0
    block = Session.open(tmp_path / "s").block
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-6)
    np.testing.assert_allclose(block.gyr[:-1], RATES[:-1], atol=1e-6)
    np.testing.assert_allclose(block.t, T[:, 0], atol=1e-6)
    assert "are added, each with the nearest" in capsys.readouterr().err


@pytest.mark.parametrize("way", ["zip", "join"])
def test_parts_of_different_recordings_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], way: str
) -> None:
    paths = files(tmp_path, late=1000.0)
    call = packed(tmp_path, paths) if way == "zip" else [*paths, "--join"]
    assert main(["import", *call, "-o", str(tmp_path / "s")]) == 2
    said = capsys.readouterr().err
    assert "Gravity.csv: no sample is at a time at which" in said
    assert "TotalAcceleration" in said and not (tmp_path / "s").exists()


@pytest.mark.parametrize("way", ["zip", "join"])
def test_gravity_is_not_added_twice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], way: str
) -> None:
    paths = files(tmp_path, acc=FORCE)
    call = packed(tmp_path, paths) if way == "zip" else [*paths, "--join"]
    assert main(["import", *call, "-o", str(tmp_path / "s")]) == 0
    np.testing.assert_allclose(Session.open(tmp_path / "s").block.acc, FORCE, atol=1e-6)
    assert "Accelerometer.csv has gravity in it" in capsys.readouterr().err


def test_accelerations_without_gravity_alone_say_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = files(tmp_path)[0]
    assert main(["import", path, "-o", str(tmp_path / "s")]) == 2
    assert "--join (Accelerometer.csv Gravity.csv)" in capsys.readouterr().err


@pytest.mark.parametrize("unit", ["", " (m/s^2)"])
def test_columns_of_both_parts_are_added_whatever_the_first_is_called(
    tmp_path: Path, unit: str
) -> None:
    names = [f"{kind}_{axis}{unit}" for kind in ("accelerometer", "gravity")
             for axis in "xyz"]  # fmt: skip
    names += [f"gyroscope_{axis}" for axis in "xyz"]
    rows = np.hstack([T, FREE, GRAVITY, RATES])
    path = write(tmp_path, rows, heading=",".join(["seconds", *names]))
    assert main(["import", str(path), "-o", str(tmp_path / "s")]) == 0
    np.testing.assert_allclose(Session.open(tmp_path / "s").block.acc, FORCE, atol=1e-6)


def test_records_of_both_parts_are_added(tmp_path: Path) -> None:
    made = {"Accelerometer": FREE, "Gravity": GRAVITY, "Gyroscope": RATES}
    records = [
        {"sensor": name, "seconds_elapsed": t, **dict(zip("xyz", row, strict=True))}
        for i, t in enumerate(T[:, 0].tolist())
        for name, row in ((n, three[i].tolist()) for n, three in made.items())
    ]
    path = tmp_path / "log.json"
    path.write_text(json.dumps(records))
    assert main(["import", str(path), "-o", str(tmp_path / "s")]) == 0
    np.testing.assert_allclose(Session.open(tmp_path / "s").block.acc, FORCE, atol=1e-6)
