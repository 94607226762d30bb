"""The line that a terminal shows while a command works."""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pyte
import pytest
from session_folders import CALM, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.commands import progress
from fieldcal.commands.console import EscapingConsole
from fieldcal.commands.progress import SHOWN_AFTER_S, show_work
from fieldcal.core.errors import InputError

WORK = "searching for the effects that explain bench-7"


class Terminal:
    """A terminal of 80 by 6 that a command has not written to yet."""

    def __init__(self) -> None:
        self.file = io.StringIO()
        self.console = EscapingConsole(
            self.file, force_terminal=True, width=80, height=6, color_system=None
        )

    def lines(self) -> list[str]:
        """What stands there now."""
        screen = pyte.Screen(80, 6)
        pyte.Stream(screen).feed(self.file.getvalue().replace("\n", "\r\n"))
        return [line.rstrip() for line in screen.display if line.strip()]

    def shown(self, took: float, inside: Callable[[], object] = lambda: None) -> str:
        """The line that stood there once the work had taken that long, s."""
        times = [0.0]
        with show_work(argparse.Namespace(), WORK, self.console, lambda: times[-1]):
            times.append(took)
            inside()
            self.console.print(end="")  # a drawing that does not wait for the next one
            lines = self.lines()
        return lines[-1] if lines else ""


def test_the_line_says_what_is_done_and_for_how_long() -> None:
    assert Terminal().shown(12.0) == f"{WORK}, 12 s so far"


def test_what_is_quick_has_no_line() -> None:
    assert Terminal().shown(0.9 * SHOWN_AFTER_S) == ""


def test_the_line_is_gone_when_the_answer_comes() -> None:
    terminal = Terminal()
    terminal.shown(12.0)
    terminal.console.print("LEFT OUT")
    assert terminal.lines() == ["LEFT OUT"]


def test_the_line_is_gone_when_the_work_fails() -> None:
    terminal = Terminal()
    before = sys.stderr

    def fails() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        terminal.shown(12.0, fails)
    assert terminal.lines() == [] and sys.stderr is before


def test_what_is_written_meanwhile_stands_above_and_stays() -> None:
    terminal = Terminal()
    terminal.shown(12.0, lambda: sys.stderr.write("a unit was left out\n"))
    assert terminal.lines() == ["a unit was left out"]


def test_a_name_cannot_draw_on_the_terminal() -> None:
    terminal = Terminal()
    with show_work(
        argparse.Namespace(),
        "reading \x1b[2J\n.csv",
        terminal.console,
        iter((0.0, *[9.0] * 99)).__next__,
    ):
        terminal.console.print(end="")
        assert terminal.lines() == [r"reading \x1b[2J\x0a.csv, 9 s so far"]


@pytest.mark.parametrize("option", ["json", "plain", "headless"])
def test_a_program_that_reads_gets_no_line(option: str) -> None:
    terminal = Terminal()
    args = argparse.Namespace(**{option: True})
    with show_work(args, WORK, terminal.console, iter((0.0, *[9.0] * 99)).__next__):
        terminal.console.print(end="")
    assert terminal.file.getvalue() == ""


def test_a_file_gets_no_line() -> None:
    file = io.StringIO()
    with show_work(argparse.Namespace(), WORK, EscapingConsole(file)):
        pass
    assert file.getvalue() == ""


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    held = places([(0.0, 0.0), (45.0, 5.0)], seconds=10.0)
    folder = tmp_path_factory.mktemp("work") / "s"
    return write_session(folder, recorded(CALM, held), held)


@pytest.mark.parametrize("command", ["solve", "diagnose", "noise"])
def test_the_commands_that_take_long_say_of_which_session(
    command: str, session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []

    @contextmanager
    def note(args: argparse.Namespace, what: str) -> Iterator[None]:
        said.append(what)
        raise InputError("this is all that is asked for")
        yield

    monkeypatch.setattr(progress, "show_work", note)
    assert main([command, str(session)]) == 2
    assert [str(session) in what for what in said] == [True]
