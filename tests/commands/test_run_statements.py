"""What an operator forgot to state, and states when the decision asks for it."""

from __future__ import annotations

import argparse
import errno
import json
import tomllib
from pathlib import Path

import pytest
from bench import five_positions

from fieldcal.cli import main
from fieldcal.commands.run import add_arguments
from fieldcal.commands.run_statements import write_statements
from fieldcal.core.errors import InputError, SessionError
from fieldcal.session.description_file import read_description
from fieldcal.session.marks import mark_line
from fieldcal.session.recorder import Recorder

RUN = {"procedure": "five_position", "device": "serial:/dev/nowhere"}


@pytest.fixture(autouse=True)
def history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIELDCAL_HISTORY", str(tmp_path / "history.sqlite"))


def stated(folder: Path, *options: str) -> bool:
    """Write what the options of `run --resume` state."""
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return write_statements(parser.parse_args(["--resume", *options]), folder)


def begun(folder: Path, **site: float) -> Path:
    with Recorder(folder, {"site": {"height_m": 0.0, **site}, "run": RUN}):
        return folder


def test_a_no_go_for_want_of_the_site_and_the_angles_becomes_go(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The options that the reasons name, behind --resume; no device is needed."""
    folder = five_positions(tmp_path / "s", {"site": {"height_m": 170.0}, "run": RUN})
    mark = mark_line({"event": "finished", "verdict": "good", "host_s": 0.0})
    (folder / "marks.jsonl").write_text(mark)
    (folder / "result.json").write_text(
        '{"method": "joint", "decision": {"go": false}}'
    )
    call = ["run", "--resume", str(folder), "--no-report", "--json"]
    assert main([*call, "--latitude", "50.45", "--angles", "0.001"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["decision"]["go"]
    assert json.loads((folder / "result.json").read_text())["decision"]["go"]


def test_what_is_stated_on_resuming_is_in_the_session(tmp_path: Path) -> None:
    folder = begun(tmp_path / "s", latitude_deg=50.0)
    assert stated(folder, "--angles", "0.01", "--level", "0.02", "--serial", "A1")
    about = read_description(folder / "session.toml")
    assert about.raw["site"]["angle_setting_deg"] == 0.01
    assert about.level_deg == 0.02 and about.device["serial"] == "A1"
    assert not about.keeps_gyro_bias
    assert stated(folder, "--keeps-gyro-bias")
    assert read_description(folder / "session.toml").keeps_gyro_bias
    assert stated(folder, "--angles", "0.02")  # stated anew
    assert not stated(folder)
    assert tomllib.loads((folder / "session.toml").read_text())["run"] == RUN


def test_a_further_device_stands_at_the_same_place(tmp_path: Path) -> None:
    further = {**RUN, "further": ["can:can1"]}
    folder = tmp_path / "s"
    for each in (folder, folder / "device-2"):
        with Recorder(each, {"site": {}, "run": further}):
            pass
    assert stated(folder, "--latitude", "50", "--serial", "A1")
    other = read_description(folder / "device-2" / "session.toml")
    assert other.latitude_deg == 50.0 and "serial" not in other.device


@pytest.mark.parametrize(
    "options",
    [("--latitude", "60"), ("--height", "5"), ("--serial", "B2"), ("--gravity", "9.8")],
)
def test_another_place_or_device_is_refused(
    tmp_path: Path, options: tuple[str, ...]
) -> None:
    site = {"latitude_deg": 50.0, "height_m": 0.0, "gravity": 9.81}
    device = {"serial": "A1"}
    with Recorder(tmp_path / "s", {"site": site, "device": device, "run": RUN}):
        pass
    before = (tmp_path / "s" / "session.toml").read_bytes()
    with pytest.raises(InputError, match="leave those options out, or begin a new run"):
        stated(tmp_path / "s", *options)
    assert (tmp_path / "s" / "session.toml").read_bytes() == before


def test_what_cannot_be_or_is_being_recorded_changes_nothing(tmp_path: Path) -> None:
    folder = begun(tmp_path / "s")
    before = (folder / "session.toml").read_bytes()
    with pytest.raises(InputError, match="latitude"):
        stated(folder, "--latitude", "95")
    with Recorder(folder, None):
        with pytest.raises(SessionError, match="records into it"):
            stated(folder, "--latitude", "50")
    assert (folder / "session.toml").read_bytes() == before


def test_a_session_on_a_disk_that_takes_nothing_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A memory card whose lock is on, copied from another laptop."""

    def refused(self: Path, *_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system", str(self))

    folder = begun(tmp_path / "s")
    monkeypatch.setattr(Path, "write_text", refused)
    with pytest.raises(SessionError, match=r"s: cannot be written: the disk is read-o"):
        stated(folder, "--latitude", "50")
