"""What names and files say is shown on every output, and never carried out."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree.ElementTree import parse

import numpy as np
import pytest
import tomlkit
from hypothesis import given
from hypothesis import strategies as st
from rich.live import Live
from rich.table import Table
from session_folders import NINE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.commands.console import EscapingConsole
from fieldcal.core.escaping import INVISIBLE_CATEGORIES, escape_invisible, escape_line
from fieldcal.run import junit
from fieldcal.session import description_file
from fieldcal.sim_device.profile import Profile

EVIL = "\x1b]0;GO\x07\x1b[2J\x9b31m\u202e[link=http://x]up[/link][/]\r\x08"
NAMED = "left\x1b[2J\nverdict: good"

Said = Callable[..., str]


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Said:
    """Both streams of a command, in which nothing is to be carried out."""

    def call(*arguments: str) -> str:
        try:
            main(list(arguments))
        except SystemExit:
            pass
        both = "".join(capsys.readouterr())
        assert escape_invisible(both) == both
        return both

    return call


@given(st.text())
def test_nothing_unseen_is_left_and_what_is_shown_stays(text: str) -> None:
    import unicodedata

    once = escape_invisible(text)
    assert escape_invisible(once) == once
    assert not {unicodedata.category(c) for c in once if c not in "\n\t"} & {
        *INVISIBLE_CATEGORIES
    }
    assert "\n" not in escape_line(text)


def test_a_console_draws_and_carries_out_nothing() -> None:
    out = io.StringIO()
    console = EscapingConsole(file=out, force_terminal=True, width=200)
    console.print(EVIL, style="bold")
    table = Table("name")
    table.add_row(EVIL)
    console.print(table)
    with Live(table, console=console, screen=False, auto_refresh=False) as live:
        live.refresh()
    drawn = out.getvalue()
    assert "\x1b[1m" in drawn  # what the console itself draws with
    for word in ("\x1b]0", "\x1b[2J", "\x9b", "\u202e", "\x1b]8"):
        assert word not in drawn
    assert "[link=http://x]up[/link][/]" in drawn and r"\x1b]0;GO" in drawn


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = [{**p, "name": f"{NAMED} {i}"} for i, p in enumerate(places(NINE[:6]))]
    folder = tmp_path_factory.mktemp("evil") / "s"
    block = recorded(Profile(), where)
    device = {"name": EVIL, "serial": EVIL}
    return write_session(folder, block, where, device=device)


@pytest.mark.parametrize(
    "command",
    [
        pytest.param("solve", marks=pytest.mark.thorough),
        pytest.param("diagnose", marks=pytest.mark.thorough),
        "verify",
    ],
)
def test_names_of_positions(session: Path, said: Said, command: str) -> None:
    both = said(command, str(session))
    assert "left\\x1b[2J\\x0averdict" in both or "left" not in both
    assert said("report", str(session))


def test_names_in_a_plan_and_on_the_lines_of_a_run(
    session: Path, said: Said, tmp_path: Path
) -> None:
    where = [
        {"alpha_deg": a, "beta_deg": b, "name": NAMED} for a, b in ((0, 0), (45, 5))
    ]
    plan = tmp_path / "plan.toml"
    tables = {"position": where, "run": {"seconds": 5.0, "give_up_s": 5.0}}
    plan.write_text(tomlkit.dumps(tables))
    report = tmp_path / "run.xml"
    run = ["run", str(plan), "--plain", "--virtual", "--speed", "20", "--no-report"]
    both = said(*run, "-o", str(tmp_path / "s"), "--junit", str(report))
    assert "left\\x1b[2J\\x0averdict: good" in both
    names = [case.get("name", "") for case in parse(report).getroot().iter("testcase")]
    assert names[0] == "1: left\\x1b[2J\\x0averdict: good"
    assert "left" not in said("plan", "--positions", "5", "--device", EVIL)


@pytest.mark.thorough
def test_serial_numbers_in_the_history(
    session: Path, said: Said, tmp_path: Path
) -> None:
    file = str(tmp_path / "history")
    assert main(["solve", str(session), "--history", file]) in (0, 1, 2)
    for arguments in ([], [EVIL], ["nobody\x1b[2J"]):
        said("history", *arguments, "--history", file)


def test_names_of_arrays_and_of_files(said: Said, tmp_path: Path) -> None:
    path = tmp_path / "a\x1b[2J\nb.npz"
    arrays: Any = {"x\x1b[2J\ny": np.zeros((50, 7))}
    np.savez(path, **arrays)
    listed = said("import", "--list", str(path))
    assert "a\\x1b[2J\\x0ab.npz" in listed and len(listed.splitlines()) == 1
    assert "x\\x1b[2J\\x0ay" in listed
    said("import", str(path), "-o", str(tmp_path / "s"))
    said("solve", str(path))
    said("run", EVIL)


@given(st.text(), st.text())
def test_junit_is_well_formed_whatever_a_name_holds(name: str, text: str) -> None:
    about = description_file.parse_description(
        {"position": [{"alpha_deg": 0.0, "beta_deg": 0.0, "name": name}]}
    )
    marks = [{"event": "wrong", "position": 0, "text": text}]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.xml"
        junit.write(path, "two_position", about.positions, marks, None, text)
        root = parse(path).getroot()
    assert [element.tag for element in root] == ["testcase", "testcase"]
