"""Columns that nobody names: told by names, by physics, or asked about."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from laid_about import G, turned, write

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

TRIADS = {"a": slice(1, 4), "g": slice(4, 7)}


def imported(path: Path, *more: str) -> Session:
    folder = path.parent / "out"
    assert main(["import", str(path), "-o", str(folder), *more]) == 0
    return Session.open(folder)


def assert_same(session: Session, rows: Array) -> None:
    np.testing.assert_allclose(session.block.t, rows[:, 0], atol=1e-6)
    np.testing.assert_allclose(session.block.acc, rows[:, 1:4], rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(session.block.gyr, rows[:, 4:], rtol=1e-5, atol=1e-6)


@settings(
    max_examples=4,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.integers(0, 2**20), st.permutations(["t", "a", "g", "m", "counter", "warm"]),
    st.booleans(),
)  # fmt: skip
def test_columns_without_names_are_told_whatever_their_order(
    tmp_path_factory: pytest.TempPathFactory, seed: int, order: list[str], field: bool
) -> None:
    rows = turned(seed, 50.0)
    rng = np.random.default_rng(seed)
    # a magnetometer turns like gravity, but has not its length
    across = np.roll(rows[:, 1:4], 1, axis=1) * 4.6 + rng.normal(0, 0.3, (len(rows), 3))
    parts = {
        "t": rows[:, :1], "a": rows[:, 1:4], "g": rows[:, 4:],
        "counter": np.arange(len(rows))[:, None] % 100,
        "warm": np.round(25 + np.arange(len(rows))[:, None] / 900, 1),
    } | ({"m": across} if field else {})  # fmt: skip
    log = np.column_stack([parts[name] for name in order if name in parts])
    path = write(tmp_path_factory.mktemp("log"), log)
    session = imported(path)
    assert_same(session, rows)
    why = session.about.raw["guessed"]["columns"]
    assert "gravity turns" in why and "t" in why.partition(":")[0].split(",")


@pytest.mark.parametrize(
    "heading",
    ["t,tx,ty,tz,wx,wy,wz", "t (s),x (m/s^2),y (m/s^2),z (m/s^2),x (rad/s),y (rad/s),"
     "z (rad/s)", "time,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\ns,m/s^2,m/s^2,m/s^2,"
     "rad/s,rad/s,rad/s",
     "Time [s],Accelerometer [m/s^2],,,Gyroscope [rad/s],,\n,X,Y,Z,X,Y,Z",
     "%time,field.linear_acceleration.x,field.linear_acceleration.y,"
     "field.linear_acceleration.z,field.angular_velocity.x,field.angular_velocity.y,"
     "field.angular_velocity.z", "a,b,c,d,e,f,g", "t,ax,y,z,gx,y,z",
     '"cts","Accelerometer (x) [m/s²]","(y)","(z)","Gyro (x) [rad/s]","(y)","(z)"'],
)  # fmt: skip
def test_headings_as_they_come_need_no_option(tmp_path: Path, heading: str) -> None:
    rows = turned(2, 50.0)
    assert_same(imported(write(tmp_path, rows, heading=heading)), rows)


def test_a_rate_above_the_numbers_is_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(3, 50.0)
    top = "Fs,50\nLogging Type,0\nax,ay,az,gx,gy,gz"
    assert_same(imported(write(tmp_path, rows[:, 1:], heading=top)), rows)
    said = capsys.readouterr().err
    assert "it says the rate: 'Fs,50'" in said
    assert "--columns ax,ay,az,gx,gy,gz\n" in said


@pytest.mark.parametrize(
    ("heading", "unit", "says"),
    [("", 1.0, "if rates are in rad/s"),
     ("ax,ay,az,gx [deg/s],gy [deg/s],gz [deg/s]", 180 / np.pi, "if rates are in deg/s"
      )],
)  # fmt: skip
def test_a_rate_that_nobody_says_is_asked_with_what_the_turns_say(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    heading: str,
    unit: float,
    says: str,
) -> None:
    rows = turned(4, 50.0)
    log = np.column_stack([rows[:, 1:4], unit * rows[:, 4:]])
    assert main(["import", str(write(tmp_path, log, heading=heading))]) == 2
    said = capsys.readouterr().err
    assert "give the rate, e.g. --rate 50, which its turns say" in said and says in said


@pytest.mark.parametrize(
    ("part", "factor", "answer"),
    [(slice(1, 4), 1 / G, "--acc-unit g or"),
     (slice(4, 7), 180 / np.pi, "--gyr-unit deg/s or")],
)  # fmt: skip
def test_a_heading_that_physics_contradicts_is_asked_about(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    part: slice,
    factor: float,
    answer: str,
) -> None:
    rows = turned(5, 50.0)
    heading = "t [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]"
    log = rows.copy()
    log[:, part] *= factor
    path = write(tmp_path, log, heading=heading)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert answer in said and said.count("\n") == 1
    option, unit = answer.split()[:2]
    assert_same(imported(path, option, unit), rows)


def test_a_heading_that_rests_contradict_is_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Noise of 0.1 in sixteenths, as of deg/s; in rad/s gravity would turn by it."""
    rng = np.random.default_rng(11)
    acc = rng.normal([0.5, -5.1, 8.3], 0.015, (600, 3))
    gyr = np.round(rng.normal(0, 0.15, (600, 3)) * 16) / 16
    rows = np.column_stack([np.arange(600) / 50, acc, gyr])
    heading = "t [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]"
    path = write(tmp_path, rows, heading=heading)
    assert main(["import", str(path)]) == 2
    said = capsys.readouterr().err
    assert "gravity would turn by" in said and "add --gyr-unit deg/s or" in said
    rows[:, 4:] = np.deg2rad(gyr)
    assert_same(imported(write(tmp_path, rows, heading=heading)), rows)


def test_a_time_that_counts_rows_beside_axes_of_no_name_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(15, 50.0)[:, :4]
    rows[:, 0] = np.arange(len(rows))
    heading = "timestamp,signal_x,signal_y,signal_z"
    assert main(["import", str(write(tmp_path, rows, heading=heading))]) == 2
    said = capsys.readouterr().err
    assert "its timestamp only counts rows: give the rate" in said


def test_a_fast_table_and_a_bias_are_no_other_unit(tmp_path: Path) -> None:
    rng = np.random.default_rng(17)
    rate = np.repeat([0.0, 200.0, 0.0, -300.0, 0.0], 300)
    acc = rng.normal([0.6, -0.1, 9.9], 0.03, (len(rate), 3))
    gyr = np.outer(rate, [0.01, 0.015, 1.0]) + rng.normal(0, 0.1, (len(rate), 3))
    rows = np.column_stack([np.arange(len(rate)) / 50, acc, np.deg2rad(gyr)])
    log = np.column_stack([rows[:, :4], gyr])
    heading = "t,ax,ay,az,gx [deg/s],gy [deg/s],gz [deg/s]"
    assert_same(imported(write(tmp_path, log, heading=heading)), rows)


def test_a_rate_by_which_no_unit_fits_may_be_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(13, 50.0)
    counts = np.round(np.rad2deg(rows[:, 4:]) * 131.072)
    path = write(tmp_path, np.column_stack([rows[:, 1:4] / G, counts]))
    assert main(["import", str(path)]) == 2
    said = capsys.readouterr().err
    assert "--rate 50, which its turns say about, if rates are in counts, 131" in said
    assert main(["import", str(path), "--rate", "300"]) == 2
    assert "--rate 50, which makes it counts, 131.072" in capsys.readouterr().err
    rows[:, 1:4] /= G
    path = write(tmp_path, rows[:, 1:], heading="ax,ay,az," + ",".join(
        f"g{x} [rad/s]" for x in "xyz"))  # fmt: skip
    assert main(["import", str(path), "--rate", "300"]) == 2
    assert "add --rate 50 or --gyr-unit rad/s" in capsys.readouterr().err


def test_an_acceleration_beside_the_g_force_has_no_gravity(tmp_path: Path) -> None:
    rows = turned(12, 50.0)
    up = rows[:, 1:4] / np.linalg.norm(rows[:, 1:4], axis=1)[:, None]
    log = np.column_stack(
        [rows[:, 0], rows[:, 1:4] / G, rows[:, 1:4] - G * up, rows[:, 4:]]
    )
    names = "time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz"
    assert_same(imported(write(tmp_path, log, heading=names)), rows)


@pytest.mark.parametrize("unit", ["", " [m/s^2]"])
def test_what_is_less_than_gravity_in_any_unit_has_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], unit: str
) -> None:
    rows = turned(6, 50.0)[:, :4]
    rows[:, 1:] = np.random.default_rng(6).normal(0, 0.02, (len(rows), 3))
    names = ",".join(f"{x}{unit}" for x in "zyx")
    path = write(tmp_path, rows, "Accelerometer.csv", f"time,{names}")
    assert main(["import", str(path)]) == 2
    said = capsys.readouterr().err
    assert "taken out of these accelerations" in said and "log those with" in said


@pytest.mark.parametrize(
    ("width", "such"), [(3, "ax,ay,az;"), (12, "t,ax,ay,az,gx,gy,gz,_,_,_,_,_;")]
)
def test_columns_are_asked_for_as_many_as_there_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], width: int, such: str
) -> None:
    rows = np.random.default_rng(width).normal(0, 1, (300, width))
    assert main(["import", str(write(tmp_path, rows))]) == 2
    assert f"such as --columns {such}" in capsys.readouterr().err


def test_columns_behind_those_that_are_named_may_be_skipped_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(14, 50.0)
    path = write(tmp_path, np.hstack([rows, np.ones((len(rows), 40))]))
    named = "t,ax,ay,az,gx,gy,gz"
    assert main(["import", str(path), "--columns", named]) == 2
    assert "_... at the end skips the others" in capsys.readouterr().err
    assert_same(imported(path, "--columns", f"{named},_..."), rows)


def test_accelerations_without_gravity_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(6, 50.0)
    rows[:, 1:4] = np.random.default_rng(6).normal(0, 0.02, (len(rows), 3))
    names = ",".join(f"linear_acceleration_{x} [m/s^2]" for x in "xyz")
    path = write(tmp_path, rows, heading=f"t [s],{names},gx,gy,gz")
    assert main(["import", str(path)]) == 2
    assert "gravity was taken out" in capsys.readouterr().err
    bare = ",".join(f"box-12:estLinearAccel{x},box-12:valid" for x in "ZXY")
    log = np.insert(rows[:, :4], [2, 3, 4], 1.0, axis=1)
    assert main(["import", str(write(tmp_path, log, heading=f"Time,{bare}"))]) == 2
    assert "less than gravity reads in any unit" in capsys.readouterr().err


def test_a_unit_of_the_users_that_physics_contradicts_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, turned(7, 50.0), heading="t,ax,ay,az,gx,gy,gz")
    imported(path, "--acc-unit", "g")
    said = capsys.readouterr().err
    assert "g as you say, but |a| at rest is 96" in said


def test_several_imus_go_into_folders_of_their_own(tmp_path: Path) -> None:
    rows, other = turned(8, 50.0), turned(9, 50.0)
    heading = "t," + ",".join(
        f"imu{k}_{c}{x}" for k in (0, 1) for c in "ag" for x in "xyz"
    )
    n = min(len(rows), len(other))
    path = write(tmp_path, np.hstack([rows[:n], other[:n, 1:]]), heading=heading)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    assert_same(Session.open(tmp_path / "out" / "0"), rows[:n])
    assert_same(
        Session.open(tmp_path / "out" / "1"), np.c_[rows[:n, :1], other[:n, 1:]]
    )


@pytest.mark.parametrize("ticks", [1e4, pytest.param(1e6, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("said", [True, False])
def test_ticks_of_a_device_are_told_by_the_rate_or_by_their_name(
    tmp_path: Path, ticks: float, said: bool
) -> None:
    rows = turned(4, 50.0)
    log = rows * [ticks, *[1.0] * 6]
    log[:, 0] = np.round(log[:, 0])
    name = "Time" if said else "SampleTimeFine"
    heading = f"{name},Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z"
    top = "// Update Rate: 50.0Hz\n" if said else ""
    session = imported(write(tmp_path, log, heading=top + heading))
    assert_same(session, rows)
    assert session.about.raw["guessed"]["time"].startswith(
        "0.1ms" if ticks == 1e4 else "us"
    )


@pytest.mark.parametrize(
    ("rate", "says"),
    [("50", ""), ("76", "its times make 50 Hz, not 76 Hz as you say"),
     ("3000", "its times make 3000 Hz in no usual unit")],
)  # fmt: skip
def test_a_rate_beside_times_tells_their_unit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rate: str, says: str
) -> None:
    """They were taken for seconds: a recording of a minute lasted a day."""
    rows = turned(16, 50.0)
    log = rows.copy()
    log[:, 0] *= 1e3
    path = write(tmp_path, log, heading="t,ax,ay,az,gx,gy,gz")
    if rate == "3000":
        assert main(["import", str(path), "--rate", rate]) == 2
    else:
        session = imported(path, "--rate", rate)
        assert_same(session, rows)
        assert "sampling" not in session.about.raw
        assert session.about.raw["guessed"]["time"] == f"ms: you say {rate} Hz"
    assert says in capsys.readouterr().err


def test_days_of_a_spreadsheet_are_seconds(tmp_path: Path) -> None:
    rows = turned(5, 50.0)
    days = np.column_stack([45415.9 + rows[:, 0] / 86400, rows[:, 1:]])
    lines = [",".join([f"{r[0]:.11f}", *(f"{x:.9g}" for x in r[1:])]) for r in days]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["Time,ax,ay,az,gx,gy,gz", *lines]))
    session = imported(path)
    np.testing.assert_allclose(session.block.t, rows[:, 0], atol=1e-5)


def clocks(rows: Array) -> dict[str, Array]:
    """Times of the same rows as three loggers write them, s."""
    t = rows[:, 0] + 0.33
    arrives = np.array([t[min(8 * (i // 8) + 7, len(t) - 1)] for i in range(len(t))])
    return {
        "whole seconds": np.floor(t),
        "tenths": np.floor(10 * t) / 10,
        "arrival": arrives + 1e-4 * (np.arange(len(t)) % 8),
    }


@pytest.mark.parametrize("kind", ["whole seconds", "tenths", "arrival"])
def test_rows_that_share_a_time_are_spread_evenly(
    tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(6, 50.0, sides=7)
    shared = np.column_stack([clocks(rows)[kind], rows[:, 1:]])
    path = write(tmp_path, shared, heading="time,ax,ay,az,gx,gy,gz")
    session = imported(path)
    said = " ".join(capsys.readouterr().err.split())
    assert "they are spread evenly, 50 Hz" in said
    assert "spread evenly" in (session.folder / "session.toml").read_text()
    off = session.block.t - rows[:, 0]
    assert np.ptp(off) < 0.011 and np.abs(np.diff(off)).max() < 0.005


@pytest.mark.parametrize("rate", [105.0, 130.0, 190.0])
def test_rows_between_the_steps_of_a_clock_are_kept(
    tmp_path: Path, rate: float, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(6, rate, 1.0)
    coarse = np.column_stack([np.floor(100 * rows[:, 0]) / 100, rows[:, 1:]])
    path = write(tmp_path, coarse, heading="time,ax,ay,az,gx,gy,gz")
    session = imported(path)
    said = " ".join(capsys.readouterr().err.split())
    assert "its clock steps by 0.01, and" in said
    assert "% of its rows have the time of the row before" in said
    assert len(session.block) == len(rows)
    assert np.abs(session.block.t - rows[:, 0]).max() < 0.01


@pytest.mark.parametrize("name", ["delta_ms", "interval (ms)", "dt_ms"])
def test_the_time_since_the_row_before_is_no_time_of_day(
    tmp_path: Path, name: str
) -> None:
    rows = turned(6, 50.0)
    since = np.column_stack([np.full(len(rows), 20.0), rows[:, 1:]])
    path = write(tmp_path, since, heading=f"{name},ax,ay,az,gx,gy,gz")
    assert_same(imported(path), rows)


def test_a_file_of_one_sensor_may_begin_with_its_times(tmp_path: Path) -> None:
    """Without names, and joined by what the files are called."""
    rows = turned(6, 50.0)
    for name, own in (("accelerometer", [0, 1, 2, 3]), ("gyro", [0, 4, 5, 6])):
        write(tmp_path, rows[:, own], name=f"{name}.csv")
    files = [str(tmp_path / f"{name}.csv") for name in ("accelerometer", "gyro")]
    out = tmp_path / "out"
    assert main(["import", *files, "--join", "-o", str(out)]) == 0
    assert_same(Session.open(out), rows)


def test_the_rate_is_asked_with_the_scale_that_usually_stands_beside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(6, 50.0)
    counts = np.hstack([rows[:, 1:4] / 9.80665 * 800, 10 * np.rad2deg(rows[:, 4:])])
    path = write(tmp_path, np.round(counts), heading="ax,ay,az,gx,gy,gz")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = re.search(
        r"--rate ([\d.]+), which .* counts, 10 in", capsys.readouterr().err
    )
    assert said is not None and abs(float(said[1]) - 50) < 1


def test_rows_that_arrive_together_now_and_then_are_kept(tmp_path: Path) -> None:
    rows = turned(6, 100.0)
    late = np.arange(len(rows)) // 20 * 20 + 15
    waits = (np.arange(len(rows)) % 20 >= 13) & (np.arange(len(rows)) < late)
    came = rows[
        np.where(waits, np.minimum(late, len(rows) - 1), np.arange(len(rows))), 0
    ]
    path = write(
        tmp_path, np.column_stack([came, rows[:, 1:]]), heading="t,ax,ay,az,gx,gy,gz"
    )
    session = imported(path)
    assert len(session.block) == len(rows)
    assert np.abs(session.block.t - rows[:, 0]).max() < 0.03
    np.testing.assert_allclose(session.block.acc, rows[:, 1:4], atol=1e-6)


def test_rows_of_which_now_more_now_fewer_share_a_time_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(6, 50.0)
    many = np.random.default_rng(1).integers(2, 90, 200)
    coarse = np.repeat(np.arange(len(many)), many)[: len(rows)]
    path = write(
        tmp_path, np.column_stack([coarse, rows[:, 1:]]),
        heading="time,ax,ay,az,gx,gy,gz",
    )  # fmt: skip
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    asks = r"about \d+ rows in each.*add --columns _,ax,ay,az,gx,gy,gz --rate"
    assert re.search(asks, capsys.readouterr().err)
    answer = ("--columns", "_,ax,ay,az,gx,gy,gz", "--rate", "50")
    assert_same(imported(path, *answer), rows)


def test_axes_without_a_name_beside_gyroscopes_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(7, 50.0)
    rng = np.random.default_rng(7)
    # raw, about a zero far away, and hardly turned: physics cannot tell what they are
    still = np.round([33000, 33000, 35048] + rng.normal(0, 9, (len(rows), 3)))
    log = np.column_stack([rows[:, 0], still, rng.normal(0, 1e-3, (len(rows), 3))])
    path = write(tmp_path, log, heading="t,u1,u2,u3,gx,gy,gz")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "whether u1 u2 u3 are the accelerometers" in said
    assert "add --columns t,ax,ay,az,gx,gy,gz if they are" in said
    assert "or --columns t,_,_,_,gx,gy,gz" in said
    session = imported(path, "--columns", "t,_,_,_,gx,gy,gz")
    assert np.isnan(session.block.acc).all()


@pytest.mark.parametrize("heading", ["", "t,u 0,u 1,u 2,force 0,force 1,force 2"])
def test_what_does_not_turn_as_gravity_does_is_no_rate(
    tmp_path: Path, heading: str, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(3, 50.0)
    others = np.random.default_rng(3).normal(0, 9.0, (len(rows), 3))
    others[:, 0] = np.arange(len(rows)) % 256
    log = np.column_stack([rows[:, 0], others, rows[:, 1:4]])
    session = imported(write(tmp_path, log, heading=heading))
    assert "and no others turn as they do" in capsys.readouterr().err
    assert np.isnan(session.block.gyr).all()
    np.testing.assert_allclose(session.block.acc, rows[:, 1:4], atol=1e-6)


def test_an_axis_that_rests_within_a_step_is_one_of_three(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """At 256 counts in a g noise does not show on every axis."""
    rng = np.random.default_rng(8)
    counts = np.round([-1.0, 1.5, 254.0] + rng.normal(0, 0.1, (160, 3)))
    assert [len(np.unique(axis)) for axis in counts.T] == [1, 2, 1]
    rates = rng.normal(0, 1e-3, (160, 3))
    log = np.column_stack([np.arange(160) / 50.0, counts, rates])
    path = write(tmp_path, log, heading="t,tx,ty,tz,wx,wy,wz")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "whether tx ty tz are the accelerometers" in capsys.readouterr().err


def test_words_for_nothing_are_missing_numbers(tmp_path: Path) -> None:
    rows = turned(8, 50.0)
    path = write(tmp_path, rows, heading="t,ax,ay,az,gx,gy,gz")
    lines = path.read_text().split("\n")
    for i, word in enumerate(("null", "NaN", "N/A", "None", "-"), 40):
        cells = lines[i].split(",")
        lines[i] = ",".join([*cells[:4], *[word] * 3])
    path.write_text("\n".join(lines))
    session = imported(path)
    assert len(session.block) == len(rows)
    assert np.isnan(session.block.gyr).any(axis=1).sum() == 5


def test_a_question_about_the_second_imu_leaves_nothing_of_the_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows, other = turned(9, 50.0), turned(10, 50.0)
    # nothing turns the second one, and its numbers are no rad/s at rest
    other[:, 4:] = np.random.default_rng(9).normal(40.0, 0.5, (len(other), 3))
    n = min(len(rows), len(other))
    names = [f"imu{i}_{kind}{x}" for i in (0, 1) for kind in "ag" for x in "xyz"]
    log = np.column_stack([rows[:n], other[:n, 1:]])
    path = write(tmp_path, log, heading=",".join(["t", *names]))
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 2
    said = capsys.readouterr().err
    assert "--gyr-unit deg/s" in said and "removed again" in said
    assert not list(out.iterdir())
    answer = ("--gyr-unit", "rad/s")
    assert main(["import", str(path), "-o", str(out), *answer]) == 0
    assert sorted(one.name for one in out.iterdir()) == ["0", "1"]


@pytest.mark.parametrize(
    ("heading", "before", "behind"),
    [("t,ax,ay,az,gx,gy,gz,", "", ""), ("t,ax,ay,az,gx,gy,gz", "", ","),
     ("t,ax,ay,az,gx,gy,gz", "7,", "")],
)  # fmt: skip
def test_names_are_never_put_over_other_columns(
    tmp_path: Path, heading: str, before: str, behind: str
) -> None:
    rows = turned(11, 50.0)
    lines = (",".join(f"{x:.10g}" for x in row) for row in rows)
    path = tmp_path / "log.csv"
    text = "\n".join([heading, *(f"{before}{line}{behind}" for line in lines)])
    path.write_text(text + "\n")
    assert_same(imported(path), rows)


def test_columns_of_a_text_are_chosen_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(12, 50.0)
    path = write(tmp_path, rows, heading="clock,u1,u2,u3,v1,v2,v3")
    named = "t=clock,ax=u1,ay=u2,az=u3,gx=v1,gy=v2,gz=v3"
    assert_same(imported(path, "--columns", named), rows)
    out = str(tmp_path / "other")
    wrong = ["--columns", named.replace("u1", "w1"), "-o", out]
    assert main(["import", str(path), *wrong]) == 2
    assert "there are clock, u1, u2" in capsys.readouterr().err


@pytest.mark.parametrize("pause", [20.0, 300.0])
def test_bursts_with_pauses_between_are_no_batches(
    tmp_path: Path, pause: float
) -> None:
    rows = turned(9, 50.0)
    t = rows[:, 0] + pause * np.floor(rows[:, 0] / 2.0)
    path = write(
        tmp_path, np.column_stack([t, rows[:, 1:]]), heading="time,ax,ay,az,gx,gy,gz"
    )
    session = imported(path, "--gyr-unit", "rad/s")
    np.testing.assert_allclose(session.block.t, t, atol=1e-9)


@pytest.mark.parametrize("name", ["table rate (deg/s)", "speed", "angle [deg]"])
def test_what_a_table_was_told_is_no_time_though_it_grows(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    told = np.arange(-200.0, 201.0, 50.0)
    read = np.column_stack([told * f + b for f, b in ((1.01, 0.5), (0.99, -1), (1, 0))])
    head = f"{name},gyro x (deg/s),gyro y (deg/s),gyro z (deg/s)"
    path = write(tmp_path, np.column_stack([told, read]), heading=head)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "no column is t, the time: give the rate" in capsys.readouterr().err


@pytest.mark.parametrize("integrated", [False, True])
def test_gravity_tells_rates_that_are_called_as_angles(
    tmp_path: Path, integrated: bool
) -> None:
    """Both the rate and the angle that is integrated from it are called gyro_roll."""
    rows = turned(8, 50.0, 2.0)
    if integrated:
        rows[:, 4:] = np.cumsum(rows[:, 4:], axis=0) / 50.0
    names = "accelForward,accelLeft,accelUp,gyro_roll,gyro_pitch,gyro_yaw"
    path = write(tmp_path, rows, heading=f"time,{names}")
    session = imported(path)
    if integrated:
        assert np.isnan(session.block.gyr).all()
        np.testing.assert_allclose(session.block.acc, rows[:, 1:4], rtol=1e-5)
    else:
        assert_same(session, rows)


@pytest.mark.parametrize(
    ("heading", "says"),
    [
        ("ax,ay,az,gx,gy,gz", "columns in a unit that import works out"),
        ("ax [g],ay [g],az [g],gx [deg/s],gy [deg/s],gz [deg/s]", "columns in g, deg/"),
        ("ax [g],ay [g],az [g],gx,gy,gz", "columns in g, a unit that import works out"),
    ],
)
def test_a_list_names_the_units_that_are_stated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], heading: str, says: str
) -> None:
    """And no others: an import works them out, and may find another than SI."""
    rows = [f"{i / 100:.2f},0.01,0.02,1.0,0.1,0.2,{0.1 * (i % 7)}" for i in range(300)]
    (tmp_path / "log.csv").write_text("\n".join([f"t [s],{heading}", *rows, ""]))
    assert main(["import", str(tmp_path / "log.csv"), "--list"]) == 0
    assert says in capsys.readouterr().out
