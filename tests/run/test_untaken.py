"""Positions that a session lacks, and how it is said to take them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.run.untaken import untaken_sentence
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder

PLACES = [
    {"name": "home", "alpha_deg": 0.0, "beta_deg": 0.0},
    {"name": "turned", "alpha_deg": 45.0, "beta_deg": 0.0},
    {"alpha_deg": 45.0, "beta_deg": 5.0},
]
RUN: dict[str, Any] = {"procedure": "positions", "seconds": 8.0}
THIRD = "3 (α = 45°, β = 5°)"
HZ, HELD = 50.0, 10.0


def recorded(
    folder: Path, taken: int, lost: int = 0, run: dict[str, Any] | None = RUN
) -> Session:
    """A session in which so many positions were held; of the last ones no sample is."""
    tables: dict[str, Any] = {"format": 1, "position": PLACES}
    if run is not None:
        tables["run"] = run
    rng, n = np.random.default_rng(1), int(HELD * HZ)
    with Recorder(folder, tables) as recorder:
        for i in range(taken):
            t = i * HELD + np.arange(n) / HZ
            force = [0.0, -9.81, 0.0] if i == 0 else [6.9, -6.9, 0.3 * i]
            acc = force + rng.normal(0, 0.01, (n, 3))
            if i < taken - lost:
                gyr = rng.normal(0, 1e-3, (n, 3))
                recorder.append(Block.of(t, acc, gyr, t_host=t))
            recorder.mark("window", position=i, start_s=t[0] + 0.5, end_s=t[-1] - 0.5)
    return Session.open(folder)


def test_a_run_that_was_stopped_names_what_it_lacks(tmp_path: Path) -> None:
    folder = tmp_path / "half done"
    assert untaken_sentence(recorded(folder, 1)) == (
        f"positions 2 (turned) and {THIRD} of the plan were not taken: fieldcal run"
        f" --resume '{folder}' goes on with the run"
    )
    assert untaken_sentence(recorded(tmp_path / "two", 2)) == (
        f"position {THIRD} of the plan was not taken: fieldcal run --resume"
        f" {tmp_path / 'two'} goes on with the run"
    )
    verifying = recorded(tmp_path / "v", 3, run={**RUN, "verify": True})
    assert untaken_sentence(verifying).startswith(
        "the position that verifies was not taken: fieldcal run"
    )


def test_a_run_without_a_result_has_more_to_do(tmp_path: Path) -> None:
    stopped = recorded(tmp_path / "s", 3)
    assert untaken_sentence(stopped) == (
        "the run has not come to its result: fieldcal run --resume"
        f" {tmp_path / 's'} goes on with the run"
    )
    with Recorder(tmp_path / "s", None) as recorder:
        recorder.mark("finished")
    assert untaken_sentence(Session.open(tmp_path / "s")) == ""


def test_a_recording_in_another_file_is_not_gone_on_with(tmp_path: Path) -> None:
    recorded(tmp_path / "s", 2)
    (tmp_path / "s" / "samples.arrows").unlink()
    (tmp_path / "s" / "samples.csv").write_text("t,ax,ay,az\n5,0,-9.8,0\n")
    assert untaken_sentence(Session.open(tmp_path / "s")) == (
        "no sample is left of position 2 (turned); position"
        f" {THIRD} of the plan was not taken"
    )


def test_a_run_in_progress_is_not_told_to_go_on(tmp_path: Path) -> None:
    recorded(tmp_path / "s", 2)
    said = f"position {THIRD} of the plan was not taken: "
    with Recorder(tmp_path / "s", None):
        now = untaken_sentence(Session.open(tmp_path / "s"))
    assert now == f"{said}it is being recorded"
    assert untaken_sentence(Session.open(tmp_path / "s")).startswith(f"{said}fieldcal")


def test_what_was_taken_and_lost_is_told_apart(tmp_path: Path) -> None:
    assert untaken_sentence(recorded(tmp_path / "s", 2, lost=1)) == (
        f"no sample is left of position 2 (turned); position {THIRD} of the plan was"
        f" not taken: fieldcal run --resume {tmp_path / 's'} goes on with the run"
    )


def test_a_further_device_goes_on_with_the_first(tmp_path: Path) -> None:
    tables = {
        "format": 1, "device": {"address": "b"}, "position": PLACES,
        "run": {**RUN, "further": ["a", "b"]},
    }  # fmt: skip
    Recorder(tmp_path / "s" / "device-2", tables).close()
    t = np.arange(9) / HZ
    with Recorder(tmp_path / "s" / "device-2", None) as recorder:
        recorder.append(Block.of(t, np.ones((9, 3)), t_host=t))
    said = untaken_sentence(Session.open(tmp_path / "s" / "device-2"))
    assert said.endswith(f"--resume {tmp_path / 's'} goes on with the run")


def test_a_session_of_no_run_is_not_gone_on_with(tmp_path: Path) -> None:
    assert untaken_sentence(recorded(tmp_path / "s", 1, run=None)) == (
        f"positions 2 (turned) and {THIRD} have no window: state start_s and end_s of"
        " each in session.toml"
    )
    assert untaken_sentence(recorded(tmp_path / "all", 3, run=None)) == ""


def test_solve_and_diagnose_say_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded(tmp_path / "s", 2)
    lacks = f"position {THIRD} of the plan was not taken: fieldcal run --resume"
    main(["solve", str(tmp_path / "s"), "--json"])
    assert lacks in capsys.readouterr().err
    assert main(["diagnose", str(tmp_path / "s"), "--json"]) in (0, 1)
    told = capsys.readouterr()
    assert lacks in told.err
    assert any(lacks in each for each in json.loads(told.out)["warnings"])
