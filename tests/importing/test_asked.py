"""What a log leaves open is asked, and what is no measurement is not taken for one."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from laid_about import G
from written_logs import (
    DEG,
    ROWS,
    SIX,
    UP,
    A,
    T,
    W,
    assert_same,
    imported,
    lines,
)

from fieldcal.cli import main
from fieldcal.importing.tables.column_physics import is_direction
from fieldcal.importing.text.labels import labelled_values
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.session.folder import Session


def test_bytes_that_are_no_text_spoil_a_row_and_not_the_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.csv"
    rows = lines(ROWS, head=f"t,{SIX}").split("\n")
    rows[20] = "\0\0\7" + rows[20]
    path.write_text("\n".join(rows) + "\n" + "\0" * 700)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "line 21" in capsys.readouterr().err
    block = Session.open(imported(path, "--repair")).block
    np.testing.assert_allclose(block.acc, np.delete(A, 19, axis=0))


@pytest.mark.parametrize(
    ("text", "question"),
    [
        (lines(np.arange(float(len(T))), A / G, DEG,
               head="Timestamp,Accel_X_g,Accel_Y_g,Accel_Z_g,Gyro_X_deg_per_s,"
               "Gyro_Y_deg_per_s,Gyro_Z_deg_per_s"), "may count rows"),
        (lines(T * 1e3, np.round(A * 16384 / G), np.round(DEG * 131.072),
               np.full(len(T), -3900.0), head=f"time_ms,{SIX},temp"), "--temp-lsb 340"),
        (lines(T, W, UP), "say what its columns are"),
        (lines(["1.70E+12"] * len(T), A, W, head=f"time,{SIX}"),
         "its time is 1.7e+12 in all rows, no time: give the rate, e.g. --rate 50"),
        (lines(["12"] * len(T), A, W), "give the rate, e.g. --rate 50"),
        (lines(np.arange(float(len(T))), A, W, head=f"t,{SIX}"),
         "or --time-unit s if a row is taken each second"),
        (lines(1e12 * np.arange(len(T)), A, W, head=f"t,{SIX}"),
         "log.csv: column t: its numbers, 0 to 8.69e+14, make 1e-12 Hz in s"),
        (lines(1e-13 * np.arange(len(T)), A, W, head=f"t,{SIX}"),
         "or skip this one with _ and give --rate"),
        (lines(1e12 * np.arange(len(T)), A, W, head=f"t (s),{SIX}"),
         "column t: its samples are 1e+12 s apart"),
        (lines(T * 1e3, A, W, head=f"time (s),{SIX}"),
         "makes 0.05 Hz, and in ms it is 50 Hz: add --time-unit ms or --time-unit s"),
        (lines(1e-13 * np.arange(len(T)), A, W, head=f"t (s),{SIX}"),
         "column t: its samples come 1e+13 times a second"),
        (lines(T, A, W, head=f"time (ms),{SIX}"),
         "makes 5e+04 Hz, and in s it is 50 Hz: add --time-unit s or --time-unit ms"),
        (lines(np.round(np.arange(len(T)) * 1.5) + 115, DEG, A / G,
               head="Packet number,Gyroscope X (deg/s),Gyroscope Y (deg/s),"
               "Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),"
               "Accelerometer Z (g)"), "no column is t"),
        (lines(np.floor(T / 2.56), np.round(T % 2.56 * 50), W, A,
               head="series_id,measurement_number,angular_velocity_X,"
               "angular_velocity_Y,angular_velocity_Z,linear_acceleration_X,"
               "linear_acceleration_Y,linear_acceleration_Z"), "no column is t"),
    ],
    ids=["rows that are counted", "a thermometer's counts", "a direction",
         "a time that a spreadsheet shortened", "a time that stays, without a name",
         "seconds or rows", "too slow in any unit", "too fast in any unit",
         "too slow as it says",
         "ms that are called s", "too fast as it says", "s that are called ms",
         "messages that are counted",
         "rows of pieces that are counted"],
)  # fmt: skip
def test_what_would_be_wrong_in_silence_is_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, question: str
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text + "\n")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    assert question in capsys.readouterr().err


def test_a_time_that_stays_is_refused_as_such_where_the_user_names_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(lines(["12"] * len(T), A, W) + "\n")
    assert main(["import", str(path), "--columns", f"t,{SIX}"]) == 2
    assert "column t is 12 in all rows, so it is no time" in capsys.readouterr().err


@pytest.mark.parametrize("head", ["", "t,acc_x,acc_y,acc_z,q_w,q_x,q_y,q_z"])
def test_an_attitude_is_no_rate(
    tmp_path: Path, head: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path, angle = tmp_path / "log.csv", np.cumsum(W, axis=0) / 50 / 2
    attitude = np.column_stack([np.ones(len(T)), np.tan(angle / 2)])
    attitude /= np.linalg.norm(attitude, axis=1)[:, None]
    path.write_text(lines(T, A, np.round(attitude, 2), head=head) + "\n")
    block = Session.open(imported(path)).block
    np.testing.assert_allclose(block.acc, A, atol=1e-6)
    assert np.isnan(block.gyr).all()
    assert "nothing says what they are" not in capsys.readouterr().out


@pytest.mark.parametrize("name", ["T", "t", "T1"])
def test_a_letter_behind_the_axes_is_a_thermometer_by_its_numbers(
    tmp_path: Path, name: str
) -> None:
    path, warm = tmp_path / "log.csv", 24 + 0.1 * np.floor(T / 4)
    path.write_text(
        lines(A, DEG, warm, head=f"# Sample rate: 50 Hz\n{SIX},{name}") + "\n"
    )
    folder = imported(path)
    assert_same(folder)
    np.testing.assert_allclose(Session.open(folder).block.temperature, warm)


def test_letters_behind_the_axes_are_no_times_and_which_is_near_nobody_knows(
    tmp_path: Path,
) -> None:
    path, warm = tmp_path / "log.csv", 24 + 0.1 * np.floor(T / 4)
    text = lines(T * 1e3, A, DEG, warm, warm + 5, head=f",{SIX},T1,T2")
    path.write_text(text + "\n")
    folder = imported(path)
    assert_same(folder)
    assert np.isnan(Session.open(folder).block.temperature).all()


def test_a_dump_of_bytes_in_one_line_is_refused_soon() -> None:
    dump = "AA FF F2 18 " * 20000
    assert labelled_values(dump) == [] and heading_meaning(dump) is None


def test_a_direction_is_one_though_a_row_is_not_whole() -> None:
    bad = UP.copy()
    bad[7, 1] = np.nan
    with warnings.catch_warnings(action="error"):
        assert is_direction(UP) and is_direction(bad)
        assert not is_direction(A) and not is_direction(np.full((9, 3), np.nan))
