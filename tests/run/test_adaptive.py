"""Runs whose positions are found on the way, in a closed loop with the device."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fieldcal import procedures
from fieldcal.calibration import Calibration, limits
from fieldcal.commands.run_results import first_result
from fieldcal.core.errors import Skipped, Stopped
from fieldcal.core.positions import Position
from fieldcal.core.samples import Block
from fieldcal.evaluation.interim_result import InterimResult
from fieldcal.history.store import History
from fieldcal.model.posterior.probabilities import ProbableCause
from fieldcal.planning.steps import Add, Hold, Judge, Note
from fieldcal.procedures import adaptive
from fieldcal.run import plan_file, session_run
from fieldcal.run.judging import judge_session
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.resuming import open_for_resume, recorded_averages
from fieldcal.run.session_run import SessionRun
from fieldcal.run.wait_reason import WaitReason
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.in_process import InProcess
from fieldcal.sim_device.profile import Profile, Sampling
from fieldcal.sim_device.vocabulary import checked_effect
from fieldcal.windows import Average

BOUNDS = limits.read("tactical")
TILT = checked_effect("base_tilt", {"about_x_deg": 0.7, "about_z_deg": -0.4})


@dataclass
class Hand:
    """Turns the device, and wants something while some positions are asked for."""

    driver: InProcess
    wants: dict[int, Wish] = field(default_factory=dict)
    asked: list[tuple[int, Position]] = field(default_factory=list)
    told: list[str] = field(default_factory=list)

    def place(self, hold: Hold) -> None:
        self.asked.append((hold.index, hold.position))
        self.driver.place(hold.position)

    def tell(self, text: str) -> None:
        self.told.append(text)

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        self.told.append(reason.text)

    def show(self, view: OperatorView) -> None:
        pass

    def wish(self) -> Wish | None:
        return self.wants.pop(self.asked[-1][0], None) if self.asked else None


@dataclass
class Bench:
    """A device with all that a run needs."""

    folder: Path
    hand: Hand

    def run(
        self, run: Mapping[str, Any], until_go: bool = False, **more: Any
    ) -> Calibration:
        site = {"latitude_deg": 45.0, "angle_setting_deg": 0.003}
        tables = {"site": site, "run": {"seconds": 12.0, **run}, **more}
        task = plan_file.task_from_tables(tables, "the test")
        with Recorder(self.folder, task.tables) as recorder:
            return self._going(task, recorder, {}, until_go)

    def _going(
        self,
        task: plan_file.PlanTask,
        recorder: Recorder,
        taken: dict[int, Average],
        until_go: bool = False,
    ) -> Calibration:
        driver = self.hand.driver
        one = SessionRun(
            task, self.hand, recorder, lambda: driver, BOUNDS, 1.0, 60.0, taken,
            until_go,
        )  # fmt: skip
        return one.run(driver)

    def resumed(self) -> Calibration:
        session, tables, _ = open_for_resume(self.folder)
        task = plan_file.task_from_tables(tables, "the test")
        taken = recorded_averages(session, task)
        with Recorder(self.folder, None) as recorder:
            return self._going(task, recorder, taken)

    @property
    def marks(self) -> list[dict[str, Any]]:
        return list(Session.open(self.folder).marks())

    @property
    def numbers(self) -> list[int]:
        return [number for number, _ in self.hand.asked]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return of_device(tmp_path / "s", TILT)


def of_device(folder: Path, *effects: SimulatedEffect) -> Bench:
    noise = replace(Profile().noise, gyr=(1e-4,) * 3)
    profile = replace(Profile(), sampling=Sampling(50.0), effects=effects, noise=noise)
    return Bench(folder, Hand(InProcess(VirtualDevice(profile, seed=5))))


ADAPTIVE = {"procedure": "adaptive"}


@pytest.mark.thorough
def test_it_ends_at_go_also_if_it_was_stopped_on_the_way(bench: Bench) -> None:
    """What cannot be reached is not chosen again; what is taken again is the same."""
    bench.hand.wants = {2: "repeat", 3: "stop"}
    with pytest.raises(Stopped):
        bench.run(ADAPTIVE)
    assert bench.numbers == [0, 1, 2, 1, 2, 3]
    bench.hand.asked.clear()
    bench.hand.wants = {3: "skip"}
    found = bench.resumed()
    places = [p.degrees for _, p in bench.hand.asked]
    assert bench.numbers[0] == 3 and places.count(places[0]) == 1
    assert any("left out by the operator" in w for w in found.warnings)
    assert found.info["decision"]["go"] and len(bench.numbers) <= 4
    assert found.value("base_tilt.about_x_deg") == pytest.approx(0.7, abs=0.2)
    assert any("the next position tells" in t for t in bench.hand.told)
    assert bench.hand.told[-1].endswith("all is known that was asked for")
    added = [m["position"] for m in bench.marks if m["event"] == "added"]
    assert added == list(range(2, max(bench.numbers) + 1))


class Fickle(Hand):
    """Discards the third position, leaves it and the next one out, and stops then."""

    def __init__(self, driver: InProcess) -> None:
        super().__init__(driver)
        self.left = [(3, "repeat"), (2, "skip"), (3, "skip"), (4, "stop")]

    def wish(self) -> Wish | None:
        now = self.asked[-1][0] if self.asked else None
        return cast(Wish, self.left.pop(0)[1]) if now == self.left[0][0] else None


@pytest.mark.thorough
def test_what_was_discarded_is_not_judged_any_more(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged: list[tuple[int, ...]] = []

    def noted(folder: Path, *given: Any) -> InterimResult:
        so_far = judge_session(folder, *given)
        judged.append(so_far.prepared_session.windows.position_numbers)
        return so_far

    monkeypatch.setattr(session_run, "judge_session", noted)
    bench.hand = Fickle(bench.hand.driver)
    with pytest.raises(Stopped):
        bench.run(ADAPTIVE)
    assert bench.numbers == [0, 1, 2, 3, 2, 3, 4]
    assert judged == [(0, 1), (0, 1, 2), (0, 1)]


class Content(Hand):
    """Leaves out what is asked for beyond GO."""

    def wish(self) -> Wish | None:
        return "skip" if self.told and self.told[-1].startswith("GO so far") else None


@pytest.mark.thorough
def test_at_go_it_ends_if_a_further_position_is_left_out(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Then nobody is asked for another one, and what ends it is judged in full once."""
    full: list[int] = []

    def counted(folder: Path, *given: Any) -> InterimResult:
        so_far = judge_session(folder, *given)
        full.extend(
            [len(so_far.prepared_session.windows.position_numbers)]
            * (not so_far.incremental)
        )
        return so_far

    monkeypatch.setattr(session_run, "judge_session", counted)
    bench.hand = Content(bench.hand.driver)
    found = bench.run(ADAPTIVE, until_go=True)
    asked = [t for t in bench.hand.told if "the next position tells" in t]
    assert (
        asked[-1].startswith("GO so far") and "s pressed twice ends here" in asked[-1]
    )
    assert not any(t.startswith("GO so far") for t in asked[:-1])
    assert bench.hand.told[-1].startswith("it is GO")
    assert found.info["decision"]["go"]
    assert full == [2, max(bench.numbers)]


@pytest.mark.parametrize("go", [True, False])
def test_what_was_left_out_at_go_ends_it_also_behind_a_lost_link(
    monkeypatch: pytest.MonkeyPatch, go: bool
) -> None:
    """The plan begins anew then, and the third position is left out already."""
    gains = SimpleNamespace(gain=np.array([1.0])), [Position.deg(45, 0)]
    monkeypatch.setattr(adaptive, "_position_gains", lambda *_: gains)
    monkeypatch.setattr(adaptive, "_certain_causes", lambda _: "")
    monkeypatch.setattr(adaptive, "_reason_for_position", lambda *_: "one more")
    monkeypatch.setattr(adaptive, "_final_calibration", lambda *_: "solved")
    about = plan_file.task_from_tables({"run": ADAPTIVE, "position": THREE}, "").about
    plan = adaptive.plan(about)
    asked = [plan.send(reply) for reply in (None, 0, 1)]
    assert [isinstance(step, Hold) and step.index for step in asked] == [0, 1, 2]
    plan.throw(Skipped("left out by the operator"))
    assert isinstance(plan.send(None), Judge)
    step = plan.send(SimpleNamespace(sufficient=go, incremental=False))
    assert isinstance(step, Note)
    assert ("left out" in step.text) == go
    if go:
        with pytest.raises(StopIteration):
            plan.send(None)
    else:
        assert isinstance(plan.send(None), Add)


def test_it_takes_no_more_positions_than_it_may_and_those_of_its_ladder(
    bench: Bench,
) -> None:
    ladder = {"alpha_deg": [-10, 0, 10], "beta_deg": [-10, 0, 10]}
    start = [{"alpha_deg": 0, "beta_deg": 0}, {"alpha_deg": 10, "beta_deg": 10}]
    bench.run({**ADAPTIVE, "most": 3, "ladder": ladder}, position=start)
    places = [p.degrees for _, p in bench.hand.asked]
    assert len(places) == 3 and all(p and max(map(abs, p)) == 10 for p in places[1:])
    assert (
        bench.hand.told[-1] == "after 3 positions, the most that were asked for,"
        " it ends"
    )


@pytest.mark.thorough
def test_of_a_fixed_plan_what_a_no_go_wants_is_asked_for_at_once(bench: Bench) -> None:
    two = {"procedure": "positions"}
    start = [{"alpha_deg": a, "beta_deg": b} for a, b in ((0, 0), (45, 5), (22.5, 5))]
    bench.run(two, until_go=True, position=start)
    assert max(bench.numbers) >= 3 and judge_session(bench.folder, BOUNDS).sufficient
    said = [t for t in bench.hand.told if t.startswith("NO-GO so far")]
    assert len(said) == max(bench.numbers) - 2
    assert all("one position more" in t and "then GO is expected" in t for t in said)


class Doubtful:
    """A judgement that wants the second position once more, whatever there is."""

    incremental = False
    reasons = ("the second position disagrees",)
    remedy = {"says": "take it again", "again": [1], "positions": [], "seconds": 5.0}


@pytest.mark.parametrize("left_out", [False, True])
def test_who_leaves_out_what_a_remedy_wants_again_is_asked_for_nothing_more(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, left_out: bool
) -> None:
    class Tired(Hand):
        def wish(self) -> Wish | None:
            again = [number for number, _ in self.asked].count(1) > 1
            return "skip" if left_out and again and self.asked[-1][0] == 1 else None

    monkeypatch.setattr(session_run, "judge_session", lambda *_: Doubtful())
    bench.hand = Tired(bench.hand.driver)
    start = [{"alpha_deg": a, "beta_deg": b} for a, b in ((0, 0), (45, 5), (22.5, 5))]
    run = {"procedure": "positions", "seconds": 5.0}
    bench.run(run, until_go=True, position=start)
    assert bench.numbers == [0, 1, 2] + ([1] if left_out else [1, 1, 1])


THREE = [{"alpha_deg": a, "beta_deg": b} for a, b in ((0, 0), (45, 5), (22.5, 5))]


def test_a_place_that_was_left_out_is_not_asked_for_as_a_remedy(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As behind --resume, where a remedy is a position of the plan by then."""
    place = {"alpha_deg": 22.5, "beta_deg": 5.0}
    remedy = {"says": "one more", "again": [], "positions": [place], "seconds": 5.0}
    judged = SimpleNamespace(incremental=False, reasons=("not known",), remedy=remedy)
    monkeypatch.setattr(session_run, "judge_session", lambda *_: judged)
    bench.hand.wants = {2: "skip"}
    run = {"procedure": "positions", "seconds": 5.0}
    bench.run(run, until_go=True, position=THREE)
    assert bench.numbers == [0, 1, 2]


def test_what_was_left_out_is_not_asked_for_again_after_a_repetition(
    bench: Bench,
) -> None:
    bench.hand.wants = {1: "skip", 2: "repeat"}
    found = bench.run({"procedure": "positions", "seconds": 5.0}, position=THREE)
    assert bench.numbers == [0, 1, 2, 0, 2]
    assert [m["event"] for m in bench.marks].count("skipped") == 1
    assert any("left out by the operator" in w for w in found.warnings)


class Loose(InProcess):
    """A device whose plug falls out once."""

    at = 0.0

    def receive(self, timeout: float) -> Block | None:
        if 0.0 < self.at < self.device.time:
            self.at = 0.0
            raise OSError("unplugged")
        return super().receive(timeout)


def test_what_was_left_out_is_not_asked_for_again_after_a_lost_link(
    bench: Bench,
) -> None:
    driver = bench.hand.driver = Loose(bench.hand.driver.device)

    class Unlucky(Hand):
        def place(self, hold: Hold) -> None:
            super().place(hold)
            if self.numbers == [0, 1, 2]:
                driver.at = driver.device.time + 5.0

        @property
        def numbers(self) -> list[int]:
            return [number for number, _ in self.asked]

    bench.hand = Unlucky(driver, {1: "skip"})
    bench.run({"procedure": "positions", "seconds": 5.0}, position=THREE)
    assert bench.numbers == [0, 1, 2, 2]
    assert "lost" in [m["event"] for m in bench.marks]


def test_a_window_that_a_remedy_wants_longer_is_so_also_behind_a_break(
    bench: Bench,
) -> None:
    class Timed(Hand):
        def place(self, hold: Hold) -> None:
            super().place(hold)
            seconds[hold.index] = hold.seconds

    seconds: dict[int, float] = {}
    bench.hand = Timed(bench.hand.driver)
    start = [{"alpha_deg": a, "beta_deg": b} for a, b in ((0, 0), (45, 5), (22.5, 5))]
    bench.run({"procedure": "positions", "seconds": 5.0}, position=start)
    with Recorder(bench.folder, None) as recorder:
        for number, more in ((3, {"seconds": 8.0}), (4, {})):
            where = {"alpha_deg": -45.0, "beta_deg": 5.0 * (number - 3)}
            recorder.mark("added", position=number, name="", **where, **more)
    bench.hand.wants = {3: "skip"}
    bench.resumed()
    assert seconds == {0: 5.0, 1: 5.0, 2: 5.0, 3: 8.0, 4: 5.0}


@pytest.mark.thorough
def test_two_positions_and_those_of_a_remedy_are_solved_together(
    tmp_path: Path,
) -> None:
    """Two positions have a method of their own, which three are too many for."""
    bench = of_device(tmp_path / "s")
    site = {"latitude_deg": 45.0, "angle_setting_deg": 0.01, "level_deg": 0.01}
    found = bench.run({"procedure": "two_position"}, until_go=True, site=site)
    assert found.method == "two_position" and max(bench.numbers) >= 2
    history = History(tmp_path / "history.sqlite")
    whole = first_result(found, bench.folder, BOUNDS, history)
    assert whole.method == "joint" and whole.info["decision"]["go"]


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("base_tilt",), ""),
        (("base_tilt", "quadratic"), "quadratic"),
        (("quadratic", "warm_up"), "quadratic, warm_up"),
        (("quadratic", "time"), ""),
        ((), ""),
    ],
)
def test_what_a_calibration_finds_anyway_is_not_what_is_wrong(
    names: tuple[str, ...], said: str
) -> None:
    """It ended NO-GO where a tilted base was certain, which it takes into account."""
    chances = {"time": 0.6}
    standing = [ProbableCause(n, (), chances.get(n, 0.9999), ()) for n in names]
    so_far = SimpleNamespace(
        sufficient=False,
        explanation=SimpleNamespace(probable_causes=standing),
        calibration=SimpleNamespace(names=("acc_bias.x", "base_tilt.about_x_deg")),
    )
    assert adaptive._certain_causes(so_far) == said  # type: ignore[arg-type]


def test_only_a_plan_that_finds_its_positions_says_how_many_there_are_at_most() -> None:
    about = plan_file.task_from_tables({"run": ADAPTIVE}, "the test").about
    assert procedures.max_positions(about, "adaptive") == 9
    assert procedures.max_positions(about, "five_position") is None
    more = plan_file.task_from_tables(
        {"run": {**ADAPTIVE, "most": 6}}, "the test"
    ).about
    assert procedures.max_positions(more, "adaptive") == 6


@pytest.mark.parametrize(
    ("place", "refused", "taken", "out"),
    [
        ((-45.0, 0.0), [(-45.0, 5.0)], [], False),  # of one, nobody knows which joint
        ((-45.0, 0.0), [(-45.0, 5.0), (-45.0, 2.5)], [], True),
        ((-60.0, 0.0), [(-45.0, 5.0), (-45.0, 2.5)], [], True),  # beyond it
        ((-22.5, 0.0), [(-45.0, 5.0), (-45.0, 2.5)], [], False),
        ((45.0, 0.0), [(-45.0, 5.0), (-45.0, 2.5)], [], False),  # to the other side
        ((-45.0, 0.0), [(-45.0, 5.0), (-45.0, 2.5)], [(-45.0, -5.0)], False),
        ((22.5, 5.0), [(-45.0, 5.0), (45.0, 5.0)], [(0.0, 0.0)], True),  # in beta
        ((22.5, 0.0), [(-45.0, 0.0), (45.0, 0.0)], [], False),  # 0 is always reached
    ],
)
def test_an_angle_that_a_joint_does_not_reach_is_asked_for_twice_at_most(
    place: tuple[float, float],
    refused: list[tuple[float, float]],
    taken: list[tuple[float, float]],
    out: bool,
) -> None:
    assert adaptive._out_of_reach(place, refused, taken) is out
