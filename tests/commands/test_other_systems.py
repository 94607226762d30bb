"""Systems that lack what POSIX has, and terminals that lack letters."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from bench import five_positions
from rich.table import Table
from rich.text import Text

from fieldcal.commands import spelling
from fieldcal.commands.console import EscapingConsole
from fieldcal.commands.table import print_sentence
from fieldcal.run.operator.keyboard import WindowsKeys

BARE = """
import sys, signal, socket, os
for name in ("termios", "tty", "pty", "fcntl", "resource", "grp", "pwd"):
    sys.modules[name] = None
for module, names in ((signal, ("SIGHUP",)), (socket, ("AF_UNIX",)),
                      (os, ("openpty", "fork", "geteuid", "getuid", "setsid"))):
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
import importlib.util
found = importlib.util.find_spec
def bare(name, package=None):
    return None if sys.modules.get(name, 0) is None else found(name, package)
importlib.util.find_spec = bare
from fieldcal.cli import main
import json
codes = []
for command in json.loads(sys.argv[1]):
    codes.append(main(command))
    print("end of", command[0])
sys.exit(max(codes))
"""
"""A Python that has nothing of POSIX that Windows does not have."""


def without_posix(
    *commands: list[str], encoding: str = "cp1252"
) -> tuple[int, str, str]:
    """Carry out commands one after the other: largest exit code, and what they said."""
    done = subprocess.run(
        [sys.executable, "-c", BARE, json.dumps(commands)],
        capture_output=True,
        env={
            **os.environ,
            "PYTHONIOENCODING": encoding,
            "OPENBLAS_NUM_THREADS": "1",
            "COLUMNS": "120",
        },
        check=False,
    )
    out, err = (s.decode(encoding) for s in (done.stdout, done.stderr))
    return done.returncode, out, err


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return five_positions(tmp_path_factory.mktemp("bare") / "s")


@pytest.mark.thorough
def test_what_needs_no_terminal_runs_without_posix(session: Path) -> None:
    code, out, err = without_posix(
        ["solve", str(session), "--as-printed"],
        ["diagnose", str(session)],
        ["report", str(session)],
    )
    assert code in (0, 1) and "Traceback" not in err and "broke" not in err, err
    solved, rest = out.split("end of solve")
    diagnosed, reported = rest.split("end of diagnose")
    assert "acc bias x" in solved and "m/s" in solved
    assert "probability" in diagnosed
    assert "report.html" in reported and "end of report" in reported


@pytest.mark.thorough
def test_a_run_starts_without_posix_and_plays_a_recording(
    session: Path, tmp_path: Path
) -> None:
    url = f"replay:{session}/samples.parquet?speed=max"
    code, _, err = without_posix(
        ["run", "two_position", "--device", url, "--headless", "--no-report",
         "--patience", "0", "-o", str(tmp_path / "r")]
    )  # fmt: skip
    assert "broke" not in err and "Traceback" not in err, err
    assert code in (0, 1, 3)
    assert '"event": "place"' in err


def test_a_virtual_device_says_what_it_lacks() -> None:
    code, _, err = without_posix(
        ["sim", "--serial", "witmotion"],
        ["run", "two_position", "--virtual", "--headless"],
    )
    assert code == 3
    assert "pseudo-terminals and unix sockets" in err and "which this one lacks" in err


class Console:
    """What msvcrt is of a console on which some keys were pressed."""

    def __init__(self, keys: str) -> None:
        self.keys = list(keys)

    def kbhit(self) -> bool:
        return bool(self.keys)

    def getwch(self) -> str:
        return self.keys.pop(0)


def test_keys_of_a_windows_console(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "msvcrt", Console("x\xe0Q\x00;r\xe0S"))
    keys = WindowsKeys()
    keys.open()
    assert keys.read() == "xr" and keys.read() == ""
    keys.close()


def test_letters_that_a_terminal_lacks_are_spelled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = io.TextIOWrapper(io.BytesIO(), encoding="cp1252")
    plain = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", plain)
    spelling.use_spellings()
    for stream in (out, plain):
        stream.write("α = 22.5° ± 0.1° → β, χ² ≤ 3 σ ╭─┐ █")
        stream.flush()
    assert out.buffer.getvalue().decode("cp1252") == (
        "alpha = 22.5° ± 0.1° -> beta, chi² <= 3 sigma +-+ #"
    )
    assert plain.buffer.getvalue() == (
        b"alpha = 22.5 deg +- 0.1 deg -> beta, chi^2 <= 3 sigma +-+ #"
    )


def test_tables_and_lines_fit_in_letters_that_are_spelled_out() -> None:
    """A letter is measured as what is shown in its place: sigma is five wide."""
    out = io.TextIOWrapper(io.BytesIO(), encoding="cp1252", newline="\n")
    console = EscapingConsole(
        file=out, width=60, force_terminal=True, color_system=None
    )
    table = Table("parameter", "± 1σ", "σ")
    table.add_row("x", "0.1", Text.assemble("σ of ", ("α", "red")))
    console.print(table)
    print_sentence(console, "?   ", "each is known to 1σ, " * 9)
    out.flush()
    assert isinstance(out.buffer, io.BytesIO)
    lines = out.buffer.getvalue().decode("cp1252").splitlines()
    rows = [line.rstrip() for line in lines if line.startswith(("+", "|"))]
    assert len({len(row) for row in rows}) == 1 and "± 1sigma" in rows[1]
    assert "| sigma " in rows[3] and any("| alpha " in row for row in rows)
    assert max(map(len, lines)) <= 60 and "" not in lines
