"""Importers against logs with known samples, and against mutated ones."""

from __future__ import annotations

import gzip
import struct
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from logs import CAN_MAP, arrays, can_log, dataflash, dbc, imu, table, tlog, ulog
from small_files import SMALL, Small, whole

from fieldcal.cli import main
from fieldcal.core.errors import InputError, SessionError
from fieldcal.core.samples import Block, concat
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.importers import formats, open_recording
from fieldcal.importing import recording as recordings
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.session.ingest import import_stream
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.session import sample_files
from fieldcal.session.folder import Session
from fieldcal.session.integrity import file_faults

INSTALLED = {
    "INS_ACCOFFS_X": 0.1, "INS_ACCOFFS_Y": 0.2, "INS_ACCOFFS_Z": 0.3,
    "INS_ACCSCAL_X": 1.01, "INS_ACCSCAL_Y": 1.02, "INS_ACCSCAL_Z": 1.03,
    "INS_GYROFFS_X": 0.01, "INS_GYROFFS_Y": 0.02, "INS_GYROFFS_Z": 0.03,
    "AHRS_ORIENTATION": 0.0,
}  # fmt: skip
SLOT = {
    "CAL_ACC_PRIME": 101.0, "CAL_ACC0_ID": 100.0, "CAL_ACC1_ID": 101.0,
    "CAL_ACC1_XOFF": 0.5, "CAL_ACC1_YOFF": 0.25, "CAL_ACC1_ZOFF": 0.125,
    "CAL_ACC1_XSCALE": 1.5, "CAL_ACC1_YSCALE": 1.25, "CAL_ACC1_ZSCALE": 0.75,
    "CAL_GYRO1_XOFF": 0.5, "CAL_GYRO1_YOFF": 0.25, "CAL_GYRO1_ZOFF": 0.125,
    "SENS_BOARD_ROT": 0.0,
}  # fmt: skip
COLUMNS = "t,ax,ay,az,gx,gy,gz"
WANTED = ReadOptions(tuple(COLUMNS.split(",")))


def session(folder: Path, *call: str) -> Session:
    assert main(["import", *call, "-o", str(folder)]) == 0
    return Session.open(folder)


def mark(folder: Path, event: str) -> dict[str, Any]:
    return next(m for m in Session.open(folder).marks() if m["event"] == event)


def assert_same(found: Block, expected: Block, atol: float = 0.0) -> None:
    np.testing.assert_allclose(
        found.t - found.t[0], expected.t - expected.t[0], atol=1e-6
    )
    np.testing.assert_allclose(found.acc, expected.acc, rtol=0, atol=atol)
    np.testing.assert_allclose(found.gyr, expected.gyr, rtol=0, atol=atol)


def test_px4_sensors_are_kept_apart_with_their_own_calibration(tmp_path: Path) -> None:
    units = {0: imu(1), 1: imu(2, 300)}
    path = tmp_path / "log.anything"
    path.write_bytes(ulog(units, SLOT, combined=imu(3), late=0.002))
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 0
    for n, block in units.items():
        folder = out / f"sensor_accel.{n}"
        assert_same(Session.open(folder).block, block)
        np.testing.assert_array_equal(
            Session.open(folder).block.temperature, block.temperature
        )
        assert not list(file_faults(folder))
        assert any("2 ms apart" in s for s in mark(folder, "imported")["says"])
    device = mark(out / "sensor_accel.1", "device")
    assert device["device_id"] == 101 and device["installed"]["taken_out"]
    assert device["installed"]["instance"] == 1 and not device["installed"]["missing"]
    assert device["installed"]["parameters"]["CAL_ACC1_XOFF"] == 0.5
    combined = Session.open(out / "sensor_combined.0").block
    stale = np.arange(len(combined)) % 50 == 7
    assert np.isnan(combined.acc[stale]).all()
    np.testing.assert_array_equal(combined.gyr, imu(3).gyr)
    told = mark(out / "sensor_combined.0", "device")["installed"]
    assert told["instance"] == 1 and not told["taken_out"]


def test_px4_gyroscopes_have_parameters_of_their_own_number(tmp_path: Path) -> None:
    """PX4 numbers those of accelerometers and gyroscopes as each was calibrated."""
    own = {"CAL_GYRO0_ID": 101.0, "CAL_GYRO1_ID": 100.0, "CAL_GYRO0_XOFF": 0.75,
           "CAL_GYRO0_YOFF": 0.0, "CAL_GYRO0_ZOFF": -0.25}  # fmt: skip
    path = tmp_path / "log.ulg"
    path.write_bytes(ulog({0: imu(1), 1: imu(2)}, SLOT | own))
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 0
    told = mark(out / "sensor_accel.1", "device")["installed"]
    assert (told["instance"], told["gyr_instance"]) == (1, 0)
    assert "CAL_GYRO1_XOFF" not in told["parameters"] and not told["missing"]
    installed = InstalledCalibration.from_table(told)
    np.testing.assert_allclose(installed.vector("gyr_offset"), [0.75, 0.0, -0.25])
    after = installed.parameters_after(np.zeros(3), np.ones(3), np.full(3, 0.5))
    assert after["CAL_GYRO0_XOFF"] == 0.5 and "CAL_GYRO1_XOFF" not in after
    assert not list(file_faults(out / "sensor_accel.1"))


def test_a_px4_gyroscope_without_parameters_has_none_of_another(tmp_path: Path) -> None:
    """Set 1 is of a gyroscope that is not in the log."""
    path, out = tmp_path / "log.ulg", tmp_path / "out"
    path.write_bytes(ulog({1: imu(1)}, SLOT | {"CAL_GYRO1_ID": 999.0}))
    assert main(["import", str(path), "-o", str(out)]) == 0
    told = mark(out, "device")["installed"]
    assert told["parameters"]["CAL_ACC1_XOFF"] == 0.5
    assert told["missing"] == [f"CAL_GYRO1_{axis}OFF" for axis in "XYZ"]
    installed = InstalledCalibration.from_table(told)
    with pytest.raises(InputError, match="without CAL_GYRO1_XOFF"):
        installed.parameters_after(np.zeros(3), np.ones(3), np.zeros(3))


@pytest.mark.parametrize("stamp", [0.5, 9999.0])
@pytest.mark.parametrize("sensor", ["acc", "gyr"])
def test_a_wrong_time_in_a_px4_log_costs_its_own_sample_alone(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    stamp: float,
    sensor: str,
) -> None:
    block, at = imu(1), 205
    path, true = tmp_path / "log.ulg", round(block.t[at] * 1e6)
    data = ulog({0: block}, SLOT)
    number = {"acc": 1, "gyr": 11}[sensor]
    old = struct.pack("<HQQ", number, true + 3, true)
    assert data.count(old) == 1
    path.write_bytes(
        data.replace(old, struct.pack("<HQQ", number, 0, int(stamp * 1e6)))
    )
    monkeypatch.setattr(recordings.Recording.pieces, "__defaults__", (4001,))
    call = ["import", str(path), "-o", str(tmp_path / "s"), "--instance"]
    call += ["sensor_accel.0"]
    assert main(call) == 2
    topic = {"acc": "sensor_accel.0", "gyr": "sensor_gyro.0"}[sensor]
    assert f"sample {at + 1} of {topic}, column t" in capsys.readouterr().err
    assert main([*call, "--repair"]) == 0
    found = Session.open(tmp_path / "s").block
    if sensor == "gyr":
        assert np.flatnonzero(np.isnan(found.gyr[:, 0])).tolist() == [at]
        np.testing.assert_array_equal(found.acc, block.acc)
    else:
        np.testing.assert_array_equal(found.gyr, np.delete(block.gyr, at, axis=0))


def test_a_px4_log_in_small_pieces_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "log.ulg"
    path.write_bytes(ulog({0: imu(1)}, SLOT, late=0.004))
    whole = concat(open_recording(path, WANTED).blocks("sensor_accel.0"))
    monkeypatch.setattr(recordings.Recording.pieces, "__defaults__", (997,))
    parts = list(open_recording(path, WANTED).blocks("sensor_accel.0"))
    assert len(parts) > 3
    assert_same(concat(parts), whole)
    assert_same(whole, imu(1))


def test_ardupilot_sensors_and_what_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pymavlink.DFReader import DFReader_binary

    units = {0: imu(1), 1: imu(2)}
    path = tmp_path / "00000001.bin"
    path.write_bytes(dataflash(units, INSTALLED))
    monkeypatch.setattr(recordings.Recording.pieces, "__defaults__", (1009,))
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 0
    reader = DFReader_binary(str(path))
    theirs = []
    while (said := reader.recv_match(type=["IMU"])) is not None:
        if said.I == 1:
            theirs.append([said.AccX, said.AccY, said.AccZ])
    reader.close()
    for n, block in units.items():
        found = Session.open(out / f"IMU.{n}").block
        assert_same(found, block)
        np.testing.assert_array_equal(found.temperature, block.temperature)
    np.testing.assert_array_equal(Session.open(out / "IMU.1").block.acc, theirs)
    told = mark(out / "IMU.0", "device")["installed"]
    assert told["parameters"] == pytest.approx(INSTALLED)
    assert not told["missing"] and not told["taken_out"]
    assert mark(out / "IMU.1", "device")["installed"]["missing"]


def test_a_telemetry_log_of_two_sensors(tmp_path: Path) -> None:
    units = {0: imu(1), 1: imu(2)}
    path = tmp_path / "flight.log"
    path.write_bytes(tlog(units, INSTALLED))
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 0
    for n, block in units.items():
        assert_same(Session.open(out / f"HIGHRES_IMU.{n}").block, block)
    device = mark(out / "HIGHRES_IMU.0", "device")
    assert device["acc_unit"] == "m/s^2"
    assert device["installed"]["parameters"] == pytest.approx(INSTALLED)


@pytest.mark.parametrize("ending", [".log", ".asc", ".blf"])
def test_can_logs(tmp_path: Path, ending: str) -> None:
    (tmp_path / "imu.dbc").write_text(dbc())
    can_log(tmp_path / f"drive{ending}", imu(1))
    (tmp_path / f"drive{ending}").rename(tmp_path / "drive.dat")
    options = f"dbc={tmp_path / 'imu.dbc'}&map={CAN_MAP}"
    found = session(tmp_path / "s", str(tmp_path / "drive.dat"), "--options", options)
    assert_same(found.block, imu(1), atol=6e-4)


@pytest.mark.parametrize(
    "time", ["%Y-%m-%d-%H:%M:%S.{:03d}", "%Y-%m-%dT%H:%M:%S.{:03d}Z"]
)
def test_frames_of_canboat(tmp_path: Path, time: str) -> None:
    can_log(tmp_path / "drive.log", imu(1))
    text, groups = dbc(), {16: 65305, 17: 126208}
    for number, group in groups.items():
        # 126208 goes to one device, here 47, whose address is in the identifier
        to = 47 if group == 126208 else 0
        whole = 0x80000000 | 2 << 26 | (group | to) << 8 | 35
        text = text.replace(f"BO_ {number} ", f"BO_ {whole} ")
        text = text.replace(f" {number} ", f" {whole} ")
    (tmp_path / "imu.dbc").write_text(text)
    lines = []
    for line in (tmp_path / "drive.log").read_text().splitlines():
        stamp, _, frame = line.split()[:3]
        named, data = frame.split("#")
        ms = round(1000 * float(stamp.strip("()")))
        when = datetime.fromtimestamp(ms // 1000, UTC)
        group = groups[int(named, 16)]
        cells = [data[i : i + 2].lower() for i in range(0, len(data), 2)]
        to = 47 if group == 126208 else 255
        head = f"{when.strftime(time).format(ms % 1000)},2,{group},35,{to},{len(cells)}"
        lines.append(",".join([head, *cells]))
    path = tmp_path / "bus.txt"
    path.write_text("\n".join(lines) + "\n")
    options = f"dbc={tmp_path / 'imu.dbc'}&map={CAN_MAP}"
    found = session(tmp_path / "s", str(path), "--options", options)
    np.testing.assert_allclose(found.block.acc, imu(1).acc, atol=6e-4)
    np.testing.assert_allclose(found.block.gyr, imu(1).gyr, atol=6e-4)
    path.write_text("\n".join([*lines[:4], lines[4][:-3], *lines[5:]]) + "\n")
    call = ["import", str(path), "--options", options, "-o", str(tmp_path / "bad")]
    assert main(call) == 2


def test_can_logs_of_several_buses_are_never_mixed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "imu.dbc").write_text(dbc())
    lines: list[str] = []
    for bus in (0, 1):
        can_log(tmp_path / f"{bus}.log", imu(bus))
        text = (tmp_path / f"{bus}.log").read_text()
        lines += text.replace("can0", f"can{bus}").splitlines()
    path = tmp_path / "both.log"
    path.write_text("\n".join(sorted(lines)))
    options = f"dbc={tmp_path / 'imu.dbc'}&map={CAN_MAP}"
    assert main(["import", str(path), "--options", options]) == 2
    assert "come from the buses can0, can1: choose one" in capsys.readouterr().err
    for bus in (0, 1):
        chosen = f"{options}&channel=can{bus}"
        found = session(tmp_path / f"s{bus}", str(path), "--options", chosen)
        assert_same(found.block, imu(bus), atol=6e-4)
    none = f"{options}&channel=can7"
    assert main(["import", str(path), "--options", none]) == 2
    assert "comes from can7, but from can0, can1" in capsys.readouterr().err


@pytest.mark.parametrize("time", ["", "(1718000000.000000)", "(2024-06-10 12:00:00.0)"])
def test_what_candump_prints_is_named(tmp_path: Path, time: str) -> None:
    path = tmp_path / "log.txt"
    path.write_text(f" {time}  can0  123   [6]  00 00 00 00 52 26\n" * 50)
    with pytest.raises(InputError, match="record with candump -l"):
        open_recording(path, ReadOptions()).streams()


@pytest.mark.parametrize("ending", [".npz", ".npy", ".mat", ".h5"])
def test_arrays_of_any_kind(tmp_path: Path, ending: str) -> None:
    arrays(tmp_path / f"log{ending}", imu(1))
    path = tmp_path / "log.data"
    path.write_bytes(gzip.compress((tmp_path / f"log{ending}").read_bytes()))
    assert_same(session(tmp_path / "s", str(path), "--columns", COLUMNS).block, imu(1))
    name = {".npy": "array", ".h5": "group/imu"}.get(ending, "imu")
    named = [f"{c}={name}.{i}" for i, c in enumerate(COLUMNS.split(","))]
    again = session(tmp_path / "n", str(path), "--columns", ",".join(named))
    assert_same(again.block, imu(1))


@pytest.mark.parametrize("kind", ["parquet", "stream", "feather"])
def test_tables_with_named_columns(tmp_path: Path, kind: str) -> None:
    import pyarrow as pa
    import pyarrow.parquet

    names = ["time", "acc_x", "acc_y", "acc_z", "gx", "gy", "gz"]
    made = pa.table(dict(zip(names, table(imu(1)).T, strict=True)))
    path = tmp_path / "table"
    if kind == "parquet":
        pyarrow.parquet.write_table(made, path)
    else:
        new = pa.ipc.new_file if kind == "feather" else pa.ipc.new_stream
        with new(path, made.schema) as writer:
            writer.write_table(made)
    columns = "t=time,ax=acc_x,ay=acc_y,az=acc_z,gx,gy,gz"
    assert_same(session(tmp_path / "s", str(path), "--columns", columns).block, imu(1))


@pytest.mark.parametrize("kind", ["stream", "feather"])
def test_a_table_may_have_few_rows_in_a_batch(tmp_path: Path, kind: str) -> None:
    """As whoever writes them while they come; its rows share a time by tens."""
    import pyarrow as pa

    rows = table(imu(1))
    rows[:, 0] = np.floor(np.arange(len(rows)) / 10) / 10
    names = ["time", "acc_x", "acc_y", "acc_z", "gx", "gy", "gz"]
    made = pa.table(dict(zip(names, rows.T, strict=True)))
    path = tmp_path / "table"
    new = pa.ipc.new_file if kind == "feather" else pa.ipc.new_stream
    with new(path, made.schema) as writer:
        writer.write_table(made, max_chunksize=15)
    found = session(tmp_path / "s", str(path), "--gyr-unit", "rad/s").block
    np.testing.assert_allclose(np.diff(found.t), 0.01, atol=1e-9)
    np.testing.assert_array_equal(found.acc, rows[:, 1:4])


def test_a_number_for_what_is_missing_in_a_table_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import pyarrow as pa
    import pyarrow.parquet

    rows = table(imu(1))
    rows[20:25, 1:] = -999.0
    names = ["time", "acc_x", "acc_y", "acc_z", "gx", "gy", "gz"]
    made = pa.table(dict(zip(names, rows.T, strict=True)))
    pyarrow.parquet.write_table(made, tmp_path / "table")
    call = ["import", str(tmp_path / "table"), "-o", str(tmp_path / "s")]
    assert main([*call, "--gyr-unit", "rad/s"]) == 0
    assert "-999 stands for a missing value: 5 rows" in capsys.readouterr().err


def test_files_of_one_imu_are_joined_where_their_times_agree(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    block = imu(1)
    np.savez(tmp_path / "a.npz", a=np.column_stack([block.t, block.acc]))
    np.savetxt(tmp_path / "g.csv", np.column_stack([block.t - block.t[0], block.gyr]))
    np.savez(tmp_path / "w.npz", w=np.column_stack([block.t, block.temperature]))
    call = [str(tmp_path / n) for n in ("a.npz", "w.npz")]
    call += ["--join", "--columns", "t,ax,ay,az", "--columns", "t,temperature"]
    found = session(tmp_path / "s", *call).block
    np.testing.assert_array_equal(found.temperature, block.temperature)
    assert len(mark(tmp_path / "s", "imported")["files"]) == 2
    call = [str(tmp_path / n) for n in ("a.npz", "g.csv")]
    call += ["--join", "--columns", "t,ax,ay,az", "--columns", "t,gx,gy,gz"]
    assert main(["import", *call, "-o", str(tmp_path / "x")]) == 2
    assert "g.csv: no sample is at a time at which a.npz has" in capsys.readouterr().err


BAD = np.array([[0.0, 1], [0.01, 2], [9.0, 3], [0.02, 4], [0.02, 5], [0.01, 6],
                [0.03, np.inf], [0.0, 0], [0.04, 7]])  # fmt: skip


def test_bad_rows_are_refused_or_left_out_and_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = np.column_stack([BAD, BAD[:, 1], BAD[:, 1]])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",")
    call = [
        "import",
        str(tmp_path / "log.csv"),
        "--columns",
        "t,ax,ay,az",
        "--acc-unit",
        "m/s^2",
    ]
    call += ["-o", str(tmp_path / "s")]
    assert main(call) == 2
    said = capsys.readouterr().err
    assert "log.csv: line 8, column t ax ay az: hold only zeros" in said
    assert not (tmp_path / "s").exists() and len(list(tmp_path.iterdir())) == 1
    assert main([*call, "--repair"]) == 0
    repairs = mark(tmp_path / "s", "imported")["repairs"]
    said = capsys.readouterr().err
    assert all(sentence in said for sentence in repairs)
    assert sorted(s.split(":")[0] for s in repairs) == [
        "line 3, column t",
        "line 5 to line 6, column t",
        "line 7, column ax",
        "line 8, column t ax ay az",
    ]
    np.testing.assert_array_equal(
        Session.open(tmp_path / "s").block.acc[:, 0], [1, 2, 4, 7]
    )
    assert mark(tmp_path / "s", "imported")["left_out"] == 5


@given(
    st.lists(
        st.sampled_from([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, np.nan, np.inf]), max_size=12
    ),
    st.integers(1, 5),
)
def test_rows_that_are_let_through_always_go_forward(
    times: list[float], cut: int
) -> None:
    t = np.array(times)
    block = Block.of(t, np.ones((len(t), 3)), np.ones((len(t), 3)))

    def kept(cut: int) -> list[float]:
        judge = RowValidator("x", lambda row: f"row {row}", repair=True)
        parts = (block[i : i + cut] for i in range(0, len(t), cut))
        times = concat(judge.through(parts)).t
        assert (np.diff(times) > 0).all() and np.isfinite(times).all()
        assert len(times) + judge.left_out + judge.repeated == len(t)
        assert bool(judge.mended) == (judge.left_out > 0)
        found: list[float] = times.tolist()
        return found

    assert kept(cut) == kept(len(t) + 1)


@pytest.mark.parametrize("cut", [40, 25, 20, 10, 1])
def test_one_time_that_leaps_costs_one_row_wherever_blocks_end(cut: int) -> None:
    t = np.arange(40.0)
    t[19] = 1e6
    block = Block.of(t, np.ones((40, 3)))
    judge = RowValidator("x", lambda row: f"row {row}", repair=True)
    blocks = (block[i : i + cut] for i in range(0, 40, cut))
    assert len(concat(judge.through(blocks))) == 39
    assert judge.mended == ["row 19, column t: is later than below, left out"]


def test_what_is_in_a_file_is_listed_and_chosen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(dataflash({0: imu(1), 2: imu(2)}, {}))
    assert main(["import", str(path), "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("\t")[1] for line in lines] == ["IMU.0", "IMU.2"]
    assert all("m/s^2" in line for line in lines)
    assert_same(session(tmp_path / "s", str(path), "--instance", "IMU.2").block, imu(2))
    call = ["import", str(path), "--instance", "IMU.1", "-o", str(tmp_path / "x")]
    assert main(call) == 2
    assert "has no IMU.1; there are IMU.0, IMU.2" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty"),
        (b"SQLite format 3\0" + bytes(100), "is not whole"),
        (b"SQLite format 3\0" + bytes(84) + b"CREATE TABLE topics", "cannot be read"),
        (bytes(range(256)) * 9, "--format"),
        (b"1,2,3\n", "say what its columns are"),
        (b"\x1f\x8b\x08\x00garbage", "behind byte 0, unpacked"),
    ],
)
def test_what_cannot_be_told_is_refused_with_the_remedy(
    tmp_path: Path, content: bytes, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_bytes(content)
    assert main(["import", str(tmp_path / "file"), "-o", str(tmp_path / "s")]) == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / "s").exists()


def test_a_library_that_is_missing_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recordings, "find_spec", lambda name: None)
    for content, extra in (
        (ulog({0: imu(1, 5)}, {}), "ulog"),
        (dataflash({0: imu(1, 5)}, {}), "mavlink"),
        (b"\x89MCAP0\r\n", "mcap"),
        (b"\x89HDF\r\n\x1a\n", "hdf5"),
        (b"(1.0) can0 001#00\n", "can"),
    ):
        (tmp_path / "file").write_bytes(content)
        with pytest.raises(InputError, match=rf"pip install 'fieldcal\[{extra}\]'"):
            open_recording(tmp_path / "file", WANTED)


@pytest.fixture(scope="module", params=sorted(SMALL))
def small(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Small:
    return Small(request.param, tmp_path_factory.mktemp(request.param) / "file")


@settings(
    max_examples=20, deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
@given(data=st.data())
def test_mutated_files_are_read_or_refused_in_words(
    small: Small, data: st.DataObject
) -> None:
    mutated = bytearray(small.content)
    changes = data.draw(st.integers(0, 3))
    for _ in range(changes):
        at = data.draw(st.integers(0, len(mutated) - 1))
        mutated[at] = data.draw(st.integers(0, 255))
    n = len(mutated)
    small.path.write_bytes(mutated[: data.draw(st.sampled_from([n, n - 1, n // 2]))])
    repair = data.draw(st.booleans())
    try:
        found = whole(small.path, small.wanted, small.name, repair)
    except InputError as error:
        assert small.path.name in str(error) or "imu.dbc" in str(error)
        return
    assert len(found) <= len(small.expected)
    # a changed byte may change a number in a format that has no checksum
    assert changes or small.knows(found)


def test_a_log_whose_format_calls_a_number_a_text_is_refused(tmp_path: Path) -> None:
    small = Small("dataflash", tmp_path / "file")
    content = bytearray(small.content)
    content[189] = ord("n")
    small.path.write_bytes(content)
    with pytest.raises(InputError, match="fit"):
        whole(small.path, small.wanted, small.name, repair=False)


def test_a_name_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "file"
    rows = pa.table({name: np.arange(9.0) for name in ("t", "ax", "ay", "az", "qqqq")})
    with pa.ipc.new_stream(path, rows.schema) as stream:
        stream.write_table(rows)
    path.write_bytes(path.read_bytes().replace(b"qqqq", b"q\xa2qq"))
    with pytest.raises(InputError, match="is not whole"):
        open_recording(path, ReadOptions()).streams()


def test_a_frame_of_which_nobody_can_tell_the_time_is_named(tmp_path: Path) -> None:
    small = Small("can_log", tmp_path / "file")
    lines = small.content.splitlines(keepends=True)
    spoilt = lines[60].replace(b"(", b"(" + b"9" * 400, 1)
    small.path.write_bytes(b"".join([*lines[:60], spoilt, *lines[61:]]))
    with pytest.raises(InputError, match="1 of its frames: without a time"):
        whole(small.path, small.wanted, small.name, repair=False)
    found = whole(small.path, small.wanted, small.name, repair=True)
    assert len(small.expected) - 2 < len(found) < len(small.expected)


def test_a_summary_that_is_damaged_is_none(tmp_path: Path) -> None:
    """Whatever byte of it: what reads it raises what it likes."""
    small, refused = Small("mcap", tmp_path / "file"), 0
    for at in range(len(small.content) - 400, len(small.content)):
        content = bytearray(small.content)
        content[at] = 255
        small.path.write_bytes(content)
        try:
            open_recording(small.path, small.wanted).streams()
        except InputError as error:
            assert small.path.name in str(error)
            refused += 1
    assert refused


def test_a_nan_that_signals_is_a_missing_number(tmp_path: Path) -> None:
    """A damaged byte makes one; where it is cast, numpy warns."""
    small = Small("dataflash", tmp_path / "file")
    content = bytearray(small.content)
    content[931] = 0x7F
    small.path.write_bytes(content)
    found = whole(small.path, small.wanted, small.name, repair=False)
    assert len(found) == len(small.expected)
    assert np.isnan(found.temperature).sum() == 1


def test_a_nan_that_signals_in_a_px4_log_is_a_missing_number(tmp_path: Path) -> None:
    small = Small("ulog", tmp_path / "file")
    value = struct.pack("<f", small.expected.acc[5, 1])
    assert small.content.count(value) == 1
    signals = struct.pack("<I", 0x7FA00000)
    small.path.write_bytes(small.content.replace(value, signals))
    found = whole(small.path, small.wanted, small.name, repair=False)
    assert np.isnan(found.acc[5, 1]) and np.isnan(found.acc).sum() == 1


def test_flags_of_a_px4_log_that_end_too_early_are_read_as_far_as_they_go(
    tmp_path: Path,
) -> None:
    data = ulog({0: imu(1, 40)}, {})
    flags = struct.pack("<HB", 25, ord("B")) + bytes(25)
    path = tmp_path / "log.ulg"
    path.write_bytes(data[:16] + flags + data[16:])
    assert_same(whole(path, ReadOptions()), imu(1, 40))


def test_every_format_is_tried() -> None:
    assert set(SMALL) | {"wire", "oxts"} == set(formats())


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Block, bytes]:
    """Samples of a session that was imported, and its file."""
    folder = tmp_path_factory.mktemp("kept")
    n = 5000
    six = np.random.default_rng(3).normal(0, 0.02, (n, 6)) + [0, 0, 9.8, 0, 0, 0]
    block = Block.of(np.arange(n) / 100, six[:, :3], six[:, 3:])
    SMALL["parquet"](folder / "x.parquet", block)
    recording = open_recording(
        folder / "x.parquet", ReadOptions(tuple(COLUMNS.split(",")))
    )
    import_stream(recording, "0", folder / "s", {"format": 1}, 2.0)
    return block, (folder / "s" / "samples.parquet").read_bytes()


def test_a_column_that_damage_gave_the_name_of_another_is_refused(
    tmp_path: Path, kept: tuple[Block, bytes]
) -> None:
    at = kept[1].index(b"\x02ay", len(kept[1]) - 4000)  # in the schema, at the end
    whole = kept[1][:at] + b"\x02ax" + kept[1][at + 3 :]
    path = tmp_path / "samples.parquet"
    path.write_bytes(whole)
    with pytest.raises(SessionError, match="is not a whole Parquet file"):
        sample_files.read_samples(path)
    with pytest.raises(SessionError, match="is not a whole Parquet file"):
        list(sample_files.iterate_samples(path))


@settings(max_examples=150, deadline=None)
@given(
    near_end=st.booleans(), at=st.integers(0, 2**31 - 1), changed=st.integers(1, 255)
)
def test_changed_bytes_of_an_imported_session_invent_no_sample(
    near_end: bool,
    at: int,
    changed: int,
    kept: tuple[Block, bytes],
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    block, whole = kept[0], bytearray(kept[1])
    within = 4000 if near_end else len(whole)
    whole[len(whole) - 1 - at % within] ^= changed
    path = tmp_path_factory.mktemp("changed") / "samples.parquet"
    path.write_bytes(whole)
    try:
        found, _, _ = sample_files.read_samples(path)
    except SessionError as error:
        assert str(error).startswith(f"{path}: ")
        return
    for name in ("t", "six"):
        np.testing.assert_array_equal(getattr(found, name), getattr(block, name))


def test_bytes_of_a_port_are_named_by_their_wire_format(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frames = b""
    for _ in range(60):
        for kind, values in ((0x51, (0, 0, 2048, 2500)), (0x52, (16, 0, 0, 2500))):
            body = struct.pack("<BB4h", 0x55, kind, *values)
            frames += body + bytes([sum(body) % 256])
    path = tmp_path / "port"
    path.write_bytes(b"noise" + frames)
    call = [str(path), "--rate", "100"]
    named = session(tmp_path / "a", *call, "--format", "witmotion").block
    found = session(tmp_path / "b", *call).block
    assert_same(named, found)
    assert len(named) >= 59
    np.testing.assert_allclose(named.acc[:, 2], 9.8, atol=0.02)
    assert main(["import", str(path), "--format", "morse"]) == 2
    said = capsys.readouterr().err
    assert "no format 'morse'" in said and "witmotion" in said and "csv_like" in said


@pytest.mark.parametrize("ending", ["mat", "h5", "npy"])
def test_fields_of_structures_are_arrays(tmp_path: Path, ending: str) -> None:
    block = imu(0, 40)
    records = np.zeros(
        len(block), [("time", "f8"), ("accel", "f8", 3), ("gyro", "f8", 3)]
    )
    records["time"], records["accel"], records["gyro"] = block.t, block.acc, block.gyr
    path = tmp_path / f"log.{ending}"
    if ending == "mat":
        from scipy.io import savemat

        inner = {name: records[name] for name in records.dtype.names or ()}
        savemat(path, {"device": {"imu": inner, "name": "left"}, "fs": 100.0})
    elif ending == "h5":
        import h5py

        with h5py.File(path, "w") as file:
            file["device/imu"] = records
    else:
        np.save(path, records)
    recording = open_recording(path, ReadOptions())
    (stream,) = recording.streams()
    got = concat(list(recording.blocks(stream.name)))
    np.testing.assert_allclose(got.t, block.t)
    np.testing.assert_allclose(got.acc, block.acc)
    np.testing.assert_allclose(got.gyr, block.gyr)


def test_a_folder_is_no_recording(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder; name the recording in it"):
        open_recording(tmp_path, ReadOptions())
    (tmp_path / "session.toml").write_text("format = 1\n")
    with pytest.raises(InputError, match="a session already, .* fieldcal solve "):
        open_recording(tmp_path, ReadOptions())
