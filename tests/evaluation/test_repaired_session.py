"""Samples as the device sent them, before windows are judged and averaged."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import CALM, WIDE, places, recorded, write_session

from fieldcal.calibration import limits
from fieldcal.cli import main
from fieldcal.commands.run_results import solve_and_decide
from fieldcal.core.errors import InputError
from fieldcal.evaluation.repaired_session import repaired_session
from fieldcal.history.store import History
from fieldcal.session.folder import RESULT, Session
from fieldcal.sim_device.vocabulary import checked_effect

HELD = places(WIDE[:7])
TAU = 0.6


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session whose outputs a program smoothed."""
    out = tmp_path_factory.mktemp("smoothed") / "s"
    effect = checked_effect("smoothing", {"acc": TAU, "gyr": TAU})
    profile = replace(CALM, effects=(*CALM.effects, effect))
    write_session(out, recorded(profile, HELD), HELD, model={"effects": ["nonsense"]})
    return out


def test_samples_are_those_of_the_device_without_the_program(folder: Path) -> None:
    right, (said,) = repaired_session(Session.open(folder))
    tau = float(said.split("time constant of ")[1].split()[0])
    assert tau == pytest.approx(TAU, rel=0.03)
    seconds, sigma = right.about.smoothing
    assert seconds[0] == seconds[1] == pytest.approx(tau, rel=0.03)
    assert np.all((0 < sigma) & (np.abs(seconds - TAU) < 4 * sigma))
    plain = recorded(CALM, HELD)
    still = np.abs(right.block.six - plain.six)[plain.t > plain.t[-1] - 5.0]
    noise = np.diff(plain.six, axis=0).std(axis=0)
    assert (still.mean(axis=0) < 0.05 * noise).all()


def test_a_direction_is_refused_before_its_filter_is_undone(folder: Path) -> None:
    """Without the filter its magnitudes differ, as those of accelerometers do."""
    session = Session.open(folder)
    acc = session.block.acc
    up = 9.80665 * acc / np.linalg.norm(acc, axis=1, keepdims=True)
    session.__dict__["block"] = replace(session.block, acc=up)
    with pytest.raises(InputError, match=r"magnitude 9\.80665 .* direction of gravity"):
        repaired_session(session)


def test_a_session_without_faults_is_the_same(tmp_path: Path) -> None:
    write_session(tmp_path / "s", recorded(CALM, HELD), HELD)
    session = Session.open(tmp_path / "s")
    assert repaired_session(session) == (session, ())


def test_a_run_ends_with_what_solve_says_of_its_session(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session = Session.open(folder)
    bounds = limits.read(session.grade)
    found = solve_and_decide(session, bounds, History(folder.parent / "history.db"))
    written = json.loads((folder / RESULT).read_text())
    assert main(["solve", str(folder), "--json"]) in (0, 1)
    solved = json.loads(capsys.readouterr().out)
    assert written["parameters"] == solved["parameters"]
    assert (
        "a program smoothed the outputs" in found.warnings[0] == solved["warnings"][0]
    )
