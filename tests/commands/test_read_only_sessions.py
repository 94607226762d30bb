"""Sessions in folders that nobody may write to: the result is shown all the same."""

import errno
import json
from pathlib import Path

import pytest
from bench import five_positions

from fieldcal import observe
from fieldcal.cli import main
from fieldcal.core.errors import SessionError
from fieldcal.session.folder import Session
from fieldcal.solve import solve

UNEXAMINED = {"model": {"effects": ["nonsense"]}}
"""Of a session whose samples are not examined the means alone are solved."""

REFUSED = "/card/result.json: cannot be written: the disk is read-only: name another"


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return five_positions(tmp_path_factory.mktemp("card") / "s", UNEXAMINED)


@pytest.fixture(autouse=True)
def read_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may write everywhere, so the refusal comes from where files are written."""

    def refuse(*_: object) -> Path:
        raise SessionError(REFUSED)

    monkeypatch.setattr(Session, "write_json", refuse)


@pytest.mark.parametrize(
    ("command", "shows"),
    [
        ("solve", "acc bias x"),
        pytest.param("diagnose", "probability", marks=pytest.mark.thorough),
        ("noise", "white N"),
    ],
)
def test_it_is_shown_and_said_not_to_be_kept(
    session: Path,
    command: str,
    shows: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    own = five_positions(tmp_path / "s") if command == "diagnose" else session
    assert main([command, str(own)]) == 2
    out, err = capsys.readouterr()
    assert shows in out and "written" not in out
    said = err.splitlines()[-1]
    assert "the disk is read-only; what is shown holds, and is not kept: copy" in said


def test_a_program_gets_the_one_object_of_the_result(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["solve", str(session), "--json"]) == 2
    out, err = capsys.readouterr()
    assert json.loads(out)["verdict"] == "good" and "not kept" in err


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["apply", "SESSION", "OUT"], "x.csv"),
        (["apply", "SESSION", "OUT"], "x.parquet"),
        (["export", "SESSION", "--format", "mcap", "-o", "OUT"], "x.mcap"),
        (["batch", "SESSION", "--jobs", "1", "-o", "OUT"], "x.parquet"),
    ],
)
def test_a_disk_from_which_nothing_can_be_deleted_either(
    session: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    name: str,
) -> None:
    """Deleting the part of a file that could not be written ended in a crash."""
    (session / "result.json").write_text(json.dumps(solved(session)))
    monkeypatch.setenv("FIELDCAL_HISTORY", str(tmp_path / "h.sqlite"))

    def refuse(path: Path, missing_ok: bool = False) -> None:
        raise OSError(errno.EROFS, "Read-only file system", str(path))

    monkeypatch.setattr(Path, "unlink", refuse)
    out = str(tmp_path / "gone" / name)
    places = {"SESSION": str(session), "OUT": out}
    assert main([places.get(word, word) for word in arguments]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert f"{out}: cannot be written: the folder is not there: make it" in said


def solved(session: Path) -> dict[str, object]:
    """The result of a session, as solve would write it."""
    return solve(observe(Session.open(session))[0]).to_json()
