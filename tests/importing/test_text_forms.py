"""Texts as monitors, spreadsheets and loggers write them become plain columns."""

import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.text.labels import labelled_values
from fieldcal.importing.text.text_forms import forms_of
from fieldcal.importing.times.clock_text import ClockText, is_clock
from fieldcal.session.folder import Session

BEGAN = datetime(2024, 5, 3, 23, 59, 58)
RATE, ROWS = 20.0, 80
AX = np.round(0.1 * np.sin(np.arange(ROWS)), 3)
NAMES = ["ax", "ay", "az", "gx", "gy", "gz"]


def when(row: int) -> datetime:
    return BEGAN + timedelta(seconds=row / RATE)


def values(row: int) -> list[str]:
    return [f"{AX[row]:.3f}", "0.2", "9.8", "0.01", "-0.02", "0.03"]


def read(folder: Path, text: str, **wanted: float | str) -> Block:
    path = folder / "log.txt"
    path.write_text(text, encoding="utf-8")
    recording = open_recording(path, ReadOptions(**wanted))  # type: ignore[arg-type]
    (stream,) = recording.streams()
    return concat(list(recording.alone(stream.name).blocks(stream.name)))


def text(stamp: Callable[[int], str], separator: str, heading: str = "") -> str:
    head = [heading or separator.join(["time", *NAMES])]
    rows = [separator.join([stamp(i), *values(i)]) for i in range(ROWS)]
    return "\n".join(head + rows) + "\n"


CLOCKS = {
    "iso": lambda t: t.isoformat(timespec="milliseconds"),
    "iso with a zone": lambda t: t.isoformat(timespec="microseconds") + "+02:00",
    "time of day": lambda t: t.strftime("%H:%M:%S.%f")[:-3],
    "American": lambda t: t.strftime("%m/%d/%Y %I:%M:%S.%f %p"),
    "German": lambda t: t.strftime("%d.%m.%Y %H:%M:%S.%f")[:-3],
    "month by name": lambda t: t.strftime("%d-May-%Y %H:%M:%S.%f")[:-3],
    "quoted": lambda t: t.strftime('"%Y-%m-%d %H:%M:%S.%f"'),
}


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("name", CLOCKS)
def test_times_of_a_clock_are_seconds_also_over_midnight(
    tmp_path: Path, name: str, separator: str
) -> None:
    got = read(tmp_path, text(lambda i: CLOCKS[name](when(i)), separator))
    np.testing.assert_allclose(got.t, np.arange(ROWS) / RATE, atol=2e-6)
    np.testing.assert_array_equal(got.acc[:, 0], AX)


@pytest.mark.parametrize("heading", ["stamp", "date time"])
def test_a_date_and_a_time_that_a_space_parts(tmp_path: Path, heading: str) -> None:
    lines = text(lambda i: str(when(i)), " ", " ".join([heading, *NAMES]))
    lines = lines.replace(" 23:59:58 ", " 23:59:58.0 ")
    np.testing.assert_allclose(
        read(tmp_path, lines).t, np.arange(ROWS) / RATE, atol=2e-6
    )


def test_counts_behind_a_time_are_no_zone(tmp_path: Path) -> None:
    counts = [[(-1) ** (i // 3) * (1000 + i), 250, -16000] for i in range(ROWS)]
    rows = [f"{when(i)!s:.26} {' '.join(map(str, counts[i]))}" for i in range(1, ROWS)]
    rows = [row.replace(" 23:59:59 ", " 23:59:59.0 ") for row in rows]
    path = tmp_path / "log.txt"
    path.write_text("\n".join(rows) + "\n")
    wanted = ReadOptions(columns=("t", "ax", "ay", "az"))
    got = concat(list(open_recording(path, wanted).blocks("0")))
    np.testing.assert_array_equal(got.acc, counts[1:])
    np.testing.assert_allclose(np.diff(got.t), 1 / RATE, atol=2e-6)


@pytest.mark.parametrize("separator", [",", " "])
def test_a_night_in_which_clocks_are_set_back_goes_on(
    tmp_path: Path, separator: str
) -> None:
    began = datetime(2024, 10, 27, 0, 59, 58, tzinfo=UTC)

    def stamp(row: int) -> str:
        t = began + timedelta(seconds=row / RATE)
        summer = t < began.replace(hour=1, minute=0, second=0)
        berlin = t.astimezone(timezone(timedelta(hours=2 if summer else 1)))
        return berlin.isoformat(timespec="milliseconds")

    got = read(tmp_path, text(stamp, separator))
    np.testing.assert_allclose(got.t, np.arange(ROWS) / RATE, atol=2e-6)


@pytest.mark.parametrize("zone", ["+00", "-07", "+0530", " +02:00", " UTC", "Z"])
def test_zones_as_programs_write_them(zone: str) -> None:
    clock = ClockText()
    got = [clock.seconds(f"2024-05-03 12:00:0{i}.5{zone}") for i in (0, 1)]
    assert got == [43200.5, 43201.5]


def test_minutes_and_seconds_of_a_spreadsheet_begin_again_each_hour() -> None:
    clock = ClockText()
    got = [clock.seconds(one) for one in ("59:59.5", "00:00.0", "00:00.5")]
    assert got == [3599.5, 3600.0, 3600.5]


@given(st.datetimes(datetime(2001, 1, 1), datetime(2098, 1, 1)), st.integers(1, 10**6))
def test_a_clock_reads_what_was_written(start: datetime, more_ms: int) -> None:
    later = start + timedelta(milliseconds=more_ms)
    basic = ["%Y%m%dT%H%M%S.%fZ", "%Y%m%dT%H%M%S,%f", "%Y%m%d%H%M%S%f"]
    basic += ["%Y-%m-%d_%H-%M-%S.%f", "%Y-%m-%d %H.%M.%S,%f"]
    for write in ("%Y-%m-%dT%H:%M:%S.%f", "%d.%m.%Y %H:%M:%S.%f", *basic):
        clock = ClockText()
        first, last = (clock.seconds(t.strftime(write)) for t in (start, later))
        assert first is not None and last is not None
        assert last - first == pytest.approx(more_ms / 1e3, abs=1e-5)


@given(st.text())
def test_any_text_is_a_clock_or_is_not(cell: str) -> None:
    assert is_clock(cell) == (ClockText().seconds(cell) is not None)


@given(st.lists(st.text(), max_size=5))
def test_any_lines_have_forms_that_can_be_undone(lines: list[str]) -> None:
    lines = [line for line in lines if line.strip()]
    for form in forms_of(lines, None):
        lines = form.reader()(lines)
        assert all(isinstance(line, str) for line in lines)


@pytest.mark.parametrize(
    "row",
    [
        "ax: {} ay: {} az: {} gx: {} gy: {} gz: {}",
        "AcX = {} | AcY = {} | AcZ = {} | GyX = {} | GyY = {} | GyZ = {}",
        "accel: {}, {}, {}  gyro: {}, {}, {}",
        "Acceleration X: {}, Y: {}, Z: {} m/s^2\nRotation X: {}, Y: {}, Z: {} rad/s\n",
        "12:00:00.0 -> Acceleration X: {} Y: {} Z: {} m/s^2 Gyro X: {} Y: {} Z: {}",
        "Accel:\tx= {} |\ty= {} |\tz= {}\nGyro:\tx= {} |\ty= {} |\tz= {}\n--",
        "Raw. Acc (m/s^2) [ {}, {}, {} ], Gyr (rad/s) [ {}, {}, {} ], Tmp (C) [ 25.1 ]",
        "Force in m/s^2\tX: {}\tY: {}\tZ: {}\tTurn in rad/s\tX: {}\tY: {}\tZ: {}",
        "Ax={} m/s²\tAy={} m/s²\tAz={} m/s²\tGx={} rad/s\tGy={} rad/s\tGz={} rad/s",
        "ax {} ay {} az {} gx {} gy {} gz {}",
        "info: acc: x {} y {} z {} (m/s²) gyro: x {} y {} z {} (rad/s) temp: 25.1°C",
        "MPU\naccel x,y,z: {}, {}, {}\ntemperature: 25.1 °C\ngyro x,y,z : {}, {}, {}, ",
        "chip: accel: x: {} y: {} z: {} [m/s^2] gyro: x: {} y: {} z: {} [rad/s]",
        "acc_xyz: {} {} {} gyr XYZ: {} {} {}",
        "ax, ay, az: {}, {}, {} m/s^2\ngx, gy, gz: {}, {}, {} rad/s",
        "ax,ay,az,gx,gy,gz: {},{},{},{},{},{}",
        "(ax, ay, az) = ({}, {}, {}), (gx, gy, gz) = ({}, {}, {})",
        "Raw acc [x/y/z]: {} {} {} Yaw, Pitch: 1, 2 Gyro (x, y, z): {}, {}, {}",
        "A X: {} A Y: {} A Z: {} G X: {} G Y: {} G Z: {}",
        "RAW. Acc [ {}, {}, {} ], Gyr [ {}, {}, {} ], Tmp [ 25.1 ]",
        "--- Accelerometer (m/s^2) ---\nX: {} Y: {} Z: {}\n"
        "--- Gyroscope (rad/s) ---\nX: {} Y: {} Z: {}",
        "Accelerometer data:\nX = {}\nY = {}\nZ = {}\n"
        "Gyroscope data:\nX = {}\nY = {}\nZ = {}\n",
        "accel: {{'x': {}, 'y': {}, 'z': {}}} gyro: {{'x': {}, 'y': {}, 'z': {}}}",
        "Acc: {{x: {}, y: {}, z: {}}}, Gyro: {{x: {}, y: {}, z: {}}}",
        "🌐 Accel: x:{} y:{} z:{}\n🌐 Gyro: x:{} y:{} z:{}",
        "Temperature 25.31 deg C\nAccel X: {} \tY: {} \tZ: {} m/s^2 \n"
        "Gyro X: {} \tY: {} \tZ: {} radians/s \n",
    ],
)
def test_values_with_labels_need_no_columns(tmp_path: Path, row: str) -> None:
    lines = "\n".join(row.format(*values(i)) for i in range(ROWS))
    boot = "MPU6050 found!\n"
    if "->" in row:
        lines = "\n".join(
            line.replace("12:00:00.0", when(i).strftime("%H:%M:%S.%f"))
            for i, line in enumerate(lines.split("\n"))
        )
    got = read(tmp_path, boot + lines + "\n", rate_hz=RATE)
    np.testing.assert_array_equal(got.acc[:, 0], AX)
    np.testing.assert_allclose(got.gyr, [[0.01, -0.02, 0.03]] * ROWS)
    np.testing.assert_allclose(got.t, np.arange(ROWS) / RATE, atol=2e-6)
    warm = re.search(r"25\.\d+", row)
    np.testing.assert_array_equal(got.temperature, float(warm[0]) if warm else np.nan)


@pytest.mark.parametrize(
    "stamp", ["%Y-%m-%d-%H-%M-%S:::IMU ", "%Y-%m-%d %H:%M:%S.%f,INFO,"]
)
def test_signs_between_a_date_its_time_and_the_labels(
    tmp_path: Path, stamp: str
) -> None:
    row = "accel: [{}, {}, {}] gyro: [{}, {}, {}]"
    count = 60
    apart = 20 if "%f" in stamp else 1
    rows = [
        f"{when(i * 20 // apart):{stamp}}" + row.format(*values(i % ROWS))
        for i in range(count)
    ]
    got = read(tmp_path, "\n".join(rows) + "\n")
    np.testing.assert_allclose(got.t, np.arange(count) / apart, atol=2e-6)


def test_what_a_program_prints_besides_speaks_against_no_labels(tmp_path: Path) -> None:
    # a sketch for people: two lines of a sensor each among five of what it makes of
    # them, with a rate that is that of its filter
    beside = (
        "mx = -55 my = {} mz = -41 mG\nGyro temperature is 29.{} degrees C\n"
        "Yaw, Pitch, Roll: 342.{}, -4.27, -2.68\nGrav_x, Grav_y, Grav_z: 4{}.6, 2, 8 mg"
        "\nLin_ax, Lin_ay, Lin_az: -6{}.9, 82.61, -0.53 mg\nrate = 2531{}.27 Hz\n"
        "0, 0, -{} o/s\n34{}, -4, -2 ypr\n\n"
    )
    text = "".join(
        f"ax = {1000 * AX[i]:.2f} ay = 8.18 az = 995.61 mg\n"
        f"gx = -0.05 gy = {0.01 * i:.2f} gz = -1.88 deg/s\n"
        + beside.format(*[i % 10] * 8)
        for i in range(ROWS)
    )
    block = read(tmp_path, text, rate_hz=RATE)
    assert block.t == pytest.approx(np.arange(ROWS) / RATE)
    assert block.acc[:, 0] == pytest.approx(9.80665 * np.round(AX, 5))
    assert block.gyr[:, 1] == pytest.approx(np.deg2rad(0.01 * np.arange(ROWS)))


def test_a_few_labels_among_rows_of_words_and_numbers_are_no_form() -> None:
    rows = [f"IMU {i} {AX[i]:.3f} 0.2 9.8 ok" for i in range(ROWS)]
    status = ["battery: 3.7 current: 0.2 load: 11"] * 5
    axes = ["ax: 0.1 ay: 0.2 az: 9.8"] * 5
    assert not any(type(f).__name__ == "LabelledValues" for f in
                   forms_of([*rows, *status], None))  # fmt: skip
    # rows of numbers alone are no sentences
    bare = [f"{AX[i]:.3f} 0.2 9.8" for i in range(ROWS)]
    assert not any(type(f).__name__ == "LabelledValues" for f in
                   forms_of([*bare, *axes], None))  # fmt: skip


def test_a_monitor_that_says_when_a_row_came(tmp_path: Path) -> None:
    rows = [f"{when(i):%H:%M:%S.%f} -> {','.join(values(i))}" for i in range(ROWS)]
    head = f"{when(0):%H:%M:%S.%f} -> {','.join(NAMES)}"
    got = read(tmp_path, "\n".join([head, *rows]) + "\n")
    np.testing.assert_allclose(got.t, np.arange(ROWS) / RATE, atol=2e-6)
    np.testing.assert_array_equal(got.acc[:, 0], AX)


def test_quoted_numbers_with_decimal_commas(tmp_path: Path) -> None:
    head = ",".join(f'"{name}"' for name in ["time", *NAMES])
    rows = [
        ",".join(f'"{x.replace(".", ",")}"' for x in [f"{i / RATE}", *values(i)])
        for i in range(ROWS)
    ]
    got = read(tmp_path, "\n".join([head, *rows]))
    np.testing.assert_array_equal(got.acc[:, 0], AX)
    np.testing.assert_allclose(got.t, np.arange(ROWS) / RATE)


def test_what_is_no_label_is_left_alone() -> None:
    assert labelled_values("Fs: 100 measured by a clock") == []
    assert labelled_values("1.0,2.0,3.0") == []


@pytest.mark.parametrize(
    "prefix",
    ["{:%H:%M:%S.%f} -> ", "\x1b[0;32mI ({ms}) IMU: ",
     "[{ms:6d}][I][main.cpp:4] loop(): "],
)  # fmt: skip
def test_each_line_of_a_row_may_have_its_time(tmp_path: Path, prefix: str) -> None:
    row = "Acceleration X: {}, Y: {}, Z: {} m/s^2\nRotation X: {}, Y: {}, Z: {} rad/s"
    lines = []
    for i in range(ROWS):
        said = prefix.format(when(i), ms=300 + round(i * 1e3 / RATE))
        both = row.format(*values(i)).split("\n")
        lines += [said + line for line in (*both, "Temperature: 25.1 degC", "")]
    unit = "s" if "->" in prefix else "ms"
    got = read(tmp_path, "\n".join(lines) + "\n", time_unit=unit)
    np.testing.assert_array_equal(got.acc[:, 0], AX)
    np.testing.assert_allclose(got.gyr, [[0.01, -0.02, 0.03]] * ROWS)
    np.testing.assert_allclose(got.t, np.arange(ROWS) / RATE, atol=2e-6)


def test_a_row_with_a_name_and_no_number_is_damaged(tmp_path: Path) -> None:
    rows = ["Accel X: {} Y: {} Z: {}\nGyro X: {} Y: {} Z: {}".format(*values(i))
            for i in range(ROWS)]  # fmt: skip
    rows[5] = rows[9] = "Accel X: nan Y: nan Z: nan"
    with pytest.raises(InputError, match="copy the file again"):
        read(tmp_path, "\n".join(rows), rate_hz=RATE)


def test_the_text_of_a_dataflash_log_is_read_for_its_first_imu(tmp_path: Path) -> None:
    fields = "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz"
    lines = [
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        f"FMT, 140, 60, IMU, QBffffffIIfBBHH, {fields}",
        "FMT, 141, 30, ATT, QccccCC, TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw",
    ]
    for i in range(ROWS):
        a, g = values(i)[:3], values(i)[3:]
        us = round(1e6 * i / RATE)
        for imu, more in ((0, a), (1, ["7", "7", "7"])):
            row = ["IMU", us, imu, *g, *more, 0, 0, 31.5, 1, 1, 1000, 1000]
            lines.append(", ".join(map(str, row)))
        lines.append(f"ATT, {us}, 0, 1.5, 0, 2.5, 10, 11")
    got = read(tmp_path, "\n".join(lines) + "\n", time_unit="us")
    np.testing.assert_array_equal(got.acc[:, 0], AX)
    np.testing.assert_allclose(got.gyr, [[0.01, -0.02, 0.03]] * ROWS)
    np.testing.assert_allclose(got.t, np.arange(ROWS) / RATE)
    np.testing.assert_allclose(got.temperature, 31.5)


def tagged(rows: int, gyroscope_first: bool) -> str:
    """Lines of two sensors in turn, so many of each, that hold the number of a row."""
    found = []
    for first in range(0, ROWS, rows):
        some = range(first, min(first + rows, ROWS))
        acc = [f"ACCE;{i / RATE:.3f};{i}.5;0.2;9.8" for i in some]
        gyr = [f"GYRO;{i / RATE + 0.004:.3f};{i}.5;0.1;0.2" for i in some]
        found += [*gyr, *acc] if gyroscope_first else [*acc, *gyr]
    return "\n".join(found) + "\n"


@pytest.mark.parametrize("rows", [1, 7, 30])
@pytest.mark.parametrize("gyroscope_first", [False, True])
def test_lines_of_two_sensors_may_come_many_at_a_time(
    tmp_path: Path, rows: int, gyroscope_first: bool
) -> None:
    columns = ("_", "t", "ax", "ay", "az", "gx", "gy", "gz")
    path = tmp_path / "log.txt"
    path.write_text(tagged(rows, gyroscope_first))
    recording = open_recording(path, ReadOptions(columns=columns))
    got = concat(list(recording.blocks("0")))
    np.testing.assert_array_equal(got.acc[:, 0], np.arange(ROWS) + 0.5)
    np.testing.assert_array_equal(got.gyr[:, 0], got.acc[:, 0])


def test_a_clock_that_is_the_same_in_all_rows_is_not_their_time(
    tmp_path: Path,
) -> None:
    """A database writes from when to when it was asked before the time of a row."""
    asked = "2024-05-03T14:00:00Z,2024-05-03T15:00:00Z"
    lines = ["_start,_stop,_time,host,ax,ay,az"]
    lines += [
        f"{asked},2024-05-03T14:20:{31 + i / 50:06.3f}Z,pi,0.1,{i % 3},9.8"
        for i in range(400)
    ]
    path = tmp_path / "query.csv"
    path.write_text("\n".join(lines) + "\n")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    block = Session.open(tmp_path / "out").block
    np.testing.assert_allclose(block.t, np.arange(400) / 50, atol=1e-6)
