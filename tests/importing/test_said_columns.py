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
    assert "--temp-unit count --temp-lsb 13.5391 --temp-zero 31 (31.3 to" in said
    assert "--temp-unit degC, if it is so" in said
    assert main([*call, "--temp-unit", "degC"]) == 0
