"""Lets a virtual device run: device time against the wall clock, orders, the link.

At real time (speed 1) the device goes on whether somebody listens or not, and what a
slow host does not take is lost. At any other speed it waits for the host, so that none
is lost; "max" is as fast as the host takes it.
"""

from __future__ import annotations

import math
import select
from collections.abc import Callable
from time import monotonic
from typing import Protocol

from fieldcal.sim_device.delay import SampleDelay
from fieldcal.sim_device.device import VirtualDevice
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.link import Link
from fieldcal.sim_device.stamp_faults import StampFaults

TICK_S = 0.01
"""How often samples are sent, and longest sleep in between, s of wall clock."""

CHUNK_S = 0.1
"""Longest stretch of device time that is sent at once, s; longer at high speed."""

MOST_S = 0.5
"""And the longest of all: an order takes effect so much later, at most."""

HELD_S = 0.25
"""What a device at real time keeps for a slow host before it loses samples, s."""

LINGER_S = 2.0
"""How long a host gets, in the end, to read what is still in the pipe, s."""

BEHIND_S = 0.5
"""If the pace is missed by more, it is taken up anew instead of caught up, s."""


class OrderSource(Protocol):
    """Source of orders: the control socket, or the keys."""

    def watched(self) -> tuple[list[int], list[int]]:
        """Files to watch for reading and for writing."""

    def serve(self) -> None:
        """Do whatever can be done at once."""


class DeviceStream:
    """One device on one link.

    Parameters
    ----------
    device, link, faults : of the stream
    speed : device seconds in a second; inf for as fast as the host takes it
    duration : device time at which it ends, s
    once : whether it ends when the host disconnects
    announce : called with each new address

    """

    def __init__(
        self,
        device: VirtualDevice,
        link: Link,
        faults: LineFaults,
        speed: float = 1.0,
        duration: float = math.inf,
        once: bool = False,
        announce: Callable[[str], None] = lambda address: None,
    ) -> None:
        self.device, self.link, self.faults = device, link, faults
        self.stamps, self.delay = StampFaults(), SampleDelay(device.seed)
        # a clock that runs fast puts out more samples in a second of the wall clock
        self._pace = speed * device.sensing.pace
        self._speed, self._duration, self._announce = speed, duration, announce
        self._once, self._heard = once, False
        self._silent_until = self._away_until = -math.inf
        self._ends = False
        self._origin = 0.0

    def stop(self) -> None:
        """End after what is being done now."""
        self._ends = True

    def silence(self, seconds: float) -> float:
        """Send nothing for so long; returns the device time until then."""
        self._silent_until = max(self._silent_until, self.device.time + seconds)
        return self._silent_until

    def hang_up(self, seconds: float) -> float:
        """Break the link for so long; returns the device time until then."""
        self.delay.forget()
        self.link.hang_up()
        self._away_until = max(self._away_until, self.device.time + seconds)
        return self._away_until

    def reboot(self, seconds: float) -> float:
        """Begin anew after so long; returns the device time until then."""
        until = self.silence(seconds)
        self.stamps.reboot(until)
        self.link.reboot()
        self._heard = False  # a host that has to ask anew has not gone
        return until

    def run(self, *listeners: OrderSource) -> None:
        """Run until the end: the duration, or `stop`.

        Raises
        ------
        DeviceError
            If the link fails for good.

        """
        self._origin = monotonic() - self.device.time / self._pace
        while not self._ends:
            self._sleep(listeners)
            for listener in listeners:
                listener.serve()
            for block in self.delay.over():
                self.link.send(block)
            self.link.pump()
            self._notice()
            if not self._ends:
                self._go_on()
        for block in self.delay.over(math.inf):
            self.link.send(block)
        self.link.linger(LINGER_S)

    def _notice(self) -> None:
        """Notice a host that comes, or that goes by itself."""
        if self.link.attached():
            self._heard = True
        elif self._heard and self._once and not self._away:
            self._ends = True

    @property
    def _away(self) -> bool:
        return self.device.time < self._away_until

    def _go_on(self) -> None:
        """Send the samples that are due."""
        n = self._due()
        if math.isfinite(self._duration):
            left = (self._duration - self.device.time) * self.device.rate
            n = min(n, math.ceil(left - 1e-6))
            self._ends = n <= 0 and left < 1e-6
        if n <= 0:
            return
        was_away = self._away
        silent = self.device.time < self._silent_until
        block = self.device.take(n)
        if was_away and not self._away:
            self.link.come_back()
            self._heard = False
            self._announce(self.link.address)
        elif not silent and not was_away and self._room():
            self.delay.hold(self.stamps.passes(block))
            for ready in self.delay.over():
                self.link.send(ready)
        self.link.pump()

    def _room(self) -> bool:
        """Whether the host is not too far behind for a device that does not wait."""
        return not (self._speed == 1 and self.link.pending > self._most_held)

    @property
    def _most_held(self) -> int:
        return int(HELD_S * self.device.rate * 100)

    def _due(self) -> int:
        """How many samples the device should put out now."""
        if self._speed != 1 and not (self.link.attached() or self._away):
            self._origin = monotonic() - self.device.time / self._pace
            return 0
        if self._speed != 1 and (self.link.pending or self.delay):
            return 0
        stretch = min(max(CHUNK_S, TICK_S * self._speed), MOST_S)
        chunk = max(1, round(stretch * self.device.rate))
        if math.isinf(self._speed):
            return chunk
        now = (monotonic() - self._origin) * self._pace
        due = math.floor((now - self.device.time) * self.device.rate)
        late = due / self.device.rate / self._speed
        if self._speed != 1 and late > BEHIND_S:
            self._origin = monotonic() - self.device.time / self._pace
        batch = max(1, int(TICK_S * self._speed * self.device.rate))
        return min(due, chunk) if due >= batch else 0

    def _sleep(self, listeners: tuple[OrderSource, ...]) -> None:
        """Wait until there may be something to do."""
        reading: list[int] = []
        writing: list[int] = []
        for listener in listeners:
            more_reading, more_writing = listener.watched()
            reading += more_reading
            writing += more_writing
        free = self.link.attached()
        if free and self.link.fileno() >= 0:
            reading.append(self.link.fileno())
            if self.link.pending:
                writing.append(self.link.fileno())
        busy = not self.link.pending and (free or self._away) and self._due() > 0
        select.select(reading, writing, [], 0 if busy else TICK_S)
