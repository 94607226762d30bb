"""A result of a session that has changed since is not used."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pytest
from session_folders import CALM, FACES, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.report.gather import gather
from fieldcal.report.overview import page_header
from fieldcal.session.folder import Session
from fieldcal.session.result_source import made_from, outdated_text


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = places(FACES)
    folder = tmp_path_factory.mktemp("solved") / "bench 7"
    write_session(folder, recorded(CALM, where, 5), where)
    assert main(["solve", str(folder), "--history", str(folder / "h.sqlite")]) in (0, 1)
    return folder


@pytest.fixture
def session(solved: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(solved, tmp_path / "bench 7"))


def another_latitude(folder: Path) -> None:
    path = folder / "session.toml"
    path.write_text(path.read_text().replace("50.45", "5.45"))


def a_longer_recording(folder: Path) -> None:
    path = folder / "samples.arrows"
    with pa.ipc.open_stream(path) as there:
        table = there.read_all()
    longer = path.with_suffix(".new")
    with pa.ipc.new_stream(longer, table.schema) as file:
        for batch in (*table.to_batches(), *table.slice(0, 10).to_batches()):
            file.write_batch(batch)
    longer.replace(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (another_latitude, "session.toml was changed"),
        (a_longer_recording, "samples were added or replaced"),
    ],
)
@pytest.mark.parametrize("named", ["", "result.json"])
def test_a_result_older_than_its_session_is_refused(
    change: Callable[[Path], None],
    said: str,
    named: str,
    session: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    order = ["compare", str(session / named), str(session / named)]
    assert main(order) == 0
    capsys.readouterr()
    change(session)
    assert main(order) == 2
    told = capsys.readouterr().err
    assert said in told
    assert f"fieldcal solve '{session}'" in told


def test_the_report_opens_with_it_instead_of_a_verdict(session: Path) -> None:
    before = page_header(gather(session))
    assert before.verdict != "outdated"
    another_latitude(session)
    after = page_header(gather(session))
    assert (after.verdict, after.tone) == ("outdated", "bad")
    assert "session.toml was changed" in after.advice
    assert "run fieldcal solve" in after.advice


def test_layout_and_comments_are_no_change(session: Path) -> None:
    path = session / "session.toml"
    before = made_from(session)
    path.write_text("# looked at\n\n" + path.read_text().replace(" = ", "   =  "))
    assert made_from(session) == before
    assert main(["compare", str(session), str(session)]) == 0


def test_once_it_is_solved_again_it_is_used(session: Path) -> None:
    another_latitude(session)
    history = ["--history", str(session / "h.sqlite")]
    assert main(["solve", str(session), *history]) in (0, 1)
    assert main(["compare", str(session), str(session)]) == 0


def test_a_result_by_itself_or_of_another_program_is_used(session: Path) -> None:
    result = json.loads((session / "result.json").read_text())
    assert result["made_from"] == made_from(session)
    assert not outdated_text(session.parent, result)
    alone = session.parent / "kept.json"
    shutil.copy(session / "result.json", alone)
    another_latitude(session)
    assert main(["compare", str(alone), str(alone)]) == 0
    del result["made_from"]
    Session.open(session).write_json("result.json", result)
    assert main(["compare", str(session), str(session)]) == 0
