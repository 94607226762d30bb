"""Positions that are asked for again, left out, added or insisted on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engine_bench import ABOUT, Bench, Turner, events, hold_all

from fieldcal.core.errors import Stopped, WrongPosition
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.planning.holding import hold_each
from fieldcal.planning.steps import Hold, Plan, add, hold
from fieldcal.run import engine as engine_module
from fieldcal.run.engine import Engine
from fieldcal.run.interruptions import RepeatPosition
from fieldcal.run.operator.protocol import Wish
from fieldcal.run.wait_reason import WaitState
from fieldcal.run.waiting import PositionWait
from fieldcal.session import description_file
from fieldcal.session.folder import Session
from fieldcal.session.marks import insisted_positions
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess
from fieldcal.sim_device.profile import Profile, Sampling
from fieldcal.windows import Average


@pytest.mark.thorough
def test_a_mover_is_told_once_more_where_the_device_stands_wrong(bench: Bench) -> None:
    bench.turner.slips, bench.turner.corrects = [(0, 0), (30, 5)], False
    turner = bench.turner
    engine = Engine(turner.driver, turner, ABOUT, bench.recorder, give_up=90.0)
    engine.run(hold_all(TWO_POSITIONS, 10.0))
    assert events(bench) == ["asked", "window", "asked", "wrong", "wrong", "window"]


class Slow(Turner):
    """A table that takes a minute, and says that it is at work."""

    there: Position | None = None
    due: float = 0.0

    def place(self, hold: Hold) -> None:
        self.there, self.due = hold.position, self.driver.device.time + 60.0

    def wish(self) -> Wish | None:
        time = self.driver.device.time
        if self.there and time >= self.due:
            self.due, self.there = self.driver.place(self.there), None
        return "wait" if time < self.due else None


@pytest.mark.thorough
def test_nobody_gives_up_on_a_mover_that_is_at_work(tmp_path: Path) -> None:
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        turner = Slow(InProcess(VirtualDevice(seed=3)))
        engine = Engine(turner.driver, turner, ABOUT, recorder, give_up=20.0)
        engine.run(hold_all(TWO_POSITIONS, 10.0))
    assert not turner.told
    marks = Session.open(tmp_path / "s").marks()
    assert [m["event"] for m in marks] == ["asked", "window", "asked", "window"]


@pytest.mark.parametrize("works", [1.0, pytest.param(65.0, marks=pytest.mark.thorough)])
def test_a_mover_that_turns_nothing_is_given_up(tmp_path: Path, works: float) -> None:
    """A table without power says each time that it is done: told again after a minute,
    it is at work for a while, which must not begin the wait anew."""

    class Lame(Turner):
        done = 0.0

        def place(self, hold: Hold) -> None:
            self.done = self.driver.device.time + works

        def wish(self) -> Wish | None:
            assert self.driver.device.time < 400.0
            return "wait" if self.driver.device.time < self.done else None

    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        turner = Lame(
            InProcess(VirtualDevice(Profile(sampling=Sampling(rate_hz=20.0)), seed=3))
        )
        engine = Engine(turner.driver, turner, ABOUT, recorder, give_up=90.0)
        with pytest.raises(WrongPosition, match=r"asked for is α = 45"):
            engine.run(hold_all(TWO_POSITIONS[1:], 5.0))
    assert sum("still waiting" in told for told in turner.told) == 1


def test_what_was_taken_before_is_not_asked_for_again(bench: Bench) -> None:
    first, second = bench.engine.run(hold_all(TWO_POSITIONS, 10.0))
    again = Engine(
        bench.turner.driver, bench.turner, ABOUT, bench.recorder, 60.0, {0: first}
    )
    averages = again.run(hold_all(TWO_POSITIONS, 10.0))
    assert averages[0] is first and averages[1].start > second.end
    assert events(bench).count("asked") == 3


def test_an_added_position_is_not_what_verified_before(bench: Bench) -> None:
    """A run that was killed behind its verification may add a position after all."""
    (verified,) = bench.engine.run(hold_all(TWO_POSITIONS[:1], 5.0))
    taken = {0: verified}
    again = Engine(
        bench.turner.driver, bench.turner, ABOUT, bench.recorder, 60.0, taken
    )
    held = again.run(_added(TWO_POSITIONS[1], 5.0))
    assert held.start > verified.end
    assert held.mean[:3] != pytest.approx(verified.mean[:3], abs=1.0)
    assert events(bench)[-4:] == ["repeated", "added", "asked", "window"]


def _added(position: Position, seconds: float) -> Plan[Average]:
    number = yield from add(position)
    held = yield from hold(number, position, seconds)
    return held


def test_a_position_left_out_is_told_to_the_procedure(bench: Bench) -> None:
    bench.turner.wishes = [*[None] * 30, "skip"]
    held = bench.engine.run(hold_each(FIVE_POSITIONS[:2], 10.0))
    assert list(held) == [1]
    assert "was left out by the operator" in bench.turner.told[0]


def test_a_taken_position_is_wanted_again(bench: Bench) -> None:
    taken: dict[int, Average] = {}
    turner = bench.turner
    engine = Engine(turner.driver, turner, ABOUT, bench.recorder, 60.0, taken)
    with pytest.raises(RepeatPosition) as again:
        engine.run(_then_repeat(turner))
    assert again.value.index == 0 and list(taken) == [0]


def _then_repeat(turner: Turner) -> Plan[None]:
    yield from hold_all(TWO_POSITIONS[:1], 5.0)
    turner.wishes = ["repeat"]
    yield from hold(1, TWO_POSITIONS[1], 5.0)


def test_a_first_position_that_was_set_wrongly_may_be_set_right(bench: Bench) -> None:
    """What was discarded is no measure of where the device is."""
    turner, taken = bench.turner, dict[int, Average]()
    engine = Engine(turner.driver, turner, ABOUT, bench.recorder, 60.0, taken)
    turner.slips, turner.corrects = [(6.0, 0.0)], False
    with pytest.raises(RepeatPosition):
        engine.run(_then_repeat(turner))
    wrong = taken.pop(0)
    right = engine.run(hold(0, TWO_POSITIONS[0], 5.0))
    turned = abs(wrong.mean - right.mean)[0]
    assert turned == pytest.approx(ABOUT.gravity * np.sin(np.deg2rad(6.0)), abs=0.02)
    assert not turner.told
    turner.wishes = ["repeat"]
    taken.clear()
    engine.run(hold(0, TWO_POSITIONS[0], 5.0))
    assert turner.told == ["nothing was taken yet that could be repeated"]
    assert events(bench).count("repeated") == 1


class Insistent(Turner):
    """Presses Enter in a wrong place, turns slowly to the right one, and once more."""

    waits: list[PositionWait]
    presses = 0

    def wish(self) -> Wish | None:
        shown = self.views[-1].reason.state if self.views else WaitState.NOTHING
        if not self.presses and shown is WaitState.MISPLACED:
            self.driver.device.turn(float(np.deg2rad(8.0)), 0.0, seconds=20.0)
        elif self.presses != 1 or self.waits[-1].problem:
            return None
        self.presses += 1
        return "confirm"


def test_nobody_insists_on_a_place_that_is_right_by_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a base that sways it moves there without a motion that would be noticed."""
    about = description_file.parse_description(
        {"site": {"gravity": 9.81, "sways": True}}
    )
    turner = Insistent(InProcess(VirtualDevice(seed=3)), slips=[(10.0, 0.0)])
    turner.corrects, turner.waits = False, []

    class Watched(PositionWait):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            turner.waits.append(self)

    monkeypatch.setattr(engine_module, "PositionWait", Watched)
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        engine = Engine(turner.driver, turner, about, recorder, give_up=99.0)
        engine.run(hold_all(TWO_POSITIONS[:1], 5.0))
    assert any("press Enter once more" in text for text in turner.told)
    assert turner.told[-1] == "not yet: settling"
    marks = Session.open(tmp_path / "s").marks()
    assert "insisted" not in [mark["event"] for mark in marks]


class Stubborn(Turner):
    """Sets one position wrong, and takes it like this."""

    def wish(self) -> Wish | None:
        state = self.views[-1].reason.state if self.views else WaitState.NOTHING
        return "confirm" if state is WaitState.MISPLACED else None


@pytest.mark.parametrize("then", [22.5, 30.0])
@pytest.mark.parametrize("resumed", [False, True])
def test_a_wrong_position_that_was_insisted_on_is_no_measure_of_the_next(
    tmp_path: Path, then: float, resumed: bool
) -> None:
    """The next one may be right by those before, or go on as the mount has slipped."""
    turner = Stubborn(InProcess(VirtualDevice(seed=3)))
    turner.slips, turner.corrects = [(0.0, 0.0), (30.0, 0.0), (then, 2.5)], False
    three, taken, insisted = FIVE_POSITIONS[:3], dict[int, Average](), set[int]()
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        engine = Engine(turner.driver, turner, ABOUT, recorder, 60.0, taken,
                        insisted=insisted)  # fmt: skip
        if resumed:
            engine.run(hold_all(three[:2], 5.0))
            assert insisted == {1} and list(taken) == [0, 1]
            engine = Engine(turner.driver, turner, ABOUT, recorder, 60.0, taken,
                            insisted=insisted)  # fmt: skip
        engine.run(hold_all(three, 5.0))
    marks = list(Session.open(tmp_path / "s").marks())
    assert list(insisted_positions(marks)) == [1] and insisted == {1}
    assert [m["position"] for m in marks if m["event"] == "window"] == [0, 1, 2]


def test_an_operator_may_stop(bench: Bench) -> None:
    bench.turner.wishes = ["stop"]
    with pytest.raises(Stopped):
        bench.engine.run(hold_all(TWO_POSITIONS, 10.0))
