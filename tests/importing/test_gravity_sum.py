"""Accelerations without gravity, and gravity in a file or in columns beside them."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

Way = Callable[[Path, list[str]], list[str]]
"""Files as they are given: as they are, or in an archive."""

RATE = 25.0
ROWS = turned(6, RATE, 1.5)
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


def test_three_files_are_one_session(tmp_path: Path) -> None:
    call = [*files(tmp_path)[::-1], "--join", "-o", str(tmp_path / "s")]
    assert main(["import", *call]) == 0
    block = Session.open(tmp_path / "s").block
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-6)
    np.testing.assert_allclose(block.t, T[:, 0], atol=1e-6)


@pytest.mark.parametrize("way", [packed, lambda _, paths: paths], ids=["zip", "join"])
@pytest.mark.parametrize("late", [0.0, 4e-3])
def test_files_of_both_parts_are_added(tmp_path: Path, way: Way, late: float) -> None:
    block, says = read_files(way(tmp_path, files(tmp_path, late)))
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-6)
    np.testing.assert_allclose(block.gyr[:-1], RATES[:-1], atol=1e-6)
    np.testing.assert_allclose(block.t - block.t[0], T[:, 0], atol=1e-6)
    assert any("are added, each with the nearest" in said for said in says)


@pytest.mark.parametrize("way", [packed, lambda _, paths: paths], ids=["zip", "join"])
def test_parts_of_different_recordings_are_refused(tmp_path: Path, way: Way) -> None:
    paths = way(tmp_path, files(tmp_path, late=1000.0))
    with pytest.raises(InputError, match=r"Gravity.csv: no sample is at a time") as no:
        read_files(paths)
    assert "TotalAcceleration" in str(no.value)


@pytest.mark.parametrize("way", [packed, lambda _, paths: paths], ids=["zip", "join"])
def test_gravity_is_not_added_twice(tmp_path: Path, way: Way) -> None:
    block, says = read_files(way(tmp_path, files(tmp_path, acc=FORCE)))
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-6)
    assert any("Accelerometer.csv has gravity in it" in said for said in says)


def test_accelerations_without_gravity_alone_say_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--join \(Accelerometer.csv Gravity.csv\)"):
        read_files(files(tmp_path)[:1])


@pytest.mark.parametrize("unit", ["", " (m/s^2)"])
def test_columns_of_both_parts_are_added_whatever_the_first_is_called(
    tmp_path: Path, unit: str
) -> None:
    names = [f"{kind}_{axis}{unit}" for kind in ("accelerometer", "gravity")
             for axis in "xyz"]  # fmt: skip
    names += [f"gyroscope_{axis}" for axis in "xyz"]
    rows = np.hstack([T, FREE, GRAVITY, RATES])
    block, _ = read_files(
        [write(tmp_path, rows, heading=",".join(["seconds", *names]))]
    )
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-6)


def test_records_of_both_parts_are_added(tmp_path: Path) -> None:
    made = {"Accelerometer": FREE, "Gravity": GRAVITY, "Gyroscope": RATES}
    records = [
        {"sensor": name, "seconds_elapsed": t, **dict(zip("xyz", row, strict=True))}
        for i, t in enumerate(T[:, 0].tolist())
        for name, row in ((n, three[i].tolist()) for n, three in made.items())
    ]
    path = tmp_path / "log.json"
    path.write_text(json.dumps(records))
    block, says = read_files([path])
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-6)
    assert any("those of Gravity are added" in said for said in says)
