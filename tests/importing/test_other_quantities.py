"""Columns that are called like a sensor's and hold something else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, turned, write

from fieldcal.core.samples import Array

ROWS = turned(16, 50.0, 2.0)
T, A, W = ROWS[:, :1], ROWS[:, 1:4], ROWS[:, 4:]
DEG = np.rad2deg(W)
OTHER = np.random.default_rng(4).normal(0, 3, A.shape) + [0, 0, 9]


def axes(*names: str) -> str:
    return ",".join(["time", *(name.format(x) for name in names for x in "xyz")])


@pytest.mark.parametrize(
    ("heads", "rates", "others"),
    [
        # what the names of rates say of an acceleration is no force
        (
            ("Accel_{} (m/s²)", "AngleRate_{} (deg/s)", "AngularAccel_{} (deg/s²)"),
            DEG,
            10 * DEG,
        ),
        (("acc_{}", "gyr_{}", "acc_des_{}"), W, OTHER),
        (("acc_{}", "gyr_{}", "acc_filt_{}"), W, OTHER),
    ],
)
def test_what_is_made_of_samples_or_wanted_is_no_imu(
    tmp_path: Path, heads: tuple[str, ...], rates: Array, others: Array
) -> None:
    path = write(tmp_path, np.hstack([T, A, rates, others]), heading=axes(*heads))
    block, _ = read_files([path])
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-6)


def test_values_that_a_program_prints_with_angles_beside_them(tmp_path: Path) -> None:
    """As a library for a chip prints them, with angles of two axes and of three."""
    lines = []
    for t, a, w in zip(T[:, 0], A / G, DEG, strict=True):
        acc, gyr = (
            "\t".join(f"{x}: {v:.9f}" for x, v in zip("XYZ", three, strict=True))
            for three in (a, w)
        )
        lines += [f"TEMPERATURE: {25 + t / 100:.2f}", f"ACCELERO  {acc}"]
        lines += [f"GYRO      {gyr}", "ACC ANGLE X: 1.22\tY: 3.10"]
        lines += ["ANGLE     X: 1.00\tY: 2.00\tZ: 3.00", "=" * 40]
    path = tmp_path / "log.txt"
    path.write_text("# rate = 50 Hz\n" + "\n".join(lines) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-6)
    np.testing.assert_allclose(block.temperature, 25 + T[:, 0] / 100, atol=6e-3)


def test_values_behind_a_label_that_names_all_axes(tmp_path: Path) -> None:
    """As boards of Arduino with a hub of Bosch print them, in counts."""
    acc, gyr = np.round(A / G * 4096), np.round(DEG * 16.384)
    text = "".join(
        f"{name}: XYZ values - X: {x:.0f}   Y: {y:.0f}   Z: {z:.0f}\n\n"
        for both in zip(acc, gyr, strict=True)
        for name, (x, y, z) in zip(("acceleration", "gyroscope"), both, strict=True)
    )
    path = tmp_path / "log.txt"
    path.write_text("# rate = 50 Hz\n" + text)
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, A, atol=2e-3)
    np.testing.assert_allclose(block.gyr, W, atol=1e-3)
