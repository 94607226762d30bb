"""A run that took no position is not in the way of the next, and is not lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from fieldcal.cli import main
from fieldcal.run.begun_before import set_untaken_aside
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder

TABLES = {"run": {"procedure": "two_position"}, "site": {"latitude_deg": 50.0}}


def begun(folder: Path, *events: str) -> dict[str, bytes]:
    """Record a run with some marks; return its files."""
    with Recorder(folder, TABLES) as recorder:
        for event in events:
            recorder.mark(event, position=0, start_s=1.0, end_s=2.0)
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_a_run_without_a_position_makes_room(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    for number in (1, 2):
        files = begun(folder, "asked", "wrong")
        aside = set_untaken_aside(folder)
        assert aside == tmp_path / f"s-before-{number}" and not folder.exists()
        assert {file.name: file.read_bytes() for file in aside.iterdir()} == files


@pytest.mark.parametrize("events", [("window",), ("window", "repeated")])
def test_a_run_with_a_position_stays(tmp_path: Path, events: tuple[str, ...]) -> None:
    folder = tmp_path / "s"
    begun(folder, "asked", *events)
    assert set_untaken_aside(folder) is None and Session.open(folder).about.raw["run"]


def test_what_is_not_of_a_run_alone_stays(tmp_path: Path) -> None:
    assert set_untaken_aside(tmp_path / "nowhere") is None
    folder = tmp_path / "s"
    begun(folder)
    (folder / "notes.txt").write_text("mine")
    assert set_untaken_aside(folder) is None
    (folder / "notes.txt").unlink()
    marks = folder / "marks.jsonl"
    marks.write_text('{"event": "win')
    assert set_untaken_aside(folder) is None  # it may have been a window
    marks.write_text("")
    with Recorder(folder, None):
        assert set_untaken_aside(folder) is None  # recorded by another process
    imported = tmp_path / "imported"
    with Recorder(imported, {"site": {"latitude_deg": 50.0}}):
        pass
    assert set_untaken_aside(imported) is None


def test_begun_again_with_another_mounting_by_the_same_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the run tells an operator whose device lies on another face."""
    folder = tmp_path / "s"
    begun(folder, "asked", "wrong")
    words = ["run", "two_position", "--level", "0.1", "--seconds", "2", "--no-report"]
    words += ["--virtual", "--speed", "max", "--headless", "--mounting=+x,-z,+y"]
    assert main([*words, "-o", str(folder)]) == 1  # two seconds are not enough for GO
    assert (tmp_path / "s-before-1" / "session.toml").exists()
    assert Session.open(folder).about.axes == ("+x", "-z", "+y")
    assert "s-before-1" in capsys.readouterr().err
