"""Real recordings beside the project, as blocks; a test skips where they are absent."""

from __future__ import annotations

import csv
import gzip
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from observed import SHARED

from fieldcal.core.samples import Array, Block

REAL = SHARED / "real"


def _file(*parts: str) -> Path:
    path = REAL.joinpath(*parts)
    if not path.is_file():
        pytest.skip(f"the recording is not here: {path}")
    return path


def mpu9150(unit: int) -> Block:
    """One of five units turned together by hand, 100 Hz."""
    with gzip.open(_file("mikoff_mpu9150_x5", f"imu{unit}.log.gz"), "rt") as file:
        table = np.loadtxt(file)
    return Block.of(np.arange(len(table)) / 100, table[:, :3], table[:, 3:])


def mpu9150_published() -> dict[str, Any]:
    """Read the published calibration of the five units."""
    path = _file("mikoff_mpu9150_x5", "peer_results.toml")
    return tomllib.loads(path.read_text())


def ferraris() -> dict[str, Array]:
    """Six faces and three rotations in counts, rows (k, 6) by label."""
    path = _file("imucal_ferraris", "annotated_session.csv.gz")
    parts: dict[str, list[list[float]]] = {}
    with gzip.open(path, "rt") as file:
        for row in csv.DictReader(file):
            six = [float(row[f"{s}_{x}"]) for s in ("acc", "gyr") for x in "xyz"]
            parts.setdefault(row["part"], []).append(six)
    return {k: np.array(v) for k, v in parts.items()}


def hand_held() -> tuple[Array, Array]:
    """Samples in counts, (n, 6), and ten still intervals, (2, 10) rows."""
    path = _file("tomisuarez_mpu6050", "example_data_calibration.csv.gz")
    with gzip.open(path, "rt") as file:
        table = np.loadtxt(file, delimiter=",", skiprows=5)
    intervals = np.loadtxt(
        _file("tomisuarez_mpu6050", "peer_static_intervals.csv"), delimiter=","
    )
    return table, intervals
