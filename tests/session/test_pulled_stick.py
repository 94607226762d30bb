"""A stick that is pulled while a session is written: a real file system that dies.

A file system in a file is mounted and told to shut down without writing anything more,
as ext4 does when its disk is gone: every later access fails, and what was not on the
disk is not there when it is mounted again.
"""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from recorded import block, same

from fieldcal.cli import main
from fieldcal.session.folder import Session
from fieldcal.session.integrity import file_faults
from fieldcal.session.recorder import Recorder

fcntl = pytest.importorskip("fcntl", reason="shutting a file system down takes Linux")

SHUTDOWN, WITHOUT_A_WORD = 0x8004587D, 2
"""ext4's order to give up, and that nothing more is written (linux/fs.h)."""

SIZE = 32 << 20

MARKED = 550
"""Samples from one mark of `recorded.record` to the next."""

RECORDS = """
import sys
from pathlib import Path
from fieldcal.core.errors import SessionError
from recorded import record
try:
    record(Path(sys.argv[1]))
except SessionError as error:
    print(error)
"""


class Stick:
    """An ext4 in a file."""

    def __init__(self, folder: Path) -> None:
        self._image, self.folder = folder / "image", folder / "stick"
        self.folder.mkdir()
        self._image.touch()
        os.truncate(self._image, SIZE)
        make = ["mkfs.ext4", "-q", "-F", str(self._image)]
        subprocess.run(make, check=True, capture_output=True)

    def plug(self) -> bool:
        """Whether it could be mounted."""
        mount = ["mount", "-o", "loop", str(self._image), str(self.folder)]
        return not subprocess.run(mount, capture_output=True).returncode

    def pull(self) -> None:
        """Let every access fail from now on."""
        top = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.ioctl(top, SHUTDOWN, struct.pack("I", WITHOUT_A_WORD))
        finally:
            os.close(top)

    def put_away(self) -> None:
        subprocess.run(["umount", str(self.folder)], check=True)


@pytest.fixture
def stick(tmp_path: Path) -> Iterator[Stick]:
    programs = all(map(shutil.which, ("mkfs.ext4", "mount", "umount")))
    if not programs or os.geteuid():
        pytest.skip("mounting a file system takes root, mkfs.ext4 and mount")
    made = Stick(tmp_path)
    if not made.plug():
        pytest.skip("mounting is not allowed here")
    yield made
    made.put_away()


@pytest.mark.parametrize("lines", [1, 20, 90])
def test_what_was_on_the_disk_is_there_when_it_is_plugged_in_again(
    stick: Stick, lines: int
) -> None:
    folder = stick.folder / "session"
    command = [sys.executable, "-c", RECORDS, str(folder)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[1]
    ) as process:
        assert process.stdout is not None
        for _ in range(lines):
            written = int(process.stdout.readline())
        stick.pull()
        *_, said = process.stdout.read().strip().split("\n")
    assert process.returncode == 0
    assert said.startswith(f"{folder}: cannot be written: ")
    stick.put_away()
    assert stick.plug()
    on_disk = (written - 1) // MARKED * MARKED
    if not on_disk:
        # nothing was promised yet: not even that the folder is there
        return
    session = Session.open(folder)
    kept = len(session.block)
    assert kept >= on_disk
    assert same(session.block, block(0, kept))
    told = [m["text"] for m in session.marks()]
    assert f"{on_disk} samples" in told
    assert told == [f"{MARKED * (i + 1)} samples" for i in range(len(told))]
    assert all("cut off" in finding.text for finding in file_faults(folder))
    with Recorder(folder, None) as recorder:
        recorder.append(block(kept + 5000))
    assert len(Session.open(folder).block) == kept + 50


def test_what_was_imported_is_on_the_disk(stick: Stick, tmp_path: Path) -> None:
    rows = np.random.default_rng(1).normal(0, 0.01, (2_000, 6)) + [0, 0, 9.8, 0, 0, 0]
    np.savetxt(tmp_path / "x.csv", rows, delimiter=",")
    text, folder = str(tmp_path / "x.csv"), stick.folder / "x"
    wanted = ("--columns", "ax,ay,az,gx,gy,gz", "--rate", "100")
    assert main(["import", text, *wanted, "-o", str(folder)]) == 0
    stick.pull()
    stick.put_away()
    assert stick.plug()
    assert {path.name for path in stick.folder.iterdir()} == {"lost+found", "x"}
    assert not list(file_faults(folder))
    assert len(Session.open(folder).block) == 2_000
