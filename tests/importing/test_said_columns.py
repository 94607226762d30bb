"""What the user says of columns, with what stands over them or is in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laid_about import G, write
from written_logs import DEG, A, T, W, assert_same, imported

from fieldcal.cli import main
from fieldcal.session.folder import Session


def test_steps_that_grow_are_the_time_also_where_the_user_says_steps(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = np.column_stack([np.round(1e3 * T), A, W])
    path = write(tmp_path, rows)
    out = tmp_path / "out"
    call = ["import", str(path), "-o", str(out), "--columns", "dt,ax,ay,az,gx,gy,gz"]
    assert main(call) == 0
    assert "column dt grows from row to row" in capsys.readouterr().err
    np.testing.assert_allclose(np.ptp(Session.open(out).block.t), np.ptp(T), rtol=1e-3)


def test_steps_that_count_rows_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, np.column_stack([np.arange(len(T)), A, W]))
    call = ["import", str(path), "-o", str(tmp_path / "out")]
    assert main([*call, "--columns", "dt,ax,ay,az,gx,gy,gz"]) == 2
    assert "--columns _,ax,ay,az,gx,gy,gz --rate" in capsys.readouterr().err


def test_units_over_columns_hold_where_the_user_says_no_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heading = "t (ms),up (g),left (g),front (g),p (deg/s),q (deg/s),r (deg/s)"
    path = write(tmp_path, np.column_stack([1e3 * T, A / G, DEG]), heading=heading)
    out = tmp_path / "out"
    call = ["import", str(path), "-o", str(out), "--columns", "t,ax,ay,az,gx,gy,gz"]
    assert main(call) == 0
    said = capsys.readouterr().err
    assert "--acc-unit g --gyr-unit deg/s --time-unit ms" in said
    assert_same(out)


def test_a_unit_of_the_user_goes_before_that_over_the_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heading = "t (s),x (g),y (g),z (g)"
    path = write(tmp_path, np.column_stack([T, A]), heading=heading)
    out = tmp_path / "out"
    call = ["import", str(path), "-o", str(out), "--columns", "t,ax,ay,az"]
    assert main([*call, "--acc-unit", "m/s^2"]) == 0
    assert "--acc-unit g" not in capsys.readouterr().err
    assert main(call[:-2] + ["--columns", "t,ax,ay,az", "-o", str(out) + "2"]) == 2
    assert "the names of its columns say g" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("heading", "told"),
    [("time,x,y,z", "the names of its columns and of the file"),
     ("", "the name of the file"),
     ("time,ax,ay,az", "the names of its columns")],
)  # fmt: skip
def test_what_named_the_sensor_is_said(
    tmp_path: Path, heading: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    imported(write(tmp_path, np.column_stack([T, A]), "accelerometer.csv", heading))
    assert f"taken from {told}: --columns t,ax,ay,az" in capsys.readouterr().err


def test_small_temperatures_beside_800_counts_in_a_g_may_be_counts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    warm = np.round(np.linspace(4, 6, len(T)))
    rows = np.column_stack([T, np.round(800 * A / G), np.round(10 * DEG), warm])
    path = write(tmp_path, rows, heading="t,ax,ay,az,gx,gy,gz,TEMP_OUT")
    call = ["import", str(path), "-o", str(tmp_path / "out")]
    assert main(call) == 2
    said = capsys.readouterr().err
    assert "--temp-lsb 13.5391 --temp-zero 31 (ADIS16448: 31.3 to" in said
    assert "--temp-unit degC, if it is so" in said
    assert main([*call, "--temp-unit", "degC"]) == 0


def test_rates_beside_cm_s2_are_in_sixteenths(tmp_path: Path) -> None:
    """Those of a full scale of 2000 deg/s are 2 % more, and both fit the turns."""
    rows = np.column_stack([T * 1e3, np.round(100 * A), np.round(16 * DEG)])
    path = write(tmp_path, rows, heading="ms,ax,ay,az,gx,gy,gz")
    call = ["import", str(path), "-o", str(tmp_path / "out")]
    assert main([*call, "--acc-unit", "cm/s^2"]) == 0
    gyr = Session.open(tmp_path / "out").block.gyr
    np.testing.assert_allclose(gyr, np.deg2rad(rows[:, 4:] / 16), rtol=1e-9)


def test_rows_without_a_value_may_have_another_clock(tmp_path: Path) -> None:
    """A device writes what its filter computes in rows between, a little late."""
    lines = [
        "state,time,accX,accY,accZ,gyroX,gyroY,gyroZ,estAccelX,estAccelY,estAccelZ"
    ]
    for t, a, w in zip(T.tolist(), A.tolist(), W.tolist(), strict=True):
        six = ",".join(f"{x:.8g}" for x in (*a, *w))
        three = ",".join(f"{x:.8g}" for x in a)
        lines += [f"S,{t + 1:.4f},{six},,,", f"S,{t + 0.9995:.4f},,,,,,,{three}"]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    assert_same(imported(path))


def test_forces_that_were_turned_are_not_those_of_another_imu(tmp_path: Path) -> None:
    names = [
        *(f"raw_acceleration_{x}_gs" for x in "xyz"),
        *(f"raw_rotated_acceleration_{x}_gs" for x in "xyz"),
        *(f"raw_angular_rate_{x}_deg_per_s" for x in "xyz"),
    ]
    level = np.tile([0.0, 0.01, 1.0], (len(T), 1))
    rows = np.column_stack([T, A / G, level, DEG])
    heading = ",".join(["timestamp_seconds", *names])
    assert_same(imported(write(tmp_path, rows, heading=heading)))


@pytest.mark.parametrize(("per_ms2", "asked"), [(100.0, True), (1000 / G, False)])
def test_what_reads_as_cm_or_mg_is_asked_about(
    tmp_path: Path, per_ms2: float, asked: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """They are 2 % apart, which nothing else would show."""
    length = np.linalg.norm(A, axis=1, keepdims=True)
    rows = np.column_stack([T, np.round(G * A / length * per_ms2, 1), W])
    path = write(tmp_path, rows, heading="t,ax,ay,az,gx,gy,gz")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2 * asked
    said = capsys.readouterr().err
    expected = "add --acc-unit cm/s^2 or --acc-unit mg" if asked else "taken as mg"
    assert expected in said


def test_flags_beside_the_axes_are_no_imu(tmp_path: Path) -> None:
    """Axes come in any order, each with a column that says whether it is valid."""
    names, columns = ["Time"], [T]
    for kind, three in (("Accel", A / G), ("Gyro", W)):
        for i in (2, 0, 1):
            name = f"node-1.2:scaled{kind}{'XYZ'[i]}"
            names += [name, f"{name}:valid"]
            columns += [three[:, i], np.ones(len(T))]
    path = write(tmp_path, np.column_stack(columns), heading=",".join(names))
    assert_same(imported(path))


def test_an_imu_that_is_not_there_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = []
    for a, w in zip(A.tolist(), W.tolist(), strict=True):
        lines += ["IMU,0x69," + ",".join(["0.000"] * 6)]
        lines += ["IMU,0x68," + ",".join(f"{x:.8g}" for x in (*a, *w))]
    path = tmp_path / "log.txt"
    path.write_text("\n".join(lines) + "\n")
    rate = f"{1 / float(np.diff(T).mean()):.6g}"
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out), "--rate", rate]) == 0
    assert "0x69 holds only zeros: it is left out" in capsys.readouterr().err
    np.testing.assert_allclose(Session.open(out).block.acc, A, atol=1e-5)
