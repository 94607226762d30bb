"""A device that was lost: what the run waits for, and what is said meanwhile."""

from __future__ import annotations

from pathlib import Path
from time import monotonic

import pytest
from engine_bench import Turner

from fieldcal.core.errors import DeviceError, DeviceSilent, Stopped
from fieldcal.core.samples import Block
from fieldcal.drivers.driver import Driver
from fieldcal.run import reconnection
from fieldcal.run.reconnection import Reconnection
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess

LOST = DeviceSilent("ttyUSB0 went silent for 3 s")


class Mute(InProcess):
    """A port that is there, with a device that sends only later."""

    silences, bytes_each, closed = 3, 0, False

    def receive(self, timeout: float) -> Block | None:
        if self.silences > 0:
            self.silences -= 1
            self.health.received += self.bytes_each
            return None
        return super().receive(timeout)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def turner(monkeypatch: pytest.MonkeyPatch) -> Turner:
    monkeypatch.setattr(reconnection, "RETRY_S", 0.001)
    return Turner(InProcess(VirtualDevice()))


def waited(
    folder: Path, turner: Turner, drivers: list[Driver | DeviceError], patience: float
) -> Driver:
    """What comes of a wait; devices are opened in turn."""

    def opened() -> Driver:
        one = drivers.pop(0)
        if isinstance(one, DeviceError):
            raise one
        return one

    with Recorder(folder / "s", {"format": 1}) as recorder:
        return Reconnection(opened, turner, recorder).wait(LOST, monotonic() + patience)


def test_a_port_that_opens_is_no_device_until_samples_come(
    tmp_path: Path, turner: Turner
) -> None:
    """It is opened once, as opening resets some devices; its first sample is kept."""
    mute = Mute(VirtualDevice())
    back = waited(tmp_path, turner, [DeviceError("gone"), mute], 60.0)
    assert back is mute and not mute.closed
    assert "went silent for 3 s; goes on by itself" in turner.told[0]
    assert turner.told[1:] == ["samples come from virtual device again"]
    first = VirtualDevice().take(1)
    assert next(iter(back.blocks())).t[0] == first.t[0]


def test_what_comes_in_place_of_samples_is_said_once(
    tmp_path: Path, turner: Turner
) -> None:
    """A device that restarted at another baud rate is not one that is silent."""
    mute = Mute(VirtualDevice())
    mute.bytes_each = 40
    waited(tmp_path, turner, [mute], 60.0)
    said = [told for told in turner.told if "frames come, but no whole sample" in told]
    assert len(said) == 1


@pytest.mark.parametrize("stops", [True, False])
def test_a_wait_without_end_is_ended(
    tmp_path: Path, turner: Turner, stops: bool
) -> None:
    mute = Mute(VirtualDevice())
    mute.silences = 10**9
    turner.wishes = ["repeat", "stop"] if stops else []
    with pytest.raises(Stopped if stops else DeviceSilent):
        waited(tmp_path, turner, [mute], 60.0 if stops else 0.02)
    assert mute.closed
