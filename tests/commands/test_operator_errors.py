"""What a person may get wrong about a port: one sentence, exit code 3, nothing lost."""

from __future__ import annotations

import json
import os
import pty
import re
import tty
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from time import sleep
from typing import Any

import numpy as np
import pytest
from wires import STREAMS

pytest.importorskip("sqlite3")

from fieldcal.cli import main
from fieldcal.core.errors import SessionError
from fieldcal.drivers.driver import Driver, open_driver
from fieldcal.run.movers import VirtualMover
from fieldcal.run.plan_file import default_positions
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder


def failed(url: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The sentence that a run ends with."""
    run = ["run", "two_position", "--headless", "--device", url, "-o", str(folder)]
    assert main([*run, "--patience", "0"]) == 3
    events = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    *before, last = events
    if folder.exists():
        assert "--resume" in before[-1]["text"]
        assert "with --device if its port is another now" in before[-1]["text"]
    said = str(last["error"])
    assert not re.search(r"\.\s|[\[{<]|Error", said)
    return said


@pytest.mark.usefixtures("soon_silent")
def test_the_wrong_baud_rate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with VirtualMover(["--serial", "mip", "--baud", "921600"]) as device:
        url = f"serial:{device.port}?format=mip&baud=115200"
        said = failed(url, tmp_path / "s", capsys)
    assert "no format that is known; check the baud rate" in said
    sends = ["--serial", "mip", "--baud", "921600"]
    with VirtualMover(sends, once=False) as device:  # a probe comes and goes
        assert main(["ports", "--probe", "--seconds", "2", device.port]) == 0
    assert "?format=mip&baud=921600" in capsys.readouterr().out


@pytest.mark.usefixtures("soon_silent")
def test_the_wrong_format(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with VirtualMover(["--serial", "xsens"]) as device:
        said = failed(f"serial:{device.port}?format=mip", tmp_path / "s", capsys)
    assert said.endswith("these are no mip bytes; try format=xsens")


@pytest.mark.usefixtures("soon_silent")
def test_the_right_format_with_other_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = "t,ax,ay,az,gx,gy,gz"
    with VirtualMover(["--serial", f"text?columns={columns}"]) as device:
        url = f"serial:{device.port}?format=text&columns={columns[2:]}"
        said = failed(url, tmp_path / "s", capsys)
    assert f"this is text with other options; try format=text&columns={columns}" in said


@pytest.mark.usefixtures("soon_silent")
@pytest.mark.parametrize(
    "other", [pytest.param(False, marks=pytest.mark.thorough), True]
)
def test_a_run_that_heard_nothing_is_not_in_the_way_of_the_next(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], other: bool
) -> None:
    """The same command again, with the format that it said."""
    folder, report = tmp_path / "s", tmp_path / "run.xml"
    if other:
        folder.mkdir()
        (folder / "notes.txt").write_text("mine")
    words = [
        "run",
        "two_position",
        "--headless",
        "--patience",
        "0",
        "--junit",
        str(report),
    ]
    with VirtualMover(["--serial", "xsens"]) as device:
        url = f"serial:{device.port}?format=mip"
        assert main([*words, "--device", url, "-o", str(folder)]) == 3
    assert "to go on" not in capsys.readouterr().err
    assert "try format=xsens" in report.read_text()
    assert [p.name for p in tmp_path.glob("s/*")] == ["notes.txt"] * other
    assert folder.exists() == other
    with Recorder(folder, {"grade": "tactical"}):
        pass


def test_the_same_command_once_more_leaves_the_run_that_goes_on_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a second terminal, before the first run has heard a sample."""
    folder, held = tmp_path / "s", default_positions("two_position")
    about = {"run": {"procedure": "two_position"}, "position": held}
    with Recorder(folder, about) as recorder:
        recorder.mark("asked", position=0)
        there = sorted(folder.iterdir())
        with VirtualMover(["--serial", "witmotion"], once=False) as device:
            for port in (device.port, "/dev/nowhere"):
                url = f"serial:{port}?format=witmotion"
                assert main(["run", "two_position", "--level", "0.1", "--headless",
                             "--device", url, "-o", str(folder)]) == 2  # fmt: skip
                assert "to go on" not in capsys.readouterr().err
                assert sorted(folder.iterdir()) == there
            urls = [f"serial:{device.port}?format=witmotion", "serial:/dev/nowhere"]
            for url in urls:  # the port may be one that only the first run can open
                assert main(["run", "--resume", str(folder), "--device", url]) == 2
                said = capsys.readouterr().err
                assert "records into it: end that run first" in said
                assert "to go on" not in said and "is kept in" not in said
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(SessionError, match="is no folder; name one"):
        Recorder(file, {"grade": "tactical"})


def test_what_was_typed_wrong_is_one_sentence_and_one_object(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["run", "two_position", "--latitude", "50,45", "--json"]) == 2
    out, err = capsys.readouterr()
    assert "write 50.45; see fieldcal run --help" in err and err.count("\n") == 1
    assert json.loads(out)["exit_code"] == 2
    assert main(["run", "--latitude", "north"]) == 2
    said = capsys.readouterr().err
    assert "--latitude: 'north' is no number; see fieldcal run --help" in said
    assert main(["plan", "--positions", "5.5"]) == 2
    said = capsys.readouterr().err
    assert "--positions: '5.5' is no whole number; see fieldcal plan --help" in said


def test_a_session_named_as_a_plan_goes_on_with_resume(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "bench 7"
    folder.mkdir()
    assert main(["run", str(folder)]) == 2
    said = capsys.readouterr().err
    assert f"{folder}: is a folder, no plan file" in said
    assert f"fieldcal run --resume '{folder}'" in said and "Errno" not in said


def test_a_recording_is_no_noise_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "rest.csv"
    log.write_text("t,ax,ay,az\n0,0,0,9.8\n")
    assert main(["plan", "--positions", "5", "--noise-of", str(log)]) == 2
    said = capsys.readouterr().err
    assert "rest.csv: is no noise.json" in said
    assert "name the folder of a session that has one" in said


@contextmanager
def somebody_else() -> Iterator[None]:
    """Have no rights for a while: those of root are laid down."""
    if os.geteuid():
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


def test_a_port_of_somebody_else(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    opened = os.open

    def without_rights(path: Any, *how: Any, **more: Any) -> int:
        # to the port only: the checkout may be in a folder that nobody else may read
        with somebody_else() if str(path) == str(port) else nullcontext():
            return opened(path, *how, **more)

    with TemporaryDirectory() as folder:
        port = Path(folder, "ttyUSB0")
        port.touch(mode=0o000)
        os.chmod(folder, 0o755)
        monkeypatch.setattr(os, "open", without_rights)
        said = failed(f"serial:{port}", tmp_path / "s", capsys)
    assert "no permission; add yourself to the group that owns it (dialout)" in said


def test_a_port_that_another_program_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with VirtualMover(["--serial", "xsens"]) as device:
        with open_driver(f"serial:{device.port}?format=xsens"):
            said = failed(f"serial:{device.port}?format=xsens", tmp_path / "s", capsys)
    assert said.endswith("another program has it open; close that first")


def test_half_a_frame_at_the_end(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stream = STREAMS["mip"](60, np.random.default_rng(0))
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    sent = b"".join(stream.pieces)[:-7]

    def dies(driver: Driver) -> None:
        os.write(ours, sent)
        while driver.health.received < len(sent):
            sleep(0.01)  # the kernel drops what lies in a pty that is closed
        os.close(ours)

    def opened(url: str) -> Driver:
        driver = open_driver(url)
        Thread(target=dies, args=(driver,), daemon=True).start()
        return driver

    monkeypatch.setattr("fieldcal.drivers.driver.open_driver", opened)
    url = f"serial:{os.ttyname(theirs)}?format=mip&reconnect=0"
    said = failed(url, tmp_path / "s", capsys)
    os.close(theirs)
    assert said.endswith("hung up: check cable and power, then start again")
    block = Session.open(tmp_path / "s").block
    np.testing.assert_allclose(block.six, stream.samples.six[:-1], rtol=1e-6)


def test_a_text_in_place_of_a_calibration(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("hello\n")
    assert main(["compare", str(text), str(text)]) == 2
    said = capsys.readouterr().err
    assert "notes.txt: is no calibration" in said and "session that was solved" in said


def test_to_go_on_with_the_last_run_where_there_is_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--resume"]) == 2
    said = capsys.readouterr().err
    assert "no run is in sessions" in said and "--resume FOLDER" in said
