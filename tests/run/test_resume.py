"""Going on after a break: nothing finished is lost, and no number is wrong."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from time import sleep, time

import numpy as np
import pytest
from processes import wait_for_samples

from benchmarks.kills import Bench, series, windows
from fieldcal.calibration import Calibration
from fieldcal.commands import run
from fieldcal.commands.decision_view import show_decision
from fieldcal.commands.help import CommandParser
from fieldcal.commands.run_task import make_task
from fieldcal.core.errors import InputError, SessionError
from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.core.samples import Block
from fieldcal.run import plan_file
from fieldcal.run.resuming import open_for_resume, positions_left_out, recorded_averages
from fieldcal.session import description_file
from fieldcal.session.folder import Session
from fieldcal.session.marks import MARKS
from fieldcal.session.recorder import SAMPLES, Recorder

TABLES = {
    "format": 1,
    "position": [
        {"alpha_deg": 0.0, "beta_deg": 0.0},
        {"alpha_deg": 45.0, "beta_deg": 5.0},
    ],
    "run": {"procedure": "two_position"},
}


def still(start: float, seconds: float, host: float, seed: int = 1) -> Block:
    """Samples of a device at home."""
    n = round(100 * seconds)
    rng, t = np.random.default_rng(seed), start + np.arange(n) / 100
    acc = [0.0, -9.81, 0.0] + 0.02 * rng.standard_normal((n, 3))
    gyr = 0.002 * rng.standard_normal((n, 3))
    return Block.of(t, acc, gyr, t_host=host + t - start)


def recorded(folder: Path) -> None:
    """A session of which the first position is taken, and the second begun."""
    with Recorder(folder, TABLES) as recorder:
        for k in range(15):
            recorder.append(still(float(k), 1.0, 1000.0 + k, k))
            recorder.flush()
            if k == 11:
                where = {"start_s": 1.0, "end_s": 11.0}
                recorder.mark("window", position=0, **where)


def test_whatever_was_cut_off_what_is_whole_is_gone_on_with(tmp_path: Path) -> None:
    recorded(tmp_path / "whole")
    data = (tmp_path / "whole" / SAMPLES).read_bytes()
    marks = (tmp_path / "whole" / MARKS).read_bytes()
    rng = np.random.default_rng(4)
    for i, end in enumerate(rng.integers(0, len(data), 40).tolist()):
        folder = tmp_path / str(i)
        folder.mkdir()
        (folder / "session.toml").write_text("format = 1\n")
        (folder / SAMPLES).write_bytes(data[:end])
        (folder / MARKS).write_bytes(marks[: rng.integers(0, len(marks))])
        with Recorder(folder, None) as recorder:
            recorder.append(still(0.0, 1.0, 2000.0))
            recorder.mark("told", text="on")
        session = Session.open(folder)
        block = session.block
        assert not session.warnings
        assert (np.diff(block.t) > 0).all() and len(block) % 100 == 0
        assert [m["event"] for m in session.marks()][-1] == "told"


@pytest.mark.parametrize(
    ("clock", "away", "begins"),
    [(20.0, 5.0, 20.0), (0.0, 60.0, 75.0), (3.0, 0.2, 15.99), (14.99, 0.0, 15.99)],
)
def test_time_goes_on_though_the_device_began_anew(
    tmp_path: Path, clock: float, away: float, begins: float
) -> None:
    recorded(tmp_path / "s")
    with Recorder(tmp_path / "s", None) as recorder:
        as_recorded = recorder.append(still(clock, 1.0, 1014.99 + away))
    assert as_recorded.t[0] == pytest.approx(begins, abs=0.02)
    assert (np.diff(Session.open(tmp_path / "s").block.t) > 0).all()


def test_what_was_taken_is_known_and_what_was_wanted_again_is_not(
    tmp_path: Path,
) -> None:
    recorded(tmp_path / "s")
    session, tables, _ = open_for_resume(tmp_path / "s")
    taken = recorded_averages(session, plan_file.task_from_tables(tables, "s"))
    assert list(taken) == [0] and taken[0].n == 1000
    with Recorder(tmp_path / "s", None) as recorder:
        recorder.mark("repeated", position=0)
    session, tables, _ = open_for_resume(tmp_path / "s")
    assert recorded_averages(session, plan_file.task_from_tables(tables, "s")) == {}
    assert session.windows == (None, None)


def test_what_cannot_be_gone_on_with_is_said(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="is no session"):
        open_for_resume(tmp_path)
    (tmp_path / "session.toml").write_text("format = 1\n")
    with pytest.raises(SessionError, match="was not recorded by fieldcal run"):
        open_for_resume(tmp_path)
    recorded(tmp_path / "s")
    with Recorder(tmp_path / "s", None) as recorder:
        recorder.mark("finished")
    open_for_resume(tmp_path / "s")  # killed before the result was written
    (tmp_path / "s" / "result.json").write_text("{}")
    with pytest.raises(SessionError, match="is finished"):
        open_for_resume(tmp_path / "s")


def test_a_further_device_is_not_gone_on_with_by_itself(tmp_path: Path) -> None:
    """Its session would get the samples of the first device."""
    run: dict[str, object] = {
        "procedure": "two_position",
        "device": "can:can0",
        "further": ["can:can1"],
    }
    lead, other = {"name": "one"}, {"name": "device 2", "address": "can:can1"}
    for folder, device in ((tmp_path, lead), (tmp_path / "device-2", other)):
        with Recorder(folder, {**TABLES, "run": run, "device": device}) as recorder:
            recorder.append(still(0.0, 1.0, 1000.0))
    assert open_for_resume(tmp_path)[1]["run"] == run
    with pytest.raises(SessionError, match=f"--resume {tmp_path}$"):
        open_for_resume(tmp_path / "device-2")


def test_a_finished_no_go_is_gone_on_with_by_its_remedy(tmp_path: Path) -> None:
    """Positions besides are added, those in doubt taken once more, and only once."""
    folder = tmp_path / "s"
    recorded(folder)
    with Recorder(folder, None) as recorder:
        recorder.mark("finished")
    besides = {"alpha_deg": 45.0, "beta_deg": -5.0}
    remedy = {"says": "", "again": [0], "positions": [besides], "seconds": 20.0}
    decision = {"go": False, "remedy": remedy}
    (folder / "result.json").write_text(json.dumps({"decision": decision}))
    session, tables, again = open_for_resume(folder)
    task = plan_file.task_from_tables(tables, "s")
    assert again == (0,) and len(task.about.positions) == len(session.positions) + 1
    assert task.about.positions[-1].degrees == (45.0, -5.0)
    assert task.procedure == "positions" and task.seconds == 20.0
    number = len(session.positions)
    with Recorder(folder, None) as recorder:
        recorder.mark("repeated", position=0)
        recorder.mark("added", position=number, name="besides", **besides)
    # broken off here: what was asked for stands, and nothing is added twice
    session, tables, again = open_for_resume(folder)
    assert again == () and len(session.positions) == number + 1
    assert session.positions[-1].name == "besides" and session.windows[0] is None
    assert len(plan_file.task_from_tables(tables, "s").about.positions) == number + 1
    with Recorder(folder, None) as recorder:
        recorder.mark("window", position=number, start_s=1.0, end_s=2.0)
        recorder.mark("finished")
    assert Session.open(folder).windows[-1] == (1.0, 2.0)
    (folder / "result.json").write_text(json.dumps({"decision": {"go": False}}))
    # no remedy, but what was repeated has no window since: that comes first
    session, tables, again = open_for_resume(folder)
    assert again == positions_left_out(session) and 0 in again
    assert len(tables["position"]) == len(session.positions)
    with Recorder(folder, None) as recorder:
        for i in again:
            start = 10.0 + 10.0 * i
            recorder.mark("window", position=i, start_s=start, end_s=start + 2.0)
        recorder.mark("finished")
    (folder / "result.json").write_text(json.dumps({"decision": {"go": False}}))
    with pytest.raises(SessionError, match="no position taken besides would"):
        open_for_resume(folder)


def test_a_remedy_that_was_taken_is_not_taken_again_if_solving_was_broken_off(
    tmp_path: Path,
) -> None:
    """The result is that of the run before, and its windows in doubt are new ones."""
    folder = tmp_path / "s"
    recorded(folder)
    besides = {"alpha_deg": 45.0, "beta_deg": -5.0}
    remedy = {"says": "", "again": [0], "positions": [besides], "seconds": 20.0}
    result = folder / "result.json"
    result.write_text(json.dumps({"decision": {"go": False, "remedy": remedy}}))
    before = time() - 30.0
    os.utime(result, (before, before))
    with Recorder(folder, None) as recorder:
        recorder.mark("finished")
    session, tables, again = open_for_resume(folder)
    assert again == () and len(tables["position"]) == len(session.positions)
    taken = recorded_averages(session, plan_file.task_from_tables(tables, "s"))
    assert list(taken) == [0]
    result.touch()  # solved meanwhile
    assert open_for_resume(folder)[2] == (0,)


def test_a_remedy_that_was_left_out_is_asked_for_once(tmp_path: Path) -> None:
    folder, besides = tmp_path / "s", {"alpha_deg": 45.0, "beta_deg": -5.0}
    recorded(folder)
    number = len(Session.open(folder).positions)
    with Recorder(folder, None) as recorder:
        recorder.mark("added", position=number, name="besides", **besides)
        recorder.mark("asked", position=number)
        recorder.mark("skipped", position=number)
        recorder.mark("finished")
    other = {"alpha_deg": -45.0, "beta_deg": 5.0}
    remedy = {"says": "", "again": [], "positions": [besides, other], "seconds": 20.0}
    decision = {"go": False, "remedy": remedy}
    (folder / "result.json").write_text(json.dumps({"decision": decision}))
    _, tables, _ = open_for_resume(folder)
    places = [
        p.degrees for p in plan_file.task_from_tables(tables, "s").about.positions
    ]
    assert places[number:] == [(45.0, -5.0), (-45.0, 5.0)]


def test_what_verified_a_no_go_is_taken_anew_behind_what_its_remedy_adds(
    tmp_path: Path,
) -> None:
    folder, besides = tmp_path / "s", {"alpha_deg": 45.0, "beta_deg": -5.0}
    verified = {**TABLES, "run": {"procedure": "two_position", "verify": True}}
    with Recorder(folder, verified) as recorder:
        recorder.append(still(0.0, 60.0, 1000.0))
        recorder.flush()
        for number in range(3):  # the last verifies
            start = 1.0 + 12.0 * number
            recorder.mark("window", position=number, start_s=start, end_s=start + 10)
        recorder.mark("finished")
    remedy = {"says": "", "again": [], "positions": [besides], "seconds": 10.0}
    decision = {"go": False, "remedy": remedy}
    (folder / "result.json").write_text(json.dumps({"decision": decision}))
    session, tables, again = open_for_resume(folder)
    assert again == (2,) and len(tables["position"]) == 3
    with Recorder(folder, None) as recorder:
        recorder.mark("repeated", position=2)
        recorder.mark("added", position=2, name="besides", **besides)
    now = Session.open(folder)
    assert now.windows == (*session.windows, None)
    task = plan_file.task_from_tables(tables, "s")
    assert task.verification is not None
    assert sorted(recorded_averages(now, task)) == [0, 1]


def test_a_session_is_never_begun_twice(tmp_path: Path) -> None:
    recorded(tmp_path / "s")
    with pytest.raises(SessionError, match="--resume"):
        Recorder(tmp_path / "s", TABLES)
    assert description_file.read_description(tmp_path / "s" / "session.toml").positions


@pytest.mark.thorough
def test_a_run_that_is_killed_goes_on_and_ends_with_right_numbers(
    tmp_path: Path,
) -> None:
    bench, session = Bench(tmp_path, 11, "40"), tmp_path / "s"
    try:
        process = bench.start(session)
        while process.poll() is None and not (
            (session / MARKS).exists() and len(windows(session)) == 2
        ):
            sleep(0.005)
        process.kill()
        process.communicate()
        before = windows(session)
        assert 2 <= len(before) < 5 and not (session / "result.json").exists()
        _, said = bench.start(session).communicate()
        assert (session / "result.json").exists(), said
        now = windows(session)
        assert len(now) == 5 and {n: now[n] for n in before} == before
        pulls = bench.pulls(session)
        assert len(pulls) >= 11 and np.abs(pulls).max() < 4.5
    finally:
        bench.device.close()


@pytest.mark.thorough
@pytest.mark.parametrize(
    "kind", ["killed", pytest.param("pulled", marks=pytest.mark.thorough)]
)
@pytest.mark.parametrize("runs", [1, pytest.param(6, marks=pytest.mark.thorough)])
def test_runs_that_are_broken_end_with_right_numbers(kind: str, runs: int) -> None:
    """A few of what benchmarks/kills.py does by the hundred."""
    # the kill must come before the end also where it waits seconds for a processor
    outcomes = series(kind, runs, seed=11, most=1, speed="20", until=0.5)
    assert sum(one.broken for one in outcomes) > runs / 2
    for one in outcomes:
        assert one.lost == 0 and one.says == ""
        assert len(one.pulls) >= 11 and np.abs(one.pulls).max() < 4.5


@pytest.mark.thorough
def test_a_laptop_that_fell_asleep_goes_on_with_right_numbers(tmp_path: Path) -> None:
    bench = Bench(tmp_path, 3, speed="20")
    try:
        run = bench.start(tmp_path / "s")
        wait_for_samples(tmp_path / "s", run, 40_000)
        run.send_signal(signal.SIGSTOP)
        sleep(1.5)  # half a minute of the device's time
        run.send_signal(signal.SIGCONT)
        _, said = run.communicate()
        assert run.returncode in (0, 1), said
        pulls = bench.pulls(tmp_path / "s")
        taken = windows(tmp_path / "s")
    finally:
        bench.device.close()
    assert sorted(taken) == [0, 1, 2, 3, 4]
    session = Session.open(tmp_path / "s")
    left_out = [
        tuple(gap)
        for mark in session.marks()
        if mark["event"] == "window"
        for gap in mark.get("without_s", ())
    ]
    for start, end in taken.values():
        t = session.block.between(start, end).t
        for i in np.flatnonzero(np.diff(t) > 0.5):
            assert any(
                a <= np.nextafter(t[i], np.inf) and t[i + 1] <= b for a, b in left_out
            ), "sleep is no part of a window"
    assert len(pulls) >= 11 and np.abs(pulls).max() < 4.5


def test_behind_a_no_go_stands_what_was_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded(tmp_path / "s")
    assert positions_left_out(Session.open(tmp_path / "s")) == (1,)
    found = Calibration(
        names=(), values=np.zeros(0), covariance=np.zeros((0, 0)), units=(),
        method="joint", chi2=0.0, dof=0, rms=0.0,
        info={"decision": {"go": False, "checks": []}},
    )  # fmt: skip
    show_decision(found, tmp_path / "s")
    said = " ".join(capsys.readouterr().out.split())
    assert "first: take position 2, left out so far: fieldcal run --resume" in said


def test_behind_a_no_go_stands_the_command_that_states_what_nobody_did(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    five = [dict(zip(("alpha_deg", "beta_deg"), p.degrees or (), strict=True))
            for p in FIVE_POSITIONS]  # fmt: skip
    for name, site, unsaid in (
        ("nothing", {}, "--latitude DEG --height M --angles DEG"),
        ("site", {"latitude_deg": 50.0}, "--angles DEG"),
        ("all", {"latitude_deg": 50.0, "angle_setting_deg": 0.05}, ""),
    ):
        folder = tmp_path / name
        Recorder(folder, {"format": 1, "site": site, "position": five}).close()
        checks = [
            {"name": check, "ok": False, "says": "no"}
            for check in ("site", "angles", "acc_scale uncertainty")
        ]
        found = Calibration(
            names=(), values=np.zeros(0), covariance=np.zeros((0, 0)), units=(),
            method="joint", chi2=0.0, dof=0, rms=0.0,
            info={"decision": {"go": False, "checks": checks}},
        )  # fmt: skip
        show_decision(found, folder)
        said = " ".join(capsys.readouterr().out.split())
        command = f"--resume {folder} {unsaid}".replace(" ", "")
        assert command in said.replace(" ", ""), said
        assert ("state what nobody stated" in said) == bool(unsaid)


def test_without_a_name_the_last_run_is_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("sessions").mkdir()
    parser = CommandParser("")
    run.add_arguments(parser)
    with pytest.raises(InputError, match="no run is in sessions, where runs"):
        make_task(parser.parse_args(["--resume"]))
    for age, name in ((50, "z-by-hand"), (10, "2026-03-01"), (90, "2026-04-01")):
        recorded(Path("sessions") / name)
        before = time() - age
        os.utime(Path("sessions") / name / "marks.jsonl", (before, before))
    _, folder = make_task(parser.parse_args(["--resume"]))
    assert folder == Path("sessions/2026-03-01")
