"""One writer a session: who comes second is told who is there, and harms nothing."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from fieldcal.core.errors import SessionError
from fieldcal.session.lock import LOCK, OWNER, SessionLock
from fieldcal.session.recorder import Recorder

HOLDS = """
import sys
from collections.abc import Iterator
from pathlib import Path
from fieldcal.session.recorder import Recorder
with Recorder(Path(sys.argv[1]), {"format": 1}):
    print("here", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def other(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that records into ``s``."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLDS, str(tmp_path / "s")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "here\n"
        yield process


def test_a_second_writer_is_told_who_is_there(
    tmp_path: Path, other: subprocess.Popen[str]
) -> None:
    folder = tmp_path / "s"
    before = {p.name: p.read_bytes() for p in folder.iterdir()}
    with pytest.raises(
        SessionError,
        match=rf"process {other.pid} of .*, since \d{{4}}-\d\d-\d\d \d\d:\d\d,",
    ):
        Recorder(folder, None)
    with pytest.raises(SessionError, match="records into it: end that run first"):
        Recorder(folder, {"format": 1})
    assert {p.name: p.read_bytes() for p in folder.iterdir()} == before
    other.communicate()
    Recorder(folder, None).close()
    assert not {LOCK, OWNER} & {p.name for p in folder.iterdir()}


def test_a_killed_writer_leaves_the_session_to_the_next(
    tmp_path: Path, other: subprocess.Popen[str]
) -> None:
    other.send_signal(signal.SIGKILL)
    other.wait()
    assert (tmp_path / "s" / OWNER).exists()
    Recorder(tmp_path / "s", None).close()


def test_one_process_is_one_writer_too(tmp_path: Path) -> None:
    first = SessionLock(tmp_path)
    with pytest.raises(SessionError, match=f"process {os.getpid()} "):
        SessionLock(tmp_path)
    (tmp_path / OWNER).write_text("{")
    with pytest.raises(SessionError, match="another process records into it"):
        SessionLock(tmp_path)
    first.release()
    first.release()
    SessionLock(tmp_path).release()


def test_a_refused_recorder_holds_nothing(tmp_path: Path) -> None:
    Recorder(tmp_path / "s", {"format": 1}).close()
    for _ in range(2):
        with pytest.raises(SessionError, match="holds a session already"):
            Recorder(tmp_path / "s", {"format": 1})
