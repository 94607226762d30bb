"""Gyroscopes in another unit than the one that was said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from engine_bench import Bench, hold_all, make

from fieldcal.core.errors import (
    WrongPosition,
)
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS
from fieldcal.core.samples import Block, split_by_time
from fieldcal.run.gyro_unit import GyroUnitWatch
from fieldcal.run.wait_reason import WaitState
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess


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
    ("scale", "taken"),
    [(np.pi / 180, "deg/s"), (1e-3, "mrad/s"), (0.2, ""), (0.0, "")],
)
def test_rates_that_are_taken_for_a_smaller_unit_are_told_by_a_turn(
    scale: float, taken: str
) -> None:
    """They look like rest, so that without this only the end would tell."""
    units, rng = GyroUnitWatch(9.81), np.random.default_rng(7)
    t = np.arange(1400) / 100
    angle = np.deg2rad(45.0) * np.clip((t - 6.0) / 3.0, 0.0, 1.0)
    acc = 9.81 * np.column_stack([0 * t, -np.cos(angle), np.sin(angle)])
    gyr = np.column_stack([np.gradient(angle, t), 0 * t, 0 * t])
    gyr += 2e-3 * rng.standard_normal((1400, 3))
    block = Block.of(t, acc + 0.02 * rng.standard_normal((1400, 3)), scale * gyr)
    for piece in split_by_time(block, 0.1):
        units.add(piece)
    said = f"they are in rad/s, and are taken for {taken};" if taken else ""
    assert said in units.notice and bool(units.notice) == bool(taken)


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


class TakenForDegrees(InProcess):
    """A device whose gyroscopes send rad/s under a driver that was told deg/s."""

    def receive(self, timeout: float) -> Block | None:
        block = super().receive(timeout)
        return block and replace(block, gyr=np.deg2rad(block.gyr))


def test_a_unit_that_looks_like_rest_is_said_where_it_stays(tmp_path: Path) -> None:
    """Behind the window as well: what was said of the turn is gone by then."""
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        made = make(recorder, TakenForDegrees(VirtualDevice(seed=3)))
        made.engine.run(hold_all(TWO_POSITIONS, 10.0))
    said = [text for text in made.turner.told if "and are taken for deg/s" in text]
    assert said and made.turner.told[-1] == said[-1]
