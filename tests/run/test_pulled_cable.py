"""A cable that is pulled between two positions, of a device that has its own supply."""

from __future__ import annotations

import json
import socket
import subprocess
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import pytest

pytest.importorskip("fastcrc")

from processes import HANGS, TWO_POSITION, simulated, steady

from fieldcal.model.rows.possible_restarts import possible_restarts
from fieldcal.session.folder import Session
from fieldcal.session.marks import read_marks


def order(control: str, **request: Any) -> None:
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(control)
        line.sendall(json.dumps(request).encode() + b"\n")
        assert b"error" not in line.recv(4096)


def wait(run: subprocess.Popen[str], folder: Path, event: str, times: int) -> None:
    deadline = monotonic() + HANGS
    while [m["event"] for m in read_marks(folder / "marks.jsonl")].count(event) < times:
        assert run.poll() is None and monotonic() < deadline
        sleep(0.02)


def test_two_positions_are_go_as_its_clock_shows_that_it_stayed_on(
    tmp_path: Path,
) -> None:
    session = tmp_path / "s"
    sim = ["--mavlink", "tcpin:127.0.0.1:0", "--speed", "20", "--rate", "100"]
    with simulated(*sim, "--gravity=9.81", *steady(tmp_path)) as (place, control):
        run = [*TWO_POSITION, "--gravity=9.81", "--seconds", "20", "--json", "--verify"]
        run += ["-o", str(session), "--device", f"mavlink:{place}?rate=100"]
        with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as process:
            wait(process, session, "window", 1)
            order(control, fault={"hangup_s": 5.0})
            order(control, turn={"alpha_deg": 45, "beta_deg": 5})
            wait(process, session, "window", 2)
            order(control, turn={"alpha_deg": 0, "beta_deg": 5})
            printed, _ = process.communicate()
    assert process.returncode == 0, json.loads(printed)["decision"]["reasons"]
    found = Session.open(session)
    ((start, end),) = found.about.gaps_without_restart
    assert found.windows[0] and found.windows[1]
    assert found.windows[0][1] < start < end - 1.0 < end < found.windows[1][0]
    assert possible_restarts(found.block, found.about) == []
