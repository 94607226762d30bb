"""The engine, where samples are missing, late, or none."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from engine_bench import ABOUT, Turner, events, hold_all, make
from talking import talking

from fieldcal.core.errors import (
    DeviceSilent,
    Stopped,
)
from fieldcal.core.positions import TWO_POSITIONS
from fieldcal.core.samples import Block
from fieldcal.drivers.driver import Driver, LinkHealth, open_driver
from fieldcal.run.engine import Engine
from fieldcal.run.wait_reason import WaitReason
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess


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
