"""Databases of SQLite, as programs on telephones keep what they measure."""

from __future__ import annotations

import gzip
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.session.folder import Session

ROWS = turned(41, 50.0, 2.0)
T, A, W = ROWS[:, 0], ROWS[:, 1:4], ROWS[:, 4:]
ONE = "CREATE TABLE imu (_id INTEGER PRIMARY KEY, t REAL, ax REAL, ay REAL, az REAL,"\
      " gx REAL, gy REAL, gz REAL, note TEXT)"  # fmt: skip


def database(path: Path, *tables: tuple[str, str, list[tuple[object, ...]]]) -> Path:
    """A database with tables: how each is made, its columns, and its rows."""
    with closing(sqlite3.connect(path)) as opened, opened:
        for made, into, rows in tables:
            opened.execute(made)
            marks = ", ".join("?" * len(rows[0]))
            opened.executemany(f"INSERT INTO {into} VALUES ({marks})", rows)  # noqa: S608
    return path


def one_table(path: Path) -> Path:
    rows = [(*row, "at rest") for row in ROWS.tolist()]
    return database(path, (ONE, "imu (t, ax, ay, az, gx, gy, gz, note)", rows))


def test_a_table_is_read_by_its_names(tmp_path: Path) -> None:
    block, _ = read_files([one_table(tmp_path / "log.db")])
    np.testing.assert_allclose(block.t, T)
    np.testing.assert_allclose(block.acc, A)
    np.testing.assert_allclose(block.gyr, W)


def test_tables_of_two_sensors_go_together_by_time(tmp_path: Path) -> None:
    late = [1_700_000_000_003 + round(t * 1e3) for t in T]
    path = database(
        tmp_path / "sensors.sqlite",
        ("CREATE TABLE android_metadata (locale TEXT)", "android_metadata", [("de",)]),
        ("CREATE TABLE accelerometer (timestamp INTEGER, x REAL, y REAL, z REAL)",
         "accelerometer",
         [(n - 3, *row) for n, row in zip(late, A.tolist(), strict=True)]),
        ("CREATE TABLE gyroscope (timestamp INTEGER, x REAL, y REAL, z REAL)",
         "gyroscope", [(n, *row) for n, row in zip(late, W.tolist(), strict=True)]),
    )  # fmt: skip
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 0.02, atol=1e-6)
    np.testing.assert_allclose(block.acc, A)
    np.testing.assert_allclose(block.gyr, W)


def test_devices_in_one_table_and_times_as_text(tmp_path: Path) -> None:
    made = ONE.replace("t REAL", "time TEXT").replace("note", "device")
    rows = [(f"2026-03-14 10:{int(t // 60):02d}:{t % 60:06.3f}",
             *(x * scale for x in row), device)
            for t, *row in ROWS.tolist()
            for device, scale in (("left", 1.0), ("right", 1.02))]  # fmt: skip
    path = database(
        tmp_path / "log.db", (made, "imu (time, ax, ay, az, gx, gy, gz, device)", rows)
    )
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 0
    for name, scale in (("left", 1.0), ("right", 1.02)):
        block = Session.open(out / name).block
        np.testing.assert_allclose(block.acc, A * scale, atol=1e-9)
        np.testing.assert_allclose(np.diff(block.t), 0.02, atol=1e-6)


def test_rows_of_two_sensors_in_one_table_go_together(tmp_path: Path) -> None:
    rows: list[tuple[object, ...]] = []
    for t, a, w in zip(T.tolist(), A.tolist(), W.tolist(), strict=True):
        rows += [("Accelerometer", t, *a), ("Gyroscope", t + 0.003, *w)]
    made = "CREATE TABLE data (sensor TEXT, timestamp REAL, x REAL, y REAL, z REAL)"
    block, _ = read_files([database(tmp_path / "log.db", (made, "data", rows))])
    np.testing.assert_allclose(block.acc, A)
    np.testing.assert_allclose(block.gyr, W)


def test_a_packed_one_is_read_and_a_damaged_one_refused(tmp_path: Path) -> None:
    content = one_table(tmp_path / "log.db").read_bytes()
    (tmp_path / "log.db.gz").write_bytes(gzip.compress(content))
    block, _ = read_files([tmp_path / "log.db.gz"])
    np.testing.assert_allclose(block.acc, A)
    (tmp_path / "cut.db").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match=r"cut.db: is not whole"):
        read_files([tmp_path / "cut.db"])
