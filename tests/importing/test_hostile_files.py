"""Files that no recorder writes: each ends in one sentence and leaves nothing."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from logs import imu
from mcap.writer import Writer
from small_files import SMALL

from fieldcal.cli import main
from fieldcal.commands.import_recording import stream_folders
from fieldcal.session.marks import mark_line

NAMES = "t,ax,ay,az,gx,gy,gz"


def assert_refused(*arguments: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main([*arguments]) == 2
    said = capsys.readouterr().err
    assert len(said.strip().splitlines()) == 1
    return said


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = " + "[" * 5000, "nested too deeply"),
        ("[site]\nlatitude_deg = " + "9" * 5000, "a number of thousands of digits"),
    ],
)
def test_toml_without_end(
    tmp_path: Path, text: str, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "session.toml").write_text(f"format = 1\n{text}\n")
    limits = tmp_path / "limits.toml"
    limits.write_text(text)
    assert says in assert_refused("solve", str(tmp_path), capsys=capsys)
    plan = ["run", "two_position", "--virtual", "--limits", str(limits)]
    assert says in assert_refused(*plan, "-o", str(tmp_path / "s"), capsys=capsys)


def table(cells: Mapping[tuple[int, int], str]) -> str:
    """Rows of a device at rest at 100 Hz, with other texts in some cells."""
    rng = np.random.default_rng(3)
    rows = []
    for i in range(400):
        values = [
            0.01 * i,
            *(np.array([0, 0, 9.81, 0, 0, 0]) + 0.01 * rng.standard_normal(6)),
        ]
        row = [f"{v:.5f}" for v in values]
        for j in range(7):
            row[j] = cells.get((i, j), row[j])
        rows.append(",".join(row))
    units = [*(f"{c} [m/s^2]" for c in ("ax", "ay", "az")),
             *(f"{c} [rad/s]" for c in ("gx", "gy", "gz"))]  # fmt: skip
    return "\n".join([",".join(["t [s]", *units]), *rows]) + "\n"


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        ({(5, 3): "1e300"}, "line 7, column az: is larger than any sensor's"),
        ({(5, 3): "inf"}, "line 7, column az: is infinite"),
        ({(5, 6): "1,9,9"}, "line 7: has 9 columns, not 7"),
        ({(i, j): "nan" for i in range(400) for j in range(1, 7)}, "has no number of"),
    ],
    ids=["huge", "infinite", "two lines in one", "nothing"],
)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_tables_of_what_no_sensor_says(
    tmp_path: Path,
    cells: Mapping[tuple[int, int], str],
    says: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "log.csv").write_text(table(cells))
    arguments = ("import", str(tmp_path / "log.csv"), "-o", str(tmp_path / "s"))
    assert says in assert_refused(*arguments, capsys=capsys)
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize("text", ["[" * 100_000, '{"format": ' + "9" * 5000 + "}"])
def test_json_without_end(
    tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "session.toml").write_text("format = 1\n")
    (tmp_path / "result.json").write_text(text)
    folder = str(tmp_path)
    assert_refused("compare", folder, folder, capsys=capsys)
    assert_refused("export", folder, "--format", "json", capsys=capsys)
    assert_refused("undo", str(tmp_path / "result.json"), capsys=capsys)


@pytest.mark.parametrize("bits", ["0|100000", "510|16", "0|16@1- (1e999,0)"])
def test_a_signal_that_no_frame_holds(
    tmp_path: Path, bits: str, capsys: pytest.CaptureFixture[str]
) -> None:
    where = bits if "@" in bits else f"{bits}@1- (0.001,0)"
    others = "".join(
        f' SG_ {name} : {8 * i}|8@1- (1,0) [0|0] "{unit}" X\n'
        for i, (name, unit) in enumerate(
            [("ay", "g"), ("az", "g"), *((g, "rad/s") for g in ("gx", "gy", "gz"))]
        )
    )
    signal = f'SG_ ax : {where} [0|0] "g" X'
    dbc, log = tmp_path / "x.dbc", tmp_path / "x.log"
    dbc.write_text(
        f'VERSION ""\nBU_: X\nBO_ 256 F: 8 X\n {signal}\nBO_ 257 G: 8 X\n{others}'
    )
    log.write_text("(0.01) can0 100#0011223344556677\n" * 50)
    assert_refused("import", str(log), "--options", f"dbc={dbc}", capsys=capsys)


def test_an_empty_schema(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "empty.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        kind = writer.register_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
        topic = writer.register_channel("/imu", "cdr", kind)
        for i in range(9):
            writer.add_message(topic, i, bytes(400), i)
        writer.finish()  # type: ignore[no-untyped-call]
    for repair in ([], ["--repair"]):
        said = assert_refused("import", str(path), *repair, capsys=capsys)
        assert "none of the kind that they are called" in said


def test_a_schema_that_is_damaged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The library prints its line; what is said is said once, with the file's name."""
    path = tmp_path / "damaged.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        text = b"float64 x\n=\x1b[2J= y\n"
        kind = writer.register_schema("sensor_msgs/msg/Imu", "ros2msg", text)
        topic = writer.register_channel("/imu", "cdr", kind)
        writer.add_message(topic, 1, bytes(400), 1)
        writer.finish()  # type: ignore[no-untyped-call]
    said = assert_refused("import", str(path), capsys=capsys)
    assert "Error with" not in said and "\x1b[2J" not in said


@pytest.mark.parametrize("spacing", [5e-14, 1e-9])
def test_times_that_no_imu_has(
    tmp_path: Path, spacing: float, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = np.random.default_rng(1).normal(0, 0.01, (3000, 7))
    rows[:, 0], rows[:, 3] = spacing * np.arange(3000), rows[:, 3] + 9.81
    path = tmp_path / "quick.csv"
    np.savetxt(path, rows, delimiter=",", fmt="%.18g")
    columns = ["--columns", NAMES, "--time-unit", "s"]
    assert "no IMU does" in assert_refused("import", str(path), *columns, capsys=capsys)
    (tmp_path / "session.toml").write_text("format = 1\n")
    header = NAMES + "\n"
    (tmp_path / "samples.csv").write_text(header + path.read_text())
    assert "--time-unit" in assert_refused("diagnose", str(tmp_path), capsys=capsys)


def test_an_archive_that_unpacks_to_gigabytes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        with archive.open("imu.npy", "w", force_zip64=True) as file:
            np.lib.format.write_array_header_1_0(
                file, {"descr": "<f8", "fortran_order": False, "shape": (6 << 20, 7)}
            )
            for _ in range(7 * 48 // 8):
                file.write(bytes(1 << 23))
    said = assert_refused("import", str(path), "--columns", NAMES, capsys=capsys)
    assert "as no recording of a sensor does" in said


def test_a_device_is_no_file(capsys: pytest.CaptureFixture[str]) -> None:
    for named in ([], ["--format", "csv_like"]):
        assert "has no end" in assert_refused(
            "import", "/dev/zero", *named, capsys=capsys
        )


def test_a_pipe_is_no_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nobody writes into it: whoever opened it would wait for ever."""
    os.mkfifo(tmp_path / "log.csv")
    said = assert_refused("import", str(tmp_path / "log.csv"), capsys=capsys)
    assert "to a file" in said


def test_topics_that_differ_in_signs_have_folders_of_their_own() -> None:
    assert (
        len({*stream_folders(["/a/b", "/a_b", "/A_b", "a b", "..", "/"]).values()}) == 6
    )


def test_what_a_killed_import_left_is_named_and_removed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.csv"
    SMALL["csv_like"](path, imu(1, 60))
    left = tmp_path / ".s.abcdefgh"
    left.mkdir()
    (left / ".lock").write_text("")
    (left / "samples.parquet").write_bytes(b"half")
    call = ["import", str(path), "--columns", NAMES, "-o", str(tmp_path / "s")]
    assert main(call) == 0, capsys.readouterr().err
    assert ".s.abcdefgh, left by an import that was killed" in capsys.readouterr().err
    assert not [p.name for p in tmp_path.glob(".s.*")]
    assert not [p.name for p in (tmp_path / "s").iterdir() if p.name.startswith(".")]


def test_a_mark_is_json_whatever_its_numbers_are() -> None:
    line = mark_line({"event": "device", "x": [float("nan"), {"y": float("inf")}]})
    assert json.loads(line, parse_constant=pytest.fail)["x"] == [None, {"y": None}]
