"""Archives of telephones, as phyphox and the Sensor Logger write them."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

RATE = 50.0
LATE = 3e-3
"""What the gyroscope's samples lie behind the accelerometer's, s."""


def text(heading: str, rows: Array) -> str:
    lines = [",".join(f"{x:.17g}" for x in row) for row in rows]
    return "\n".join([heading, *lines]) + "\n"


def phyphox(rows: Array) -> dict[str, str]:
    axes = [f'"{{}} {axis} ({{}})"' for axis in "xyz"]
    acc = ",".join(one.format("Acceleration", "m/s^2") for one in axes)
    gyr = ",".join(one.format("Gyroscope", "rad/s") for one in axes)
    t = rows[:, :1]
    return {
        "Accelerometer.csv": text(f'"Time (s)",{acc}', np.hstack([t, rows[:, 1:4]])),
        "Gyroscope.csv": text(f'"Time (s)",{gyr}', np.hstack([t + LATE, rows[:, 4:]])),
        "meta/device.csv": "property,value\nmodel,x\n",
    }


def sensor_logger(rows: Array) -> dict[str, str]:
    t = rows[:, :1]
    heading = "time,seconds_elapsed,z,y,x"

    def of(three: Array, late: float) -> str:
        stamp = 1.7e18 + 1e9 * (t + late)
        return text(heading, np.hstack([stamp, t + late, three[:, ::-1]]))

    free = rows[:, 1:4] * 0.0
    return {
        "Accelerometer.csv": of(free, 0.0),
        "TotalAcceleration.csv": of(rows[:, 1:4], 0.0),
        "Gyroscope.csv": of(rows[:, 4:], LATE),
        "Metadata.csv": "version,device\n3,x\n",
    }


def packed(folder: Path, files: dict[str, str]) -> Path:
    path = folder / "log.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


@pytest.mark.parametrize("writes", [phyphox, sensor_logger])
def test_an_archive_needs_no_option(
    writes: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(writes)
    rows = turned(1, RATE, sides=7)
    path = packed(tmp_path, writes(rows))
    assert main(["import", str(path), "-o", str(tmp_path / "s")]) == 0
    session = Session.open(tmp_path / "s")
    block = session.block
    np.testing.assert_allclose(block.t - block.t[0], rows[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, rows[:, 1:4])
    np.testing.assert_allclose(block.gyr[:-1], rows[:-1, 4:])
    assert len(session.windows) >= 7


@pytest.mark.parametrize(
    ("files", "says"),
    [({"notes.csv": "a,b\n1,2\n", "more.csv": "x"}, "has no file of an accelerometer"),
     ({"readme.txt": "x", "log.txt": "y"}, "no .csv files")],
)  # fmt: skip
def test_other_archives_are_refused(
    files: dict[str, str],
    says: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = packed(tmp_path, files)
    assert main(["import", str(path)]) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1


def newer(content: bytes) -> bytes:
    """An archive whose list says that it takes version 8.3 to read it."""
    at = content.index(b"PK\x01\x02")
    return content[: at + 6] + bytes([83]) + content[at + 7 :]


@pytest.mark.parametrize("spoil", [lambda content: content[:-200], newer])
def test_an_archive_that_is_spoilt_is_one_sentence(
    spoil: Callable[[bytes], bytes],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = packed(tmp_path, phyphox(turned(2, RATE)))
    path.write_bytes(spoil(path.read_bytes()))
    assert main(["import", str(path)]) == 2
    assert "cannot be read" in capsys.readouterr().err


def in_turn(rows: Array) -> str:
    """Rows of which each holds one sensor, as if two logs were merged by time."""
    lines = [(t, f"{a:.6f},{b:.6f},{c:.6f},,,") for t, a, b, c in rows[:, :4].tolist()]
    lines += [(t + LATE, f",,,{a:.9f},{b:.9f},{c:.9f}")
              for t, a, b, c in rows[:, [0, 4, 5, 6]].tolist()]  # fmt: skip
    whole = [f"{t:.4f},{rest}" for t, rest in sorted(lines)]
    return "\n".join(["t,ax,ay,az,gx,gy,gz", *whole]) + "\n"


@pytest.mark.parametrize(
    ("way", "stamp"),
    [
        ("zip", "0.5"),
        ("join", ""),
        ("in turn", "0.5"),
        ("in turn", ""),
        pytest.param("zip", "", marks=pytest.mark.thorough),
        pytest.param("join", "0.5", marks=pytest.mark.thorough),
        pytest.param("zip", "9999", marks=pytest.mark.thorough),
        pytest.param("join", "9999", marks=pytest.mark.thorough),
        pytest.param("in turn", "9999", marks=pytest.mark.thorough),
    ],
)
def test_a_wrong_time_of_the_gyroscope_costs_its_own_sample_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], way: str, stamp: str
) -> None:
    rows, at = turned(2, RATE), 700
    files = phyphox(rows)
    lines = (in_turn(rows) if way == "in turn" else files["Gyroscope.csv"]).splitlines()
    line = 1 + at if way != "in turn" else 2 + 2 * at
    lines[line] = f"{stamp},{lines[line].partition(',')[2]}"
    files["Gyroscope.csv"] = "\n".join(lines) + "\n"
    paths = [packed(tmp_path, files)]
    if way != "zip":
        names = ["Accelerometer.csv", "Gyroscope.csv"] if way == "join" else []
        paths = [tmp_path / name for name in names] or [tmp_path / "log.csv"]
        for path in paths:
            path.write_text(files.get(path.name, files["Gyroscope.csv"]))
    call = ["import", *map(str, paths), "-o", str(tmp_path / "s"), "--gyr-unit"]
    call += ["rad/s", *(["--join"] if way == "join" else [])]
    assert main(call) == 2
    place = (
        f"sample {at + 1} of its gyroscope" if way == "in turn" else f"line {at + 2}"
    )
    assert place in (said := capsys.readouterr().err) and "column t: " in said
    assert main([*call, "--repair"]) == 0
    assert place in (said := capsys.readouterr().err) and "left out" in said
    block = Session.open(tmp_path / "s").block
    assert np.flatnonzero(np.isnan(block.gyr[:, 0])).tolist() == [at]
    known = np.arange(len(rows)) != at
    np.testing.assert_allclose(block.gyr[known], rows[known, 4:], atol=1e-8)


@pytest.mark.parametrize("writes", [phyphox, sensor_logger])
def test_a_folder_that_an_archive_was_unpacked_to_is_read_as_it(
    writes: Callable[[Array], dict[str, str]], tmp_path: Path
) -> None:
    rows, folder = turned(1, RATE), tmp_path / "log"
    with zipfile.ZipFile(packed(tmp_path, writes(rows))) as archive:
        archive.extractall(folder)
    assert main(["import", str(folder), "-o", str(tmp_path / "s")]) == 0
    session = Session.open(tmp_path / "s")
    np.testing.assert_allclose(session.block.acc, rows[:, 1:4])
    np.testing.assert_allclose(session.block.gyr[:-1], rows[:-1, 4:])
    marks = (tmp_path / "s" / "marks.jsonl").read_text()
    assert "Gyroscope.csv" in marks


def test_the_sign_of_ios_is_turned_in_a_folder_too(tmp_path: Path) -> None:
    rows, folder = turned(1, RATE), tmp_path / "log"
    folder.mkdir()
    about = "version,platform,standardisation\n3,ios,false\n"
    for name, content in (sensor_logger(rows) | {"Metadata.csv": about}).items():
        (folder / name).write_text(content)
    assert main(["import", str(folder), "-o", str(tmp_path / "s")]) == 0
    np.testing.assert_allclose(Session.open(tmp_path / "s").block.acc, -rows[:, 1:4])


def test_another_folder_is_refused_with_what_is_in_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "Inertial.csv").write_text("t,ax,ay,az\n")
    assert main(["import", str(tmp_path), "-o", str(tmp_path / "s")]) == 2
    assert "name the recording in it, such as" in (said := capsys.readouterr().err)
    assert "Inertial.csv" in said
