"""What is said of a path that is no session."""

from __future__ import annotations

from pathlib import Path

import pytest

from fieldcal.core.errors import SessionError
from fieldcal.session.description_file import read_description


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("log.csv", r"log\.csv: is a file, no session; .* fieldcal import .*log\.csv$"),
        ("plan.toml", r"is a file, no session; .* fieldcal run .*plan\.toml$"),
        ("done/result.json", r"of a session; name the session's folder, .*done$"),
        ("empty", r"empty: is no session: it has no session\.toml; name a folder"),
        ("lost", r"lost: is no session: it is not there; name a folder"),
    ],
)
def test_a_path_that_is_no_session(tmp_path: Path, name: str, says: str) -> None:
    (tmp_path / "log.csv").write_text("t,ax\n0,1\n")
    (tmp_path / "plan.toml").write_text("[run]\n")
    (tmp_path / "empty").mkdir()
    (tmp_path / "done").mkdir()
    for file in ("session.toml", "result.json"):
        (tmp_path / "done" / file).write_text("")
    with pytest.raises(SessionError, match=says):
        read_description(tmp_path / name / "session.toml")
