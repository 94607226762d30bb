"""The command line: help, usage and exit codes, without a device."""

import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import pytest
from processes import FIELDCAL

from fieldcal.cli import COMMANDS, main
from fieldcal.commands.help import CommandParser

ZERO_G = "[site]\ngravity = 0.0\n"


def fieldcal(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [*FIELDCAL, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_with_an_example_and_the_exit_codes(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main([name, "--help"])
    assert end.value.code == 0
    said = capsys.readouterr().out
    assert f"fieldcal {name}" in said.split("example", 1)[1]
    assert "0 good, 1 bad" in said and len(said.splitlines()) <= 48
    assert max(map(len, said.splitlines())) <= 80


@pytest.mark.parametrize("name", COMMANDS)
def test_all_of_the_help_has_every_option(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    module = import_module(f"fieldcal.commands.{COMMANDS[name][1]}")
    whole = CommandParser(module.EXAMPLE, getattr(module, "RARE", ()), prog="x")
    module.add_arguments(whole)
    said = whole.whole_help()
    assert "130  interrupted" in said
    rare = {a.dest: a.option_strings for a in whole._actions if a.option_strings}
    for dest in getattr(module, "RARE", ()):  # each is an option, and told of there
        line = f"\n  {rare[dest][0]}"
        assert line in said and line not in whole.format_help()
    if getattr(module, "RARE", ()):
        with pytest.raises(SystemExit) as end:
            main([name, "--help-all"])
        assert end.value.code == 0 and "130  interrupted" in capsys.readouterr().out


def test_help_and_version(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in ([], ["--help"], ["--version"]):
        with pytest.raises(SystemExit) as end:
            main(arguments)
        assert end.value.code == 0
    assert "fieldcal 0." in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments",
    [["fly"], ["solve"], ["solve", "x", "--method", "magic"], ["run", "five_position"]],
)
def test_wrong_usage_ends_with_2(arguments: Sequence[str]) -> None:
    done = fieldcal(*arguments)
    assert done.returncode == 2 and done.stderr and not done.stdout


def test_a_command_that_does_not_exist_is_one_sentence(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["slove", "log"]) == main(["\x1b[2J"]) == 2
    near, none = capsys.readouterr().err.splitlines()
    assert near == (
        "fieldcal: there is no command 'slove': did you mean solve? see fieldcal --help"
    )
    assert none.endswith(": see fieldcal --help") and "\x1b" not in none


def test_an_option_stands_behind_its_command(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "solve", "s"]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert "no option '--json': name the command first" in said


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["compare", "gone", "gone"], "gone: is not there; name the folder of a ses"),
        (["temperature", "gone", "also", "lost"], "is not there; name the folder of"),
        (["undo", "gone"], "gone: is not there; name the session that was written"),
        (["plan", "--of", "gone"], "gone: is not there; name a session's folder or"),
        (["import", "gone.csv"], "gone.csv: is not there; check its name"),
    ],
)
def test_what_is_not_there_is_not_to_be_solved_first(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: Sequence[str],
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert says in said and one_sentence(said) and "Errno" not in said
    assert not list(tmp_path.iterdir())


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys\nfrom fieldcal.cli import main\ntry:\n main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'pyarrow', 'rich', 'serial'} & set(sys.modules)\n"
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def one_sentence(text: str) -> bool:
    """Whether an error is one line that says something."""
    lines = text.strip().splitlines()
    return len(lines) == 1 and len(lines[0]) > 30 and "Traceback" not in text


@pytest.mark.parametrize(
    ("toml", "csv", "says"),
    [
        (
            ZERO_G,
            "t,ax,ay,az\n0,0,0,0\n",
            "gravity = 0.0 cannot be: give the",
        ),
        ("", "t,ax,ay,az\n0,0,0,0\n", "no [[position]]"),
        (
            "[[position]]\nalpha_deg = 0\nbeta_deg = 0\nstart_s = 0\nend_s = 9\n",
            "t,ax,ay,az\n0,x,0,0\n",
            "row 1, column ax: 'x' is not a number",
        ),
        (
            "[[position]]\nalpha_deg = 0\nbeta_deg = 0\nstart_s = 50\nend_s = 59\n",
            "t,ax,ay,az\n0,0,0,0\n1,0,0,0\n",
            "no samples lie between 50 and 59 s",
        ),
    ],
)
def test_a_session_that_cannot_be_solved_is_said_so_in_one_sentence(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    toml: str,
    csv: str,
    says: str,
) -> None:
    (tmp_path / "session.toml").write_text(toml)
    (tmp_path / "samples.csv").write_text(csv)
    assert main(["solve", str(tmp_path)]) == 2
    captured = capsys.readouterr()
    assert says in captured.err and one_sentence(captured.err) and not captured.out
    names = {p.name for p in tmp_path.iterdir()}
    assert names == {"session.toml", "samples.csv"}


@pytest.mark.parametrize(
    ("plan", "says"),
    [
        ("[[position]]\nalpha_deg = 0.0\nbeta_deg = 0.0\n" * 2, "are the same"),
        ("[[position]]\nalpha_deg = 0.0\nbeta_deg = 0.0\n", "are not enough"),
        ("[run]\nseconds = -1\n", "[run] seconds = -1 cannot be: give the averaging"),
        (
            "[run]\nprocedure = 'magic'\n",
            '[run] procedure = "magic" cannot be: write one of adaptive, ',
        ),
        ("run = 3\n", "write [run]"),
        ("x = [", "is no plan file"),
        (ZERO_G, "gravity = 0"),
    ],
)
def test_a_wrong_plan_is_refused_before_anything_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], plan: str, says: str
) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(plan)
    folder = tmp_path / "session"
    call = ["run", str(path), "--device", "serial:/dev/null", "-o", str(folder)]
    assert main(call) == 2
    said = capsys.readouterr().err
    assert says in said and one_sentence(said)
    assert not folder.exists()


@pytest.mark.parametrize(
    "error", [MemoryError(), ValueError("odd"), KeyError("x"), OSError("caf\udce9")]
)
def test_what_nobody_foresaw_is_no_verdict(
    error: Exception,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def breaks(_: object) -> int:
        raise error

    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("fieldcal.commands.verify.run", breaks)
    assert main(["verify", "some folder"]) == 70
    said = capsys.readouterr()
    (kept,) = tmp_path.glob("*.txt")
    assert not said.out and said.err.count("\n") == 1
    assert str(kept) in said.err and type(error).__name__ in said.err
    text = kept.read_text()
    assert "verify 'some folder'" in text and "in breaks" in text


def test_where_no_file_can_be_written_the_place_is_said_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    monkeypatch.setattr("fieldcal.commands.verify.run", lambda _: 1 // 0)
    assert main(["verify", "x"]) == 70
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "which"),
    [
        (["run", "--virtual", "-o", ""], "-o/--output"),
        (["solve", ""], "SESSION"),
        (["diagnose", "one", "  "], "SESSION"),
    ],
)
def test_an_empty_name_is_not_the_current_folder(
    words: list[str],
    which: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As of a variable of the shell that is not set."""
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    said = capsys.readouterr().err
    assert f"{which}: the name is empty" in said and "write ." in said
    assert not list(tmp_path.iterdir())
