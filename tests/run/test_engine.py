"""The engine on the virtual device: right when all goes well, and when it does not."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from talking import talking

from fieldcal.core.errors import (
    CalibrationFailed,
    DeviceSilent,
    Stopped,
    WrongPosition,
)
from fieldcal.core.frames import direction_cosines
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.core.samples import Array, Block, split_by_time
from fieldcal.diagnosis import diagnose
from fieldcal.drivers.driver import Driver, LinkHealth, open_driver
from fieldcal.evaluation.observations import usable_windows
from fieldcal.planning.holding import hold_each
from fieldcal.planning.steps import Hold, Plan, add, hold
from fieldcal.run import engine as engine_module
from fieldcal.run.engine import Engine
from fieldcal.run.gyro_unit import GyroUnitWatch
from fieldcal.run.interruptions import RepeatPosition
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.position_check import AcceptedPosition
from fieldcal.run.wait_reason import WaitReason, WaitState, reminder
from fieldcal.run.waiting import PositionWait
from fieldcal.run.warm_up import WarmUpWatch
from fieldcal.session import description
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess
from fieldcal.sim_device.profile import Climate, Profile
from fieldcal.windows import Average

ABOUT = description.parse_description(
    {"site": {"latitude_deg": 50.45, "height_m": 170.0}}
)


@dataclass
class Turner:
    """Turns the virtual device, and slips on the way as it is told to."""

    driver: InProcess
    slips: list[tuple[float, float]] = field(default_factory=list)
    bump_at: list[float] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    views: list[OperatorView] = field(default_factory=list)
    late: Position | None = None
    corrects: bool = True
    bumped: list[float] = field(default_factory=list)
    wishes: list[Wish | None] = field(default_factory=list)

    def place(self, hold: Hold) -> None:
        alpha, beta = hold.position.degrees or (0.0, 0.0)
        if self.slips:
            alpha, beta = self.slips.pop(0)
            self.late = hold.position
        self.driver.place(Position.deg(alpha, beta))

    def tell(self, text: str) -> None:
        self.told.append(text)
        if self.late and self.corrects:
            self.driver.place(self.late)
            self.late = None

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        self.tell(reminder(waited) + reason.text)

    def wish(self) -> Wish | None:
        return self.wishes.pop(0) if self.wishes else None

    def show(self, view: OperatorView) -> None:
        self.views.append(view)
        if self.bump_at and view.elapsed > self.bump_at[0]:
            self.bump_at.pop(0)
            self.bumped.append(self.driver.device.time)
            self.driver.device.bump()


@dataclass
class Bench:
    """An engine with everything around it."""

    folder: Path
    turner: Turner
    engine: Engine
    recorder: Recorder


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        yield make(recorder, InProcess(VirtualDevice(seed=3)))


def hold_all(
    positions: Sequence[Position], seconds: float
) -> Plan[tuple[Average, ...]]:
    """Hold every position; the averages in order."""
    held = yield from hold_each(positions, seconds)
    return tuple(held.values())


def make(recorder: Recorder, driver: InProcess, lost_share: float = np.inf) -> Bench:
    turner = Turner(driver)
    engine = Engine(
        driver, turner, ABOUT, recorder, give_up=60.0, lost_share=lost_share
    )
    return Bench(recorder.folder, turner, engine, recorder)


def events(bench: Bench) -> list[str]:
    bench.recorder.close()
    return [m["event"] for m in Session.open(bench.folder).marks()]


def test_windows_are_taken_after_the_turn_and_every_sample_is_recorded(
    bench: Bench,
) -> None:
    first, second = bench.engine.run(hold_all(TWO_POSITIONS, 12.0))
    assert 12.0 <= first.end - first.start < 12.3
    assert events(bench) == ["asked", "window", "asked", "window"]
    block = Session.open(bench.folder).block
    assert len(block) == bench.turner.driver.health.samples
    inside = block.between(second.start, np.nextafter(second.end, np.inf))
    np.testing.assert_allclose(inside.six.mean(axis=0), second.mean, atol=1e-9)
    quiet = block.between(second.start - 1.0, second.start).gyr.std(axis=0).max()
    assert quiet < 2 * inside.gyr.std(axis=0).max()


def test_a_wrong_turn_is_said_before_anything_is_averaged(bench: Bench) -> None:
    bench.turner.slips = [(0, 0), (-45, 5)]
    averages = bench.engine.run(hold_all(TWO_POSITIONS, 10.0))
    wrong = [t for t in bench.turner.told if "wrong way" in t]
    assert len(wrong) == 1 and "α is turned the wrong way" in wrong[0]
    assert averages[1].mean[0] < 0, "the window must be from +45 degrees"
    assert events(bench).count("window") == 2


@pytest.mark.thorough
def test_a_position_never_reached_is_given_up(bench: Bench) -> None:
    bench.turner.slips = [(0, 0), (30, 5)]
    bench.turner.corrects = False
    with pytest.raises(WrongPosition, match="turn it by"):
        bench.engine.run(hold_all(TWO_POSITIONS, 10.0))
    assert events(bench) == ["asked", "window", "asked", "wrong"]


class Fast(InProcess):
    """A device that runs at ten times the host's clock."""

    def host_time(self) -> float:
        return self.device.time / 10


def test_a_fast_device_gives_whoever_turns_it_some_time_by_the_clock(
    tmp_path: Path,
) -> None:
    driver = Fast(VirtualDevice(seed=3))
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        bench = make(recorder, driver)
        bench.turner.slips, bench.turner.corrects = [(30, 5)] * 3, False
        with pytest.raises(WrongPosition, match="turn it by"):
            bench.engine.run(hold_all(TWO_POSITIONS, 10.0))
    assert 10.0 < driver.host_time() < 10.5


def test_a_bump_rejects_the_window_and_it_is_taken_again(bench: Bench) -> None:
    bench.turner.bump_at = [2.5]  # too early for anything to be kept
    average = bench.engine.run(hold_all(TWO_POSITIONS[:1], 20.0))[0]
    assert events(bench) == ["asked", "rejected", "told", "asked", "window"]
    mark = [m for m in Session.open(bench.folder).marks() if m["event"] == "rejected"]
    assert mark[0]["at_s"] == pytest.approx(bench.turner.bumped[0], abs=0.5)
    assert average.start > mark[0]["at_s"]


def test_who_never_holds_still_is_told_so_in_the_end(bench: Bench) -> None:
    _restless(bench)
    with pytest.raises(CalibrationFailed, match="without a disturbance in 5 tries"):
        bench.engine.run(hold_all(TWO_POSITIONS[:1], 30.0))


@pytest.mark.thorough
def test_a_person_in_the_wind_is_told_what_to_do_and_may_go_on(bench: Bench) -> None:
    turner = _restless(bench, times=7)
    Engine(turner.driver, turner, ABOUT, bench.recorder).run(
        hold_all(TWO_POSITIONS[:1], 15.0)
    )
    assert len(turner.told) == 7 and events(bench).count("window") == 1
    assert "times now" not in turner.told[1]
    assert "disturbed 7 times now: fix the device better" in turner.told[6]


def _restless(bench: Bench, times: int = 99) -> Turner:
    """Bump the device two seconds into each window, too early to keep anything."""

    class Restless(Turner):
        def show(self, view: OperatorView) -> None:
            before = self.views[-1].elapsed if self.views else 0.0
            super().show(view)
            if before <= 2.0 < view.elapsed and len(self.bumped) < times:
                self.bumped.append(self.driver.device.time)
                self.driver.device.bump()

    turner = Restless(bench.turner.driver)
    bench.turner = turner
    bench.engine = Engine(turner.driver, turner, ABOUT, bench.recorder, give_up=60.0)
    return turner


def test_a_hold_ends_early_once_the_sigma_asked_for_is_reached(bench: Bench) -> None:
    average: Average = bench.engine.run(hold(0, TWO_POSITIONS[0], 120.0, sigma=5e-3))
    assert average.end - average.start < 60.0
    assert average.sigma[:3].max() <= 5e-3


class Hiccup(InProcess):
    """A link that loses two seconds of samples, once."""

    lost = False

    def receive(self, timeout: float) -> Block | None:
        if not self.lost and self.device.time > 14.0:
            self.lost = True
            self.device.take(200)
        return super().receive(timeout)


def test_samples_missing_inside_a_window_reject_it(tmp_path: Path) -> None:
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        bench = make(recorder, Hiccup(VirtualDevice(seed=1)))
        bench.engine.run(hold_all(TWO_POSITIONS[:1], 20.0))
    assert "no samples came between" in bench.turner.told[0]
    assert events(bench).count("window") == 1


class Pulled(InProcess):
    """A link that is pulled for 0.1 s, and then comes back, in each of some windows."""

    def __init__(self, device: VirtualDevice, times: Sequence[float]) -> None:
        super().__init__(device)
        self.left = list(times)

    def receive(self, timeout: float) -> Block | None:
        if self.left and self.device.time > self.left[0]:
            self.left.pop(0)
            self.device.take(10)
            self.health.gaps, self.health.missing = 1, self.health.missing + 10
        return super().receive(timeout)


@pytest.mark.parametrize(("pulls", "rejected"), [([14.0], 1), (range(8, 200), 2)])
def test_a_link_pulled_for_a_moment_costs_a_window_and_no_more(
    tmp_path: Path, pulls: Sequence[float], rejected: int
) -> None:
    """One that loses some all the time is taken as it is; it is judged in the end."""
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        bench = make(recorder, Pulled(VirtualDevice(seed=1), pulls), lost_share=1e-3)
        bench.engine.run(hold_all(TWO_POSITIONS[:1], 20.0))
    assert "10 samples were lost before 14." in " ".join(bench.turner.told) or pulls[0]
    ended = events(bench)
    assert ended.count("rejected") + ended.count("kept") == rejected


class Returning(InProcess):
    """A vehicle that loses its link and comes back as it was put down meanwhile."""

    def receive(self, timeout: float) -> Block | None:
        if self.put_down_at < self.device.time:
            self.put_down_at = np.inf
            self.device.turn(0.3, -0.2, seconds=1.0)
            self.device.take(300)
        return super().receive(timeout)

    put_down_at = np.inf


@pytest.mark.parametrize("later", [0.5, pytest.param(12.0, marks=pytest.mark.thorough)])
def test_a_vehicle_that_comes_back_at_another_attitude_is_turned_again(
    tmp_path: Path, later: float
) -> None:
    driver = Returning(VirtualDevice(seed=1))
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        bench = make(recorder, driver)
        bench.engine.run(hold_all(TWO_POSITIONS[:1], 10.0))
        driver.put_down_at = driver.device.time + later  # on the way, and at rest
        bench.engine.run(hold_all(TWO_POSITIONS, 10.0))
    assert events(bench).count("window") == 2


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


class Dead(Driver):
    """A device that says nothing."""

    def __init__(self, address: str = "") -> None:
        self.name, self.health = "dead device", LinkHealth()

    def receive(self, timeout: float) -> Block | None:
        return None

    def close(self) -> None: ...

    def blocks(self, timeout: float = 0.1):  # type: ignore[no-untyped-def]
        return super().blocks(0.05)


def test_a_wrong_format_is_said_at_once_with_the_one_that_comes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What comes instead is on the screen while the run still waits for samples."""
    monkeypatch.setattr("fieldcal.drivers.driver.SILENCE_INTERVAL", 0.1)
    lines = (b"%d,0.01,-9.81,0.02,0,0,0.00%d\n" % (10 * i, i % 3) for i in range(10**6))
    with talking(lambda i: next(lines)) as port:
        told: list[str] = []

        class Impatient(Turner):
            def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
                told.append(reason.text)
                self.wishes.append("stop")

        driver = open_driver(f"serial:{port}?format=witmotion")
        operator = Impatient(InProcess(VirtualDevice(seed=3)))
        with driver, Recorder(tmp_path / "s", {"format": 1}) as recorder:
            engine = Engine(driver, operator, ABOUT, recorder)
            with pytest.raises(Stopped):
                engine.run(hold_all(TWO_POSITIONS, 10.0))
    assert "these are no witmotion bytes; try format=text&columns=t,ax" in told[0]
    assert "by itself" not in told[0]


def test_a_silent_device_is_said_to_be_silent(tmp_path: Path) -> None:
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        turner = Turner(InProcess(VirtualDevice()))
        engine = Engine(Dead(), turner, ABOUT, recorder)
        with pytest.raises(DeviceSilent, match="dead device has sent no sample"):
            engine.run(hold_all(TWO_POSITIONS, 5.0))


def test_the_operator_sees_where_the_device_is_and_how_far_the_average_is(
    bench: Bench,
) -> None:
    bench.engine.run(hold_all(TWO_POSITIONS, 10.0))
    seen = [v for v in bench.turner.views if v.phase == "turning" and v.arrival]
    last = seen[-1].arrival
    assert last is not None and last.alpha_deg == pytest.approx(45, abs=2)
    averaging = [v for v in bench.turner.views if v.phase == "averaging"]
    assert averaging[-1].elapsed > averaging[0].elapsed
    taken = [v for v in bench.turner.views if v.phase == "taken"]
    assert len(taken) == 2 and np.isfinite(taken[0].sigma).all()
    assert taken[0].rate_hz == pytest.approx(100, rel=0.01)


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
    about = description.parse_description({"site": {"gravity": 9.81, "sways": True}})
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


def test_an_operator_may_stop(bench: Bench) -> None:
    bench.turner.wishes = ["stop"]
    with pytest.raises(Stopped):
        bench.engine.run(hold_all(TWO_POSITIONS, 10.0))


def test_the_next_position_too_early_is_told_from_the_one_asked_for() -> None:
    """Every pair of the five, on bases tilted by up to a degree and a half."""
    rng = np.random.default_rng(6)
    for _ in range(2):
        tilt = direction_cosines(*np.deg2rad(rng.uniform(-1.5, 1.5, 2)))
        f = {i: _force(p, tilt) for i, p in enumerate(FIVE_POSITIONS)}
        for wanted, there in itertools.permutations(range(5), 2):
            known = (
                AcceptedPosition(FIVE_POSITIONS[wanted - 1], f[wanted - 1])
                if wanted
                else None
            )
            waiting = PositionWait(
                Hold(wanted, FIVE_POSITIONS[wanted], 10.0), FIVE_ABOUT, known
            )
            waiting.add(_resting(f[there]), 4.0)
            assert not waiting.arrived, (wanted, there)
            waiting = PositionWait(
                Hold(wanted, FIVE_POSITIONS[wanted], 10.0), FIVE_ABOUT, known
            )
            waiting.add(_resting(f[wanted]), 4.0)
            assert waiting.arrived, (wanted, waiting.problem)


FIVE_ABOUT = description.parse_description(
    {
        "site": {"gravity": 9.81},
        "position": [
            dict(zip(("alpha_deg", "beta_deg"), p.degrees or (), strict=False))
            for p in FIVE_POSITIONS
        ],
    }
)


def _force(position: Position, tilt: Array) -> Array:
    f: Array = (
        direction_cosines(position.alpha or 0.0, position.beta or 0.0)
        @ tilt
        @ [0, -9.81, 0]
    )
    return f


def _resting(f: Array) -> Block:
    t = np.arange(400) / 100
    noise = np.random.default_rng(1).standard_normal((400, 6))
    return Block.of(t, f + 0.005 * noise[:, :3], 0.001 * noise[:, 3:])


def test_nothing_is_known_of_a_time_without_samples() -> None:
    waiting = PositionWait(Hold(0, FIVE_POSITIONS[0], 10.0), FIVE_ABOUT, None)
    block = _resting(np.array([0.0, -9.81, 0.0]))
    waiting.add(block[:150], 1.5)
    assert waiting.seconds > 1.0
    waiting.add(block[300:], 3.0)
    assert waiting.seconds < 1.5 and not waiting.arrived


class Behind(InProcess):
    """A link that is read by a computer so busy that half a minute comes at once."""

    def __init__(self, device: VirtualDevice) -> None:
        super().__init__(device)
        self._n = round(30.0 * device.rate)


@pytest.mark.parametrize("kind", [InProcess, Behind])
def test_a_temperature_is_known_after_seconds_however_samples_come(
    tmp_path: Path, kind: type[InProcess]
) -> None:
    steady = replace(Climate(), self_heating_k=0.0)
    driver = kind(VirtualDevice(replace(Profile(), temperature=steady), seed=3))
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        turner, warm_up = Turner(driver), WarmUpWatch(0.5, 300.0)
        engine = Engine(driver, turner, ABOUT, recorder, warm_up=warm_up)
        (average,) = engine.run(hold_all(TWO_POSITIONS[:1], 5.0))
    assert average.start < 7.0 and not turner.told


@pytest.mark.parametrize(("read", "begins"), [(False, 39.0), (True, 8.0)])
def test_enter_waives_a_warm_up_only_if_it_was_said(
    tmp_path: Path, read: bool, begins: float
) -> None:
    """An Enter in the first seconds says that the device was turned."""

    class Hasty(Turner):
        def wish(self) -> Wish | None:
            pressed = bool(self.told) if read else self.driver.device.time < 2.0
            return "confirm" if pressed else None

    warming = replace(Climate(), self_heating_k=20.0, warm_up_s=60.0)
    driver = InProcess(VirtualDevice(replace(Profile(), temperature=warming), seed=3))
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        warm_up = WarmUpWatch(0.5, 40.0)
        engine = Engine(driver, Hasty(driver), ABOUT, recorder, warm_up=warm_up)
        (average,) = engine.run(hold_all(TWO_POSITIONS[:1], 5.0))
    assert begins - 3.0 < average.start < begins + 4.0


def test_a_device_that_warms_up_is_waited_for_and_said(tmp_path: Path) -> None:
    warming = replace(Climate(), self_heating_k=20.0, warm_up_s=60.0)
    driver = InProcess(VirtualDevice(replace(Profile(), temperature=warming), seed=3))
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        turner = Turner(driver)
        warm_up = WarmUpWatch(0.5, 40.0)
        engine = Engine(driver, turner, ABOUT, recorder, warm_up=warm_up)
        engine.run(hold_all(TWO_POSITIONS[:1], 10.0))
    assert "still warming up" in turner.told[0] and "Enter goes on" in turner.told[0]
    states = [v.reason for v in turner.views]
    waits = [r.text for r in states if r.state is WaitState.WARMING_UP]
    assert waits and "K/min" in waits[0]
    window = [m for m in Session.open(tmp_path / "s").marks() if m["event"] == "window"]
    assert 39.0 < window[0]["start_s"] < 43.0, "but not for ever"
    assert "still warming up" in turner.told[-1]


@pytest.mark.parametrize(("step", "rate"), [(0.0, 0.0), (1.0, 0.0), (0.01, 0.3)])
def test_a_steady_temperature_is_no_warming_up(step: float, rate: float) -> None:
    for seed in range(8):
        warm_up = WarmUpWatch(0.5, 600.0)
        for block in _temperatures(seed, step, rate):
            warm_up.add(block)
            assert not warm_up.notice


@pytest.mark.parametrize(("step", "within"), [(0.0, 15.0), (1.0, 70.0)])
def test_warming_up_is_noticed_also_in_whole_degrees(
    step: float, within: float
) -> None:
    warm_up, said = WarmUpWatch(0.5, 600.0), np.inf
    for block in _temperatures(1, step, 4.0):
        warm_up.add(block)
        if warm_up.notice:
            said = min(said, float(block.t[-1]))
    assert said < within
    rate, sigma = warm_up.rate
    assert abs(rate - 4.0) < 4 * sigma + 0.05


class SwitchedOff(InProcess):
    """A device that was off after ten seconds, and is 3 K colder since."""

    def receive(self, timeout: float) -> Block | None:
        block = super().receive(timeout)
        if block and block.t[0] < 10.0:
            return replace(block, temperature=block.temperature + 3.0)
        self.health.restarts = 1
        return block


def test_what_was_before_a_restart_is_no_cooling_down(tmp_path: Path) -> None:
    driver = SwitchedOff(VirtualDevice(seed=3))
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        turner = Turner(driver)
        warm_up = WarmUpWatch(0.5, 600.0)
        engine = Engine(driver, turner, ABOUT, recorder, warm_up=warm_up)
        engine.run(hold_all(TWO_POSITIONS[:1], 14.0))
    assert any("started anew at 10.0" in text for text in turner.told)
    assert not any("cooling" in v.reason.text for v in turner.views)
    assert not any("cooling" in text for text in turner.told)


def test_a_step_between_two_blocks_is_a_step() -> None:
    """A slope of whole degrees is no better known if blocks are short."""
    t = np.arange(6000) / 100
    temperature = np.where(t < 30.0, 20.0, 21.0)
    rates = []
    for length in (1, 7, 10, 50):
        warm_up = WarmUpWatch(0.5, 600.0)
        for i in range(0, len(t), length):
            some = slice(i, i + length)
            at_rest = np.zeros((len(t[some]), 3))
            warm_up.add(Block.of(t[some], at_rest, temperature=temperature[some]))
        rates.append(warm_up.rate)
    sigma = np.array(rates)[:, 1]
    assert sigma.min() > 0.9 and sigma == pytest.approx(sigma[0], rel=0.05)


def _temperatures(seed: int, step: float, rate: float) -> Iterator[Block]:
    """Two minutes of a device whose temperature changes by `rate` K/min."""
    rng = np.random.default_rng(seed)
    for start in np.arange(0.0, 120.0, 0.5):
        t = start + np.arange(50) / 100
        temperature = 20.0 + rate * t / 60
        temperature = temperature + 0.05 * rng.standard_normal(50)
        if step:
            temperature = step * np.round(temperature / step)
        yield Block.of(t, np.zeros((50, 3)), temperature=temperature)


@pytest.mark.thorough
def test_leaning_on_the_table_is_noticed(bench: Bench) -> None:
    """A slow lean of a tenth of a degree, for longer than the window is."""
    device, turner = bench.turner.driver.device, bench.turner

    class Leaning(Turner):
        leant = False

        def show(self, view: OperatorView) -> None:
            super().show(view)
            if view.elapsed > 8.0 and not self.leant:
                self.leant = True
                device.bump(push=0.0, tilt_deg=0.1, seconds=20.0)

    leaning = Leaning(turner.driver)
    engine = Engine(turner.driver, leaning, ABOUT, bench.recorder)
    (found,) = engine.run(hold_all(TWO_POSITIONS[:1], 20.0))
    assert "a lasting change" in leaning.told[0] and "hold still" in leaning.told[0]
    bench.recorder.close()
    before = Session.open(bench.folder).block.between(2.0, 9.0)
    off = np.abs(found.mean - np.nanmean(before.six, axis=0)) / found.sigma
    assert off[:3].max() < 6.0, "what leant is no part of the mean"


class InDegrees(InProcess):
    """A device whose gyroscopes send deg/s under a driver that was told rad/s."""

    def receive(self, timeout: float) -> Block | None:
        block = super().receive(timeout)
        return block and replace(block, gyr=np.rad2deg(block.gyr))


@pytest.mark.thorough
def test_gyroscopes_in_degrees_are_asked_about_before_any_turn(tmp_path: Path) -> None:
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        made = make(recorder, InDegrees(VirtualDevice(seed=3)))
        with pytest.raises(WrongPosition):
            made.engine.run(hold_all(TWO_POSITIONS, 10.0))
    reasons = {v.reason.text for v in made.turner.views}
    assert any("if they are in deg/s, begin again" in text for text in reasons)


@pytest.mark.parametrize(("scale", "wrong"), [(np.rad2deg(1.0), True), (1.0, False)])
def test_gyroscopes_in_degrees_are_told_by_a_turn(scale: float, wrong: bool) -> None:
    """Forty-five degrees about a level axis in two seconds, there and back."""
    units, rng = GyroUnitWatch(9.81), np.random.default_rng(2)
    t = np.arange(1200) / 100
    rate = np.deg2rad(22.5) * (((t > 5) & (t < 7)) * 1.0 - ((t > 8) & (t < 10)) * 1.0)
    angle = np.cumsum(rate) / 100
    acc = 9.81 * np.column_stack([0 * t, -np.cos(angle), np.sin(angle)])
    gyr = np.column_stack([rate, 0 * t, 0 * t]) + 2e-3 * rng.standard_normal((1200, 3))
    block = Block.of(t, acc + 0.02 * rng.standard_normal((1200, 3)), scale * gyr)
    for piece in split_by_time(block, 0.1):
        units.add(piece)
    assert ("they are in deg/s and not in rad/s" in units.notice) == wrong
    assert not units.question(99.0)


@pytest.mark.parametrize(
    ("scale", "unit"), [(np.rad2deg(1.0), "deg/s"), (1.0, "rad/s")]
)
@pytest.mark.parametrize("seconds", [1.5, 4.0, 8.0])
def test_a_slow_turn_tells_the_unit_too(
    scale: float, unit: str, seconds: float
) -> None:
    """Forty-five degrees, once, as gently as a hand with a heavy box does it."""
    units, rng = GyroUnitWatch(9.81), np.random.default_rng(5)
    t = np.arange(2200) / 100
    part = np.clip((t - 8.0) / seconds, 0.0, 1.0)
    angle = np.deg2rad(45.0) * (1 - np.cos(np.pi * part)) / 2
    gyr = np.zeros((2200, 3))
    gyr[:, 0] = np.gradient(angle, t)
    gyr += [0.01, -0.02, 0.015] + 2e-3 * rng.standard_normal((2200, 3))
    acc = 9.81 * np.column_stack([0 * t, -np.cos(angle), np.sin(angle)])
    block = Block.of(t, acc + 0.02 * rng.standard_normal((2200, 3)), scale * gyr)
    for piece in split_by_time(block, 0.1):
        units.add(piece)
    assert units.unit == unit


@pytest.mark.thorough
def test_gyroscopes_in_rad_are_no_matter(bench: Bench) -> None:
    bench.engine.run(hold_all(FIVE_POSITIONS, 10.0))
    assert not any("gyr_unit" in text for text in bench.turner.told)
    states = {view.reason.state for view in bench.turner.views}
    assert WaitState.WRONG_UNIT not in states


def test_rates_that_move_where_nothing_is_felt_ask_for_their_unit() -> None:
    """Before any turn: the accelerometers rest for seconds, the rates do not."""
    rng, wait = np.random.default_rng(1), GyroUnitWatch(9.81)
    for start in np.arange(0.0, 20.0, 0.1):
        t = start + np.arange(10) / 100
        acc = [0.0, -9.81, 0.0] + 0.01 * rng.standard_normal((10, 3))
        gyr = 2.0 + 0.3 * rng.standard_normal((10, 3))
        wait.add(Block.of(t, acc, gyr))
        assert not wait.notice
        assert not wait.question(float(t[-1])) or t[-1] > 4.9
    assert "if they are in deg/s" in wait.question(20.0) and not wait.question(3.0)


@pytest.mark.parametrize(
    ("up", "axes"), [("+z", "+x,-z,+y"), ("-z", "+x,+z,-y"), ("+y", "+x,-y,-z")]
)
def test_a_unit_on_another_face_is_recognised(up: str, axes: str) -> None:
    """Lying flat with z up is a mounting, and not -89.3° in β."""
    f = np.zeros(3)
    f["xyz".index(up[1])] = 9.7 if up[0] == "+" else -9.7
    waiting = PositionWait(Hold(0, FIVE_POSITIONS[0], 10.0), ABOUT, None)
    rng = np.random.default_rng(0)
    for start in np.arange(0.0, 8.0, 0.1):
        t = start + np.arange(10) / 100
        acc = f + [0.05, 0.02, -0.03] + 0.01 * rng.standard_normal((10, 3))
        waiting.add(Block.of(t, acc, 1e-3 * rng.standard_normal((10, 3))), t[0])
    assert waiting.problem.startswith(f"{up} of the device is up")
    assert f"--mounting={axes}" in waiting.problem
    assert waiting.reason.state is WaitState.MISPLACED


def test_a_turn_that_was_not_made_is_no_mounting() -> None:
    waiting = PositionWait(Hold(0, FIVE_POSITIONS[3], 10.0), ABOUT, None)
    rng = np.random.default_rng(0)
    for start in np.arange(0.0, 8.0, 0.1):
        t = start + np.arange(10) / 100
        acc = [0.0, -9.81, 0.0] + 0.01 * rng.standard_normal((10, 3))
        waiting.add(Block.of(t, acc, 1e-3 * rng.standard_normal((10, 3))), t[0])
    assert waiting.problem and "mounting" not in waiting.problem


def test_a_gust_costs_what_it_spoils(tmp_path: Path) -> None:
    """Every 12 s a push of 1.5 s; windows of 30 s are taken within 50 s."""

    class Windy(Turner):
        gust = 10.0

        def show(self, view: OperatorView) -> None:
            super().show(view)
            while self.driver.device.time >= self.gust:
                self.gust += 12.0
                self.driver.device.bump(push=0.3, tilt_deg=0.0, seconds=1.5)

    tables = {
        "format": 1,
        "site": {"latitude_deg": 50.45},
        "position": [{"alpha_deg": 0, "beta_deg": 0}],
    }
    with Recorder(tmp_path / "s", tables) as recorder:
        turner = Windy(InProcess(VirtualDevice(seed=3)))
        engine = Engine(turner.driver, turner, ABOUT, recorder, give_up=60.0)
        taken = engine.run(hold_all(TWO_POSITIONS[:1], 30.0))
    session = Session.open(tmp_path / "s")
    windows = [m for m in session.marks() if m["event"] == "window"]
    for window in windows:
        assert 30.0 < window["end_s"] - window["start_s"] < 50.0
        assert 2 <= len(window["without_s"]) <= 4
    assert any("of 30 s are kept; hold still" in text for text in turner.told)
    assert max(v.elapsed for v in turner.views) > 29.0
    again = usable_windows(session)
    assert not again.warnings
    for live, recorded in zip(taken, again.averages, strict=True):
        np.testing.assert_allclose(live.mean, recorded.mean, atol=1e-6)
        np.testing.assert_allclose(live.sigma, recorded.sigma, rtol=0.1)
    found = diagnose(session.block, session.about)
    assert not {e.id for e in found.effects} & {"dropped", "bump", "stuck"}
