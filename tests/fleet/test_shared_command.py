"""`fieldcal diagnose --shared`: sessions from the store, and those that are not yet."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from test_shared import fleet

from fieldcal.cli import main
from fieldcal.fleet.outcome import SessionTask
from fieldcal.fleet.workers import WorkerPool
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import StoredSession


@pytest.fixture
def archive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Sessions that share an effect; the store has all but the last two."""
    made = {}
    value = np.array([0, 0, 3.0, 0, 0, 0])
    for i, one in enumerate(fleet(np.random.default_rng(1), 8, value)):
        folder = tmp_path / f"session {i}"
        folder.mkdir()
        (folder / "session.toml").write_text("format = 1\n")
        made[str(folder)] = one

    def solved(task: SessionTask, folder: str) -> StoredSession:
        one, mark = made[folder], task.fingerprint(Path(folder))
        return StoredSession(
            folder, one.serial, one.levels, result={}, fingerprint=mark,
            reduced=one.reduced,
        )  # fmt: skip

    monkeypatch.setattr(SessionTask, "__call__", solved)
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    monkeypatch.setattr("fieldcal.fleet.workers.process_pool", lambda *_: pool)
    database = Database(tmp_path / "h")
    for name in list(made)[:-2]:
        kept = solved(SessionTask(diagnose=True), name)
        database.run(lambda db, kept=kept: sessions.store_session(db, kept), write=True)  # type: ignore[misc]
    return ["diagnose", *made, "--shared", "--history", str(tmp_path / "h")]


def test_it_says_what_is_shared_and_by_whom(
    archive: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*archive, "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert len(said["sessions"]) == 8
    (effect,) = said["effects"]
    assert effect["id"] == "g_sensitivity" and effect["level"] == ["all"]
    (group,) = effect["groups"].values()
    assert group[0]["value"] == pytest.approx(1.5e-3, abs=5 * group[0]["sigma"])
    assert main(archive) == 1
    text = capsys.readouterr().out
    assert "g_sensitivity: by all, P = " in text and "every session" in text
    assert all(len(line) < 120 for line in text.splitlines())


def test_wrong_calls_are_refused(archive: list[str]) -> None:
    one = [archive[0], archive[1], *archive[-3:]]
    for wrong in ([*archive[:3]], one, [*archive, "--report"]):
        assert main(wrong) == 2
