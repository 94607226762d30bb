"""Accelerations that count gravity downwards, as iOS gives them to programs."""

from __future__ import annotations

import zipfile
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, turned, write

from fieldcal.core.samples import Array

ROWS = turned(4, 25.0, 1.5)
T, A, W = ROWS[:, :1], ROWS[:, 1:4], ROWS[:, 4:]
IOS = -A / G
FREE = 0.001 * np.random.default_rng(1).normal(size=A.shape)
MOTION = np.hstack([T, IOS - FREE, FREE, W])


def axes(pattern: str, letters: str = "XYZ") -> str:
    return ",".join(pattern.format(axis) for axis in letters)


ACCELEROMETER = (
    f"accelerometerTimestamp_sinceReboot(s),{axes('accelerometerAcceleration{}(G)')},"
    f"{axes('gyroRotation{}(rad/s)')}"
)
MOTIONS = (
    f"motionTimestamp_sinceReboot(s),{axes('motionGravity{}(G)')},"
    f"{axes('motionUserAcceleration{}(G)')},{axes('motionRotationRate{}(rad/s)')}"
)
PARTED = (
    f"t (s),{axes('gravity.{}', 'xyz')},{axes('userAcceleration.{}', 'xyz')},"
    f"{axes('rotationRate.{}', 'xyz')}"
)


LOGGER = "time,seconds_elapsed,z,y,x"


@pytest.mark.parametrize(
    ("heading", "rows"),
    [(ACCELEROMETER, np.hstack([T, IOS, W])), (MOTIONS, MOTION), (PARTED, MOTION)],
)
def test_what_ios_counts_downwards_is_turned(
    tmp_path: Path, heading: str, rows: Array
) -> None:
    block, said = read_files([write(tmp_path, rows, heading=heading)])
    np.testing.assert_allclose(block.acc, A, atol=1e-6)
    np.testing.assert_allclose(block.gyr, W, atol=1e-6)
    assert any("iOS" in s and "their sign is turned" in s for s in said)
    assert any("-ax,-ay,-az" in s for s in said)  # the same by hand


def test_names_that_others_use_as_well_turn_nothing(tmp_path: Path) -> None:
    heading = f"t (s),{axes('acceleration_{}(g)', 'xyz')},{axes('gyro_{}', 'xyz')}"
    block, said = read_files(
        [write(tmp_path, np.hstack([T, -IOS, W]), heading=heading)]
    )
    np.testing.assert_allclose(block.acc, A, atol=1e-6)
    assert not any("iOS" in s for s in said)


def test_what_a_program_has_made_m_s2_of_is_left_and_said(tmp_path: Path) -> None:
    heading = ACCELEROMETER.replace("(G)", "(m/s^2)")
    path = write(tmp_path, np.hstack([T, A, W]), heading=heading)
    block, said = read_files([path])
    np.testing.assert_allclose(block.acc, A, atol=1e-6)
    assert any("not in g" in s for s in said)


@pytest.mark.parametrize(
    ("platform", "standard", "sign"),
    [("ios", "false", -1), ("ios", "true", 1), ("android", "false", 1)],
)
def test_an_archive_says_who_wrote_it(
    tmp_path: Path, platform: str, standard: str, sign: int
) -> None:
    files = {
        name: "time,seconds_elapsed,z,y,x\n"
        + "".join(
            f"{1.7e18 + 1e9 * t:.0f},{t:.6f},{z:.9f},{y:.9f},{x:.9f}\n"
            for (t,), (x, y, z) in zip(T.tolist(), three.tolist(), strict=True)
        )
        for name, three in (("TotalAcceleration", sign * A), ("Gyroscope", W))
    }
    files["Metadata"] = f"version,platform,standardisation\n3,{platform},{standard}\n"
    path = tmp_path / "log.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(f"{name}.csv", text)
    block, said = read_files([path])
    np.testing.assert_allclose(block.acc, A, atol=1e-6)
    assert (sign < 0) == any("iOS" in s for s in said)


def test_a_log_of_all_its_sensors_with_a_zone(tmp_path: Path) -> None:
    names = f"loggingTime(txt),{ACCELEROMETER},{MOTIONS}"
    began = datetime(2024, 5, 3, 14, 20, 31, 250000)
    found = [names]
    whole = np.hstack([T + 1000, IOS, W, MOTION + [1000, *[0] * 9]])
    for t, row in zip(T[:, 0], whole.tolist(), strict=True):
        now = f"{began + timedelta(seconds=t):%Y-%m-%d %H:%M:%S.%f} +0200"
        found.append(",".join([now, *(f"{x:.9f}" for x in row)]))
    path = tmp_path / "log.csv"
    path.write_text("\n".join(found) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.t, T[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, A, atol=1e-6)


def test_a_file_of_sensor_logger_alone_does_not_tell(tmp_path: Path) -> None:
    paths = [
        write(tmp_path, np.hstack([T, T, three[:, ::-1]]), name, LOGGER)
        for name, three in (("TotalAcceleration.csv", A), ("Gyroscope.csv", W))
    ]
    _, said = read_files(paths)
    assert sum("the other sign on iOS" in s for s in said) == 1
