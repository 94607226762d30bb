"""The engine on the virtual device: windows at rest, after turns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from engine_bench import ABOUT, Bench, Turner, events, hold_all, make

from fieldcal.core.errors import (
    CalibrationFailed,
    WrongPosition,
)
from fieldcal.core.positions import TWO_POSITIONS, Position
from fieldcal.diagnosis import diagnose
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.planning.steps import hold
from fieldcal.run.engine import Engine
from fieldcal.run.operator.protocol import OperatorView
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess
from fieldcal.windows import Average


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
    """A device that runs at seven times the host's clock."""

    def host_time(self) -> float:
        return self.device.time / 7


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


def test_who_turns_before_a_position_is_done_is_told_so(bench: Bench) -> None:
    class Early(Turner):
        """Turns on amid the second window, and back when told."""

        early = False

        def show(self, view: OperatorView) -> None:
            super().show(view)
            second = [v.phase for v in self.views].count("taken") == 1
            averaging = view.phase == "averaging" and view.elapsed > 5.0
            if second and averaging and not self.early:
                self.early = True
                self.driver.place(Position.deg(-45.0, 5.0))

        def tell(self, text: str) -> None:
            super().tell(text)
            if "too early" in text:
                self.driver.place(TWO_POSITIONS[1])

    turner = Early(bench.turner.driver)
    engine = Engine(turner.driver, turner, ABOUT, bench.recorder, give_up=60.0)
    averages = engine.run(hold_all(TWO_POSITIONS, 10.0))
    assert any("turned too early, position 2 is not done" in t for t in turner.told)
    assert averages[1].mean[0] < 0, "the window must be from +45 degrees"


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
