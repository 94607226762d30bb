"""Rates of a vehicle that is driven or flown: no turn of gravity tells their unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.units.calm_rates import (
    DEG,
    RAD,
    guess_unit_of_calm_rates,
    unit_of_steps,
)
from fieldcal.importing.units.rate_size import TurnComparison
from fieldcal.session.folder import Session

G, RATE = 9.80665, 50.0
ROS = (
    "%time,field.header.seq,field.header.stamp,"
    + ",".join(f"field.angular_velocity.{x}" for x in "xyz")
    + ","
    + ",".join(f"field.linear_acceleration.{x}" for x in "xyz")
)


def driven(seed: int, trembles: float = 0.02) -> Array:
    """Rows t, a, w of a car between two rests, which turns and pitches, SI."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(60 * RATE)) / RATE
    drives = (t > 15) & (t < 50)
    yaw = drives * 0.2 * np.sin(2 * np.pi * t / 9)
    pitch = drives * 0.03 * np.sin(2 * np.pi * t / 2.5)
    a = [0, 0, G] + rng.normal(0, 0.02, (len(t), 3))
    a[drives] += rng.normal(0, 0.4, (drives.sum(), 3))
    w = np.array([0.01, -0.02, 0.005]) + rng.normal(0, 0.004, (len(t), 3))
    a[:, 0] -= G * pitch
    w[:, 1] += np.gradient(pitch, t)
    w[:, 2] += yaw
    w[drives] += rng.normal(0, trembles, (drives.sum(), 3))
    return np.column_stack([t, a, w])


def write(path: Path, table: Array, head: str) -> Path:
    rows = [",".join(f"{x:.10g}" for x in row) for row in table.tolist()]
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def block(tmp_path: Path, code: int = 0) -> Array:
    assert main(["import", str(tmp_path / "log.csv"), "-o", f"{tmp_path}/out"]) == code
    found = Session.open(tmp_path / "out").block
    return np.column_stack([found.t, found.acc, found.gyr])


def test_degrees_are_told_by_a_gravity_that_does_not_turn(tmp_path: Path) -> None:
    rows = driven(1)
    table = np.column_stack([rows[:, :4], np.rad2deg(rows[:, 4:])])
    write(tmp_path / "log.csv", table, "time,ax,ay,az,gx,gy,gz")
    np.testing.assert_allclose(block(tmp_path), rows, atol=1e-6)


def test_thousandths_of_radians_are_not_taken_for_degrees(tmp_path: Path) -> None:
    rows = driven(1)
    table = np.column_stack([rows[:, :4], 1e3 * rows[:, 4:]])
    path = write(tmp_path / "log.csv", table, "time,ax,ay,az,gx,gy,gz")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2


def test_radians_of_names_that_tell_no_unit_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = driven(2, trembles=0.2)
    path = write(tmp_path / "log.csv", rows, "time,ax,ay,az,gx,gy,gz")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "add --gyr-unit deg/s or --gyr-unit rad/s, if it is so" in said


@pytest.mark.parametrize("head", [ROS, "timestamp,seq,stamp,"
    "gyro_rad[0],gyro_rad[1],gyro_rad[2],"
    "accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2]"],
    ids=["ROS", "PX4"])  # fmt: skip
def test_names_tell_radians(tmp_path: Path, head: str) -> None:
    rows = driven(3)
    t = rows[:, :1] * 1e9
    n = np.arange(float(len(rows)))
    table = np.column_stack([t, n, t, rows[:, 4:], rows[:, 1:4]])
    write(tmp_path / "log.csv", table, head)
    np.testing.assert_allclose(block(tmp_path), rows, atol=1e-6)


def test_degrees_below_names_of_ros_are_degrees(tmp_path: Path) -> None:
    rows = driven(4)
    t, n = rows[:, :1] * 1e9, np.arange(float(len(rows)))
    table = np.column_stack([t, n, t, np.rad2deg(rows[:, 4:]), rows[:, 1:4]])
    write(tmp_path / "log.csv", table, ROS)
    np.testing.assert_allclose(block(tmp_path), rows, atol=1e-6)


def test_a_message_has_the_time_of_its_header_and_not_of_its_arrival(
    tmp_path: Path,
) -> None:
    rows = driven(5)
    played = 1.575e18 + np.cumsum(np.full(len(rows), 1.8e9 / RATE))
    n = np.arange(float(len(rows)))
    table = np.column_stack([played, n, rows[:, 0] * 1e9, rows[:, 4:], rows[:, 1:4]])
    text = [",".join([f"{row[0]:.0f}", *(f"{x:.10g}" for x in row[1:])])
            for row in table.tolist()]  # fmt: skip
    (tmp_path / "log.csv").write_text("\n".join([ROS, *text]) + "\n")
    np.testing.assert_allclose(block(tmp_path), rows, atol=1e-6)


@pytest.mark.parametrize(
    "head",
    ["", "t,vx,vy,vz,gx,gy,gz",
     "timestamp,delta_velocity[0],delta_velocity[1],delta_velocity[2],"
     "delta_angle[0],delta_angle[1],delta_angle[2]"],
)  # fmt: skip
def test_gains_of_velocity_have_gains_of_angle_beside_them(
    tmp_path: Path, head: str
) -> None:
    rows = driven(6)
    path = write(tmp_path / "log.csv", rows / np.array([1.0, *[RATE] * 6]), head)
    # without names, the length of what velocity gained is that of gravity
    said = ["--columns", "t,ax,ay,az,gx,gy,gz"] if "vx" in head else []
    assert main(["import", str(path), "-o", str(tmp_path / "out"), *said]) == 0
    found = Session.open(tmp_path / "out").block
    np.testing.assert_allclose(found.acc, rows[:, 1:4], atol=1e-5)
    np.testing.assert_allclose(found.gyr, rows[:, 4:], atol=1e-6)


def test_whole_degrees_are_among_the_answers() -> None:
    gyr = np.round(np.random.default_rng(7).normal(0, 60, (1000, 3)))
    flown = TurnComparison(said=20.0, shown=0.1, bias=0.0)
    asked = guess_unit_of_calm_rates(gyr, flown, None, "")
    assert asked.scale is None
    assert asked.answers[:2] == (
        "--gyr-unit deg/s", "--gyr-unit deg/s --gyr-lsb 131.072")  # fmt: skip
    # at full scale only counts
    assert (
        "--gyr-unit deg/s"
        not in guess_unit_of_calm_rates(gyr * 200, flown, None, "").answers
    )


@pytest.mark.parametrize(
    ("ratio", "scale"), [(3.0, None), (15.0, None), (50.0, DEG), (900.0, None)]
)
def test_what_flies_turns_more_than_its_thrust_shows(
    ratio: float, scale: object
) -> None:
    gyr = np.random.default_rng(8).normal(0, 0.3, (1000, 3))
    found = guess_unit_of_calm_rates(
        gyr, TurnComparison(0.1 * ratio, 0.1, 0.0), None, ""
    )
    assert found.scale == scale
    named = guess_unit_of_calm_rates(
        gyr, TurnComparison(0.1 * ratio, 0.1, 0.0), None, "rad/s"
    )
    assert named.scale == (RAD if ratio < 20 else scale)


def test_rates_that_are_called_g_are_rates(tmp_path: Path) -> None:
    rows = driven(10)
    write(tmp_path / "log.csv", rows[:, [0, 4, 5, 6]], "Time,Gx,Gy,Gz")
    assert main(["import", str(tmp_path / "log.csv"), "-o", f"{tmp_path}/out"]) == 0
    found = Session.open(tmp_path / "out").block
    np.testing.assert_allclose(found.gyr, rows[:, 4:], atol=1e-6)


def test_at_a_row_a_second_nothing_is_a_gain(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(11)
    t = np.arange(200.0)
    rows = np.column_stack([t, rng.normal([0, 0, G], 0.02, (200, 3)),
                            rng.normal(0, 0.002, (200, 3))])  # fmt: skip
    path = write(tmp_path / "log.csv", rows, "t,ax,ay,az,gx,gy,gz")
    said = ["--columns", "t,ax,ay,az,gx,gy,gz", "-o", f"{tmp_path}/out"]
    assert main(["import", str(path), *said]) == 0
    assert "rad/s: it is the usual one" in capsys.readouterr().err


@pytest.mark.parametrize("lsb", [131.072, 131.0, 65.5, 16.4, 1 / 8.75e-3, 1 / 0.07])
@pytest.mark.parametrize("unit", ["deg/s", "rad/s"])
def test_the_steps_of_a_full_scale_tell_the_unit_of_a_calm_device(
    tmp_path: Path, lsb: float, unit: str
) -> None:
    """Quieter than most, so that nothing else speaks against rad/s."""
    rng = np.random.default_rng(3)
    counts = np.round([9.0, -4.0, 2.0] + rng.normal(0, 1.2, (400, 3)))
    rates = counts / lsb * (1.0 if unit == "deg/s" else np.deg2rad(1.0))
    still = np.array([0.1, -0.2, 9.8]) + rng.normal(0, 0.01, (400, 3))
    table = np.column_stack([np.arange(400) / 50, still, np.round(rates, 7)])
    path = write(tmp_path / "log.csv", table, "t,ax,ay,az,gyro_x,gyro_y,gyro_z")
    found, _ = read_files([path])
    size = np.deg2rad(counts / lsb)
    np.testing.assert_allclose(found.gyr, size, rtol=1e-3, atol=2e-7)


@pytest.mark.parametrize("digits", [5, 4])
def test_steps_are_counted_to_the_fastest_rates(digits: int) -> None:
    """Rounded to some digits, one step is not known well enough to count thousands."""
    counts = np.round(np.random.default_rng(2).normal(0, 900, (400, 3)))
    found = unit_of_steps(np.round(counts / 16.384, digits))
    assert found is not None and found.scale is not None
    assert found.scale.unit == "deg/s"


def test_beside_counts_rates_are_offered_as_counts_alone(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    acc = np.round([1000.0, -300.0, 16500.0] + rng.normal(0, 60, (500, 3)))
    gyr = np.round([-558.0, 111.0, -71.0] + rng.normal(0, 12, (500, 3)))
    rows = np.column_stack([0.02 * np.arange(500), acc, gyr])
    lines = [",".join(f"{x:g}" for x in row) for row in rows]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["t,ax,ay,az,gx,gy,gz", *lines]) + "\n")
    with pytest.raises(InputError, match=r"add --gyr-unit deg/s --gyr-lsb 131") as told:
        read_files([path])
    assert "--gyr-unit deg/s or" not in str(told.value)
