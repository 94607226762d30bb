"""Trees of sessions: everything that can be solved is, and what cannot says why."""

from __future__ import annotations

import argparse
import json
import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pyarrow.parquet as pq
import pytest
from session_folders import places, recorded, write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.commands import batch as command
from fieldcal.commands import progress
from fieldcal.core.errors import InputError
from fieldcal.fleet.batch import SessionBatch
from fieldcal.fleet.outcome import SessionTask
from fieldcal.fleet.reduced import ReducedSession
from fieldcal.fleet.tree import fingerprint, sessions_in
from fieldcal.fleet.workers import WorkerPool
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import StoredSession
from fieldcal.session.folder import RESULT
from fieldcal.sim_device.profile import Profile

TWO = [(0.0, 0.0), (45.0, 5.0)]


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sessions, and one with a word where a number belongs."""
    root = tmp_path_factory.mktemp("tree")
    held = places(TWO, seconds=6.0, gap=6.0)
    for number in (1, 2):
        block = recorded(Profile(), held, seed=number)
        device = {"serial": f"A{number}", "lot": "L7"}
        folder = root / f"station {number}" / "session"
        site = {"latitude_deg": 50.45, "height_m": 170.0, "station": str(number)}
        write_session(folder, block, held, device=device, site=site)
    broken = root / "x" / "broken"
    shutil.copytree(root / "station 1" / "session", broken)
    (broken / "session.toml").write_text(
        "device = {serial = ' A9', lot = 'L7'}\n[site]\nlatitude_deg = 'north'\n"
    )
    return root


@pytest.fixture
def inside(monkeypatch: pytest.MonkeyPatch) -> None:
    """Threads in the place of processes, which would import everything again."""
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    monkeypatch.setattr("fieldcal.fleet.workers.process_pool", lambda *_: pool)


@pytest.mark.usefixtures("inside")
def test_a_tree_is_solved_and_what_is_broken_has_a_row(
    tree: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store, table = str(tmp_path / "h.sqlite"), tmp_path / "t.parquet"
    some = [str(tree / name) for name in ("station 1", "x")]
    call = ["batch", *some, "--history", store, "-o", str(table), "--json"]
    assert main([*call, "--diagnose"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["done"] == 2
    broken = [one for one in said["sessions"] if one["error"]]
    assert len(broken) == 1 and "latitude_deg" in broken[0]["error"]
    assert "x/broken/session.toml" in broken[0]["error"]
    rows = pq.read_table(table).to_pylist()
    good = {r["serial"]: r for r in rows if not r["error"]}
    assert set(good) == {"A1"} and len(rows) == 2
    (failed,) = (r for r in rows if r["error"])
    assert (failed["serial"], failed["lot"]) == ("A9", "L7"), "a unit of its lot"
    assert good["A1"]["lot"] == "L7" and good["A1"]["station"] == "1"
    assert good["A1"]["verdict"] and good["A1"]["go"] is None

    alone = tree / "station 1" / "session"
    assert main(["solve", str(alone), "--json"]) in (0, 1)
    solved = Calibration.from_json(json.loads(capsys.readouterr().out))
    (alone / RESULT).unlink()
    for name in solved.names:
        assert good["A1"][name] == solved.value(name), "as solve has it"
        assert good["A1"][f"{name}.sigma"] == pytest.approx(solved.uncertainty(name))

    assert main([*call, "--diagnose", "--resume"]) == 1
    assert json.loads(capsys.readouterr().out)["done"] == 0
    kept = Database(store).run(
        lambda db: sessions.find_sessions(
            db, {"lot": "L7"}, documents=True, reduced=True
        )
    )
    (mine,) = (one for one in kept if one.serial == "A1")
    small = ReducedSession.from_bytes(mine.reduced or b"")
    assert {c.effect for c in small.columns} >= {"cross_coupling", "g_sensitivity"}
    assert np.linalg.eigvalsh(small.matrix)[0] > -1e-6 * np.trace(small.matrix)
    np.testing.assert_array_equal(
        ReducedSession.from_bytes(small.to_bytes()).rhs, small.rhs
    )


@pytest.mark.usefixtures("inside")
def test_a_log_file_says_how_far_a_batch_is(
    tree: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(progress, "NOTE_INTERVAL", 0.0)
    monkeypatch.setattr("fieldcal.fleet.outcome.SessionTask", Quick)
    call = ["batch", str(tree), "--history", str(tmp_path / "h")]
    main([*call, "-o", str(tmp_path / "t.parquet")])
    said = capsys.readouterr().err
    assert "1 of 3 sessions done, about 0 min left" in said
    assert "3 of 3 sessions done" in said


@pytest.mark.parametrize(
    ("outcomes", "says", "code"),
    [
        ([(True, True), (True, False)], "2 solved, 1 of 2 GO, 0 not good, 0 wi", 1),
        ([(True, None), (False, None)], "2 solved, none to be judged, 1 not good", 1),
        ([(True, True), (True, None)], "2 solved, 1 of 1 GO, 0 not good, 0 wit", 0),
    ],
)
def test_no_go_is_not_called_not_good(
    outcomes: list[tuple[bool, bool | None]],
    says: str,
    code: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = [StoredSession(f"/s/{i}", good=g, go=o) for i, (g, o) in enumerate(outcomes)]
    made = SimpleNamespace(
        stored_rows=lambda: [rows], database=Database(str(tmp_path / "h.sqlite"))
    )
    args = argparse.Namespace(json=False, output=tmp_path / "t.parquet")
    assert command._print_summary(args, cast(Any, made), 2) == code
    said = capsys.readouterr().out
    assert says in said and "column error" not in said


@pytest.mark.parametrize(
    ("ends", "code"), [(KeyboardInterrupt(), 130), (InputError("the store is gone"), 2)]
)
def test_who_hears_that_a_batch_ended_hears_how_it_goes_on(
    ends: BaseException,
    code: int,
    tree: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Interrupted, or as the store went away for good."""

    def ended(*_: object) -> None:
        raise ends

    monkeypatch.setattr(progress, "process_with_progress", ended)
    call = ["batch", str(tree), "--history", str(tmp_path / "h"), "-o"]
    assert main([*call, str(tmp_path / "t.parquet")]) == code
    said = capsys.readouterr().err
    assert "is stored; the same command with --resume" in said
    assert str(ends) in said


def test_a_row_has_the_folder_that_was_asked_for(tree: Path, tmp_path: Path) -> None:
    """Where a worker reaches it by another path, its row would not be found again."""
    link = tmp_path / "link"
    link.symlink_to(tree / "station 1", target_is_directory=True)
    one = SessionTask()(str(link / "session"))
    assert one.folder == str(link / "session") and one.result is not None


def test_what_is_known_of_a_broken_session_is_the_newest(tmp_path: Path) -> None:
    """A folder that failed is a row of its own until it has a result."""
    folder, store = tmp_path / "s", Database(tmp_path / "h.sqlite")
    folder.mkdir()

    def stored() -> sessions.StoredSession:
        one = SessionTask()(str(folder))
        store.run(lambda db: sessions.store_session(db, one), write=True)
        (row,) = store.run(sessions.find_sessions)
        return row

    (folder / "session.toml").write_text("[device\n")
    assert (stored().serial, stored().levels) == ("", {})
    (folder / "session.toml").write_text("device = {serial = 'A7', lot = 'L'}\n")
    one = stored()
    assert (one.serial, one.levels) == ("A7", {"lot": "L"}) and one.error


def quick(folder: str) -> sessions.StoredSession:
    """Stands for work that takes long."""
    return sessions.StoredSession(folder, fingerprint=fingerprint(Path(folder)))


class Quick(SessionTask):
    """A task that only looks."""

    def fingerprint(self, folder: Path) -> str:
        return fingerprint(folder)

    def __call__(self, folder: str) -> sessions.StoredSession:
        return quick(folder)


def test_it_goes_on_where_it_stopped_and_does_what_has_changed(
    tree: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "tree"
    shutil.copytree(tree, copy)
    found = sessions_in([copy, copy / "x"])
    assert len(found) == 3, "each once"
    batch = SessionBatch(found, Quick(), Database(tmp_path / "h"))
    done = batch.process(
        batch.unprocessed(), WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    )
    first = next(done).folder
    done.close()
    left = batch.unprocessed()
    assert first not in left and len(left) == 2
    list(batch.process(left, WorkerPool(lambda: ThreadPoolExecutor(1), 1)))
    assert batch.unprocessed() == []
    with (found[0] / "session.toml").open("a") as file:
        file.write("# mended\n")
    assert batch.unprocessed() == [str(found[0])]


def test_a_session_counts_again_if_the_copy_that_replaced_it_is_gone(
    tree: Path, tmp_path: Path
) -> None:
    first, second = tmp_path / "t" / "a", tmp_path / "t" / "b"
    shutil.copytree(tree / "station 1" / "session", first)
    data = Database(tmp_path / "h")

    def left() -> list[str]:
        every = SessionBatch(sessions_in([tmp_path / "t"]), SessionTask(), data)
        return [Path(folder).name for folder in every.unprocessed()]

    def done(folder: Path) -> None:
        one = SessionTask()(str(folder))
        data.run(lambda db: sessions.store_session(db, one), write=True)

    done(first)
    shutil.copytree(first, second)
    assert left() == ["b"]
    done(second)
    assert left() == []
    shutil.rmtree(second)
    assert left() == ["a"]
    done(first)
    assert left() == []
    (one,) = data.run(lambda db: sessions.find_sessions(db, once=True))
    assert one.folder == str(first)


@pytest.mark.parametrize("given", [True, False])
def test_other_limits_are_another_judgement(
    tree: Path, tmp_path: Path, given: bool
) -> None:
    """Whether the command names them or the session's own plan."""
    file, folder = tmp_path / "limits.toml", tmp_path / "session"
    shutil.copytree(tree / "station 1" / "session", folder)
    file.write_text("[tactical]\nacc_bias = 0.02\n")
    task = SessionTask(limits=str(file)) if given else SessionTask()
    if not given:
        with (folder / "session.toml").open("a") as about:
            about.write(f'[run]\nlimits = "{file.as_posix()}"\n')
    before = task.fingerprint(folder)
    assert task.fingerprint(folder) == before
    file.write_text("[tactical]\nacc_bias = 0.01\n")
    assert task.fingerprint(folder) != before
    file.unlink()  # is said when the session is processed
    if not given:
        assert task.fingerprint(folder) != before


class Unstorable(SessionTask):
    """A task of which one result is none that JSON can represent."""

    def fingerprint(self, folder: Path) -> str:
        return fingerprint(folder)

    def __call__(self, folder: str) -> sessions.StoredSession:
        made = quick(folder)
        return replace(made, result={"x": {1}}) if "station 1" in folder else made


def test_a_result_that_cannot_be_stored_costs_no_other(
    tree: Path, tmp_path: Path
) -> None:
    batch = SessionBatch(sessions_in([tree]), Unstorable(), Database(tmp_path / "h"))
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    done = list(batch.process(batch.unprocessed(), pool))
    (odd,) = [one for one in done if one.error]
    assert "station 1/session: its result cannot be stored" in (odd.error or "")
    assert batch.unprocessed() == [odd.folder], "it is tried again"
    (rows,) = batch.stored_rows()
    assert len(rows) == len(batch.folders)


def test_a_store_that_takes_nothing_ends_the_batch(tree: Path, tmp_path: Path) -> None:
    (tmp_path / "h").write_bytes(b"no database at all" * 100)
    batch = SessionBatch(sessions_in([tree]), Quick(), Database(tmp_path / "h"))
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    with pytest.raises(InputError, match="the history cannot be used"):
        list(batch.process([str(folder) for folder in batch.folders], pool))


@pytest.mark.skipif(os.name != "posix", reason="every name is Unicode elsewhere")
def test_a_folder_whose_name_is_not_utf_8_has_a_row(tree: Path, tmp_path: Path) -> None:
    for name in (b"caf\xe9", b"caf"):
        inner = tmp_path / os.fsdecode(name)
        shutil.copytree(tree / "station 1" / "session", inner)
    batch = SessionBatch(
        sessions_in([tmp_path]), SessionTask(), Database(tmp_path / "h")
    )
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    list(batch.process(batch.unprocessed(), pool))
    assert batch.unprocessed() == []
    batch.write(tmp_path / "t.parquet")
    good, bad = pq.read_table(tmp_path / "t.parquet").to_pylist()
    assert good["serial"] == "A1" and not good["error"]
    assert bad["folder"].endswith(r"caf\udce9")
    said = (
        rf"{bad['folder']}: the name caf\udce9 is not UTF-8; rename that file or folder"
    )
    assert bad["error"] == said


@pytest.mark.skipif(os.name != "posix", reason="every file can be read elsewhere")
def test_a_session_that_cannot_be_looked_at_stops_no_resumed_batch(
    tree: Path, tmp_path: Path
) -> None:
    shutil.copytree(tree, tmp_path / "tree")
    found = sessions_in([tmp_path / "tree"])
    batch = SessionBatch(found, Quick(), Database(tmp_path / "h"))
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    list(batch.process(batch.unprocessed(), pool))
    (found[0] / "samples.csv").symlink_to("nowhere")
    assert batch.unprocessed() == [str(found[0])]


def test_wrong_calls_are_refused(tree: Path, tmp_path: Path) -> None:
    for wrong in (
        [str(tmp_path / "none")],
        [str(tmp_path)],
        [str(tree), "--jobs", "0"],
    ):
        assert main(["batch", *wrong]) == 2
    assert command.DEFAULT_TABLE.endswith(".parquet")


@pytest.mark.parametrize(
    ("option", "content", "says"),
    [
        (["-o", "none/t.parquet"], "", "none/t.parquet: cannot be written"),
        (["-o", "."], "", "is a folder"),
        (["--limits", "none.toml"], "", "no such file of limits"),
        (["--limits", "some.toml"], "[navigation]\nsquareness = -1", "above 0"),
    ],
)
@pytest.mark.parametrize("resume", [[], ["--resume"]])
def test_what_is_needed_at_the_end_is_looked_at_first(
    tree: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    option: list[str],
    content: str,
    says: str,
    resume: list[str],
) -> None:
    """Before any session is processed: there would be a store."""
    monkeypatch.chdir(tmp_path)
    Path("some.toml").write_text(content)
    assert main(["batch", str(tree), *resume, "--history", "h.sqlite", *option]) == 2
    assert says in capsys.readouterr().err
    assert not Path("h.sqlite").exists()


def test_a_table_that_cannot_be_written_is_said_and_leaves_nothing(
    tree: Path, tmp_path: Path
) -> None:
    batch = SessionBatch(
        sessions_in([tree]), SessionTask(), Database(str(tmp_path / "h.sqlite"))
    )
    (tmp_path / "t.parquet").mkdir()
    with pytest.raises(InputError, match="t.parquet: cannot be written"):
        batch.write(tmp_path / "t.parquet")
    assert not list(tmp_path.glob(".*"))
