"""Sessions in folders that nobody may write to: the result is shown all the same."""

import json
from pathlib import Path

import pytest
from bench import five_positions

from fieldcal.cli import main
from fieldcal.core.errors import SessionError
from fieldcal.session.folder import Session

REFUSED = "/card/result.json: cannot be written: the disk is read-only: name another"


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return five_positions(tmp_path_factory.mktemp("card") / "s")


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
        pytest.param("noise", "white N", marks=pytest.mark.thorough),
    ],
)
def test_it_is_shown_and_said_not_to_be_kept(
    session: Path, command: str, shows: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, str(session)]) == 2
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
