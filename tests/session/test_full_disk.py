"""A disk that is full, small and real: what is said, and what is left on it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from recorded import block
from session_folders import NINE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.evaluation.observations import observe
from fieldcal.session.folder import RESULT, Session
from fieldcal.session.integrity import file_faults
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device.profile import Profile
from fieldcal.solve import solve

SIZE = 300_000
ABOUT = {"format": 1, "position": [{"alpha_deg": 0.0, "beta_deg": 0.0}]}


@pytest.fixture
def stick(tmp_path: Path) -> Iterator[Path]:
    """A disk of 300 kB with a session on it."""
    folder = tmp_path / "stick"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "fieldcal", str(folder)]
    if os.name != "posix" or shutil.which("mount") is None or os.geteuid():
        pytest.skip("mounting a small disk takes root on Linux")
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("mounting is not allowed here")
    try:
        with Recorder(folder / "before", ABOUT) as recorder:
            recorder.append(block(0, 300))
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def fill(stick: Path, left: int = 0) -> None:
    """Leave so many bytes free."""
    room = os.statvfs(stick)
    free = room.f_bavail * room.f_frsize
    (stick / "fill").write_bytes(bytes(max(0, free - left)))


def assert_refused(
    stick: Path, capsys: pytest.CaptureFixture[str], *call: str, left: str = ""
) -> None:
    """The command ends with one sentence, and leaves but what is named."""
    there = {path.name for path in stick.iterdir()}
    capsys.readouterr()
    assert main(list(call)) == 2
    last = capsys.readouterr().err.strip().splitlines()[-1]
    if "--headless" in call:
        last = f"fieldcal {call[0]}: {json.loads(last)['error']}"
    assert last.startswith(f"fieldcal {call[0]}: {stick}")
    assert "the disk is full: make room on it, or name another" in last
    assert {path.name for path in stick.iterdir()} - there == (
        {left} if left else set()
    )
    assert not list(file_faults(stick / "before"))
    assert len(Session.open(stick / "before").block) == 300


def test_nothing_half_written_is_left(
    stick: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "source"
    with Recorder(source, ABOUT | {"site": {"gravity": 9.81}}) as recorder:
        recorder.append(block(0, 2_000))
    np.savetxt(tmp_path / "x.csv", np.random.default_rng(1).normal(0, 1, (2_000, 7)))
    fill(stick, 8192)
    there = str(stick / "new")
    text = str(tmp_path / "x.csv")
    wanted = ["--columns", "_,ax,ay,az,gx,gy,gz", "--rate", "100"]
    wanted += ["--acc-unit", "m/s^2", "--gyr-unit", "rad/s"]
    assert_refused(stick, capsys, "import", text, *wanted, "-o", there)
    assert_refused(stick, capsys, "report", str(source), "-o", f"{there}.html")


def test_results_are_written_whole_or_not_at_all(
    stick: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    held = places(NINE[:3], seconds=6.0, gap=6.0)
    copy = write_session(tmp_path / "s", recorded(Profile(), held), held)
    session = Session.open(copy)
    session.write_json(RESULT, solve(observe(session)[0]).to_json())
    fill(stick)
    for kind in ("ardupilot", "json", "mcap"):
        out = str(stick / f"new.{kind}")
        assert_refused(stick, capsys, "export", str(copy), "--format", kind, "-o", out)
    for ending in (".csv", ".csv.gz", ".parquet"):
        assert_refused(stick, capsys, "apply", str(copy), str(stick / f"new{ending}"))


def test_a_run_keeps_what_found_room(
    stick: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ("run", "two_position", "--virtual", "--speed", "20", "--headless", "-o")
    fill(stick)
    assert_refused(stick, capsys, *call, str(stick / "run"))
    (stick / "fill").unlink()
    fill(stick, 100_000)
    assert_refused(stick, capsys, *call, str(stick / "run"), left="run")
    kept = Session.open(stick / "run").block
    assert len(kept) > 300 and (np.diff(kept.t) > 0).all()
    says = [finding for finding in file_faults(stick / "run")]
    assert len(says) == 1 and "whole rows are used" in str(says[0])
