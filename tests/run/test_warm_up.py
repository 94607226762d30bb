"""Devices that warm up: known from their temperature, and waited for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from engine_bench import ABOUT, Turner, hold_all

from fieldcal.core.positions import TWO_POSITIONS
from fieldcal.core.samples import Block
from fieldcal.run.engine import Engine
from fieldcal.run.operator.protocol import Wish
from fieldcal.run.wait_reason import WaitState
from fieldcal.run.warm_up import WarmUpWatch
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess
from fieldcal.sim_device.profile import Climate, Profile


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
