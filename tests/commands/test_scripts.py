"""What a script has of a command: exit codes, one object, events with time and end."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from bench import five_positions
from session_folders import places, recorded, write_session

from fieldcal.cli import COMMANDS, main
from fieldcal.commands import run
from fieldcal.run.operator.event_lines import lines_as_events
from fieldcal.run.operator.script import report_event
from fieldcal.sim_device.profile import Profile

FIELDCAL = [sys.executable, "-m", "fieldcal"]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return five_positions(tmp_path_factory.mktemp("scripts") / "s")


def test_a_reader_that_goes_changes_no_exit_code(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ["solve", str(session), "--as-printed"]
    whole = main(call)
    shown = capsys.readouterr()
    with subprocess.Popen(
        [*FIELDCAL, *call],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as solving:
        assert solving.stdout and solving.stderr
        solving.stdout.close()  # as head -0 does
        said = solving.stderr.read().decode()
        code = solving.wait()
    assert code == whole == 0 and "BrokenPipe" not in said
    assert "method: five_position" in shown.out and not shown.err


def test_a_reader_of_events_that_goes_ends_no_run(tmp_path: Path) -> None:
    """As of `2> >(head -1)`: result and exit code are those of any other run."""
    held = places([(0.0, 0.0), (45.0, 5.0)], seconds=6.0, gap=6.0)
    recording = write_session(tmp_path / "s", recorded(Profile(), held), held)
    call = [*FIELDCAL, "run", "two_position", "--headless", "--json", "--no-report"]
    call += ["--device", f"replay:{recording}?speed=max", "--seconds", "3"]
    with subprocess.Popen(
        [*call, "-o", str(tmp_path / "r")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as running:
        assert running.stdout and running.stderr
        running.stderr.close()
        told = json.loads(running.stdout.read())
        code = running.wait()
    assert code == (0 if told["decision"]["go"] else 1)


@pytest.mark.parametrize(
    "closed", [1, *(pytest.param(i, marks=pytest.mark.thorough) for i in (0, 2))]
)
def test_a_stream_that_was_closed_changes_no_exit_code(
    session: Path, closed: int
) -> None:
    """As of `>&-`, or of a service that has no console."""
    call = [*FIELDCAL, "solve", str(session), "--as-printed"]
    assert subprocess.run(
        call, preexec_fn=lambda: os.close(closed), check=False
    ).returncode == 0  # fmt: skip
    call[-2] += "-nowhere"
    assert subprocess.run(
        [*call, "--json"], preexec_fn=lambda: os.close(closed), check=False
    ).returncode == 2  # fmt: skip


FULL = Path("/dev/full")
"""An output that takes nothing, as a file on a disk that is full."""


@pytest.mark.skipif(not FULL.exists(), reason="this system has no full device")
@pytest.mark.parametrize("also", ["", "nowhere"])
def test_a_full_output_is_said_and_no_fault_of_the_program(
    session: Path, also: str
) -> None:
    """A result that cannot be written, and the object of a failure that cannot."""
    place = session / also
    with FULL.open("w") as full:
        call = [*FIELDCAL, "solve", str(place), "--as-printed", "--json"]
        ended = subprocess.run(
            call, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert ended.returncode == 2
    assert "Traceback" not in ended.stderr and "broke on" not in ended.stderr
    assert also or "the output cannot be written: the disk is full" in ended.stderr


@pytest.mark.parametrize("command", ["solve", "diagnose"])
def test_a_failure_is_an_object_too(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, str(tmp_path), "--json"]) == 2
    told = capsys.readouterr()
    failed = json.loads(told.out)
    assert failed["exit_code"] == 2 and "is no session" in failed["error"]
    assert failed["error"] in told.err
    assert main([command, str(tmp_path)]) == 2
    assert not capsys.readouterr().out


def test_events_have_a_time_and_an_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    held = places([(0.0, 0.0), (45.0, 5.0)], seconds=6.0, gap=6.0)
    recording = write_session(tmp_path / "s", recorded(Profile(), held), held)
    url = f"replay:{recording}?speed=max"
    call = ["run", "two_position", "--device", url, "--headless", "--patience", "0"]
    code = main([*call, "-o", str(tmp_path / "r"), "--no-report"])
    told = capsys.readouterr().err.splitlines()
    events = [json.loads(line) for line in told]
    times = [event["host_s"] for event in events]
    assert len(events) > 3 and times == sorted(times) and times[0] > 1.6e9
    assert events[-1]["event"] == "end" and events[-1]["exit_code"] == code
    assert [e["event"] for e in events].count("end") == 1
    assert code in (0, 1) or events[-1]["error"]


def test_an_option_that_is_not_there_is_an_event_as_well(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["run", "two_position", "--headless", "--bogus", "--json"]) == 2
    out, err = capsys.readouterr()
    (end,) = (json.loads(line) for line in err.splitlines())
    assert end["event"] == "end" and end["exit_code"] == 2
    assert "--bogus" in end["error"] and json.loads(out)["error"] == end["error"]


def test_lines_of_others_become_events_and_events_stay(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with lines_as_events():
        sys.stderr.write("first\n\nsec")
        sys.stderr.write("ond\n")
        report_event("place", position=1)
        sys.stderr.write("no end")
    sys.stderr.write("behind\n")
    *lines, last = capsys.readouterr().err.splitlines()
    events = [json.loads(line) for line in lines]
    told = [event.get("text", event["event"]) for event in events]
    assert told == ["first", "second", "place", "no end"]
    assert all(event["host_s"] > 1.6e9 for event in events) and last == "behind"


def test_the_last_event_has_the_exit_code_of_what_nobody_foresaw(
    session: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(run, "_run_and_show", broken)
    url = f"replay:{session}/samples.parquet?speed=max"
    call = ["run", "two_position", "--device", url, "--headless"]
    assert main([*call, "-o", str(tmp_path / "r")]) == 70
    end = json.loads(capsys.readouterr().err.splitlines()[-1])
    assert end["event"] == "end" and end["exit_code"] == 70
    assert "ZeroDivisionError" in end["error"] and "send in" in end["error"]


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_a_shell_completes_every_command(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    for name in COMMANDS:
        assert name in script
    assert "--resume" in script and "--details" in script


def test_a_result_of_ones_own_procedure_is_compared() -> None:
    from fieldcal.pytest_plugin import VirtualImu

    class Known(VirtualImu):
        def __init__(self) -> None:
            pass

        truth = {"acc_bias": [0.1, -0.2, 0.3]}

    device = Known()
    own = {"acc_bias": {"value": [0.101, -0.2, 0.3], "sigma": [1e-3] * 3}}
    device.assert_calibration(own)
    device.assert_calibration(own, within={"acc_bias": 0.002})
    with pytest.raises(pytest.fail.Exception, match="wanted 0.0005"):
        device.assert_calibration(own, within={"acc_bias": 5e-4})
    off = {"acc_bias": {"value": [0.2, -0.2, 0.3], "sigma": [1e-3] * 3}}
    with pytest.raises(pytest.fail.Exception, match="acc_bias.x = 0.2"):
        device.assert_calibration(off)
    with pytest.raises(TypeError, match="is no group of a calibration: write"):
        device.assert_calibration({"acc_bias": [1.0, 2.0, 3.0]})
