"""A CAN bus: through an adapter on a pty, or any bus that python-can knows.

``slcan`` is a device behind a Lawicel adapter: a serial line, with all that a serial
line does. On any other bus nobody tells whether a host listens, and there is no waiting
for one: at a speed that a host does not follow, it loses frames. A line's faults are a
bus's as well, with a frame in place of a byte: a flipped or lost one is a frame that
fails its check and is not sent again.
"""

from __future__ import annotations

import errno
import logging
import math
from collections import deque
from pathlib import Path
from time import sleep
from typing import TYPE_CHECKING

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Block
from fieldcal.sim_device.adapter import Adapter
from fieldcal.sim_device.can_packing import CanPacket, frames
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.link import Link
from fieldcal.sim_device.link_serial import SerialLink

if TYPE_CHECKING:
    from can import BusABC

# what goes wrong is said in one sentence, not by python-can's log besides
logging.getLogger("can").addHandler(logging.NullHandler())

BYTES = 13
"""Bytes that a waiting frame counts for: identifier, length, data."""

BURST = 300
"""Frames sent before anything else is looked after."""

FULL = (errno.ENOBUFS, errno.EAGAIN)
"""What a system says whose queue is full."""

LINGER_S = 0.1
"""Time that a host gets to take the last frames out of its socket, s."""


class SlcanLink(SerialLink):
    """A device behind an adapter on a pty; a host listens once the channel is open."""

    def __init__(self, faults: LineFaults, port_link: Path | None = None) -> None:
        self._adapter = Adapter()
        super().__init__(self._adapter, faults, port_link)

    def attached(self) -> bool:
        """Whether a host has the port and the channel open."""
        return super().attached() and self._adapter.open

    def hang_up(self) -> None:
        """Pull the adapter out."""
        super().hang_up()
        self._adapter.unplug()

    def _forget(self) -> None:
        super()._forget()
        self._adapter.unplug()


class BusLink(Link):
    """A device on a bus.

    Parameters
    ----------
    interface, channel : as python-can calls them
    faults : corrupt the frames

    Raises
    ------
    InputError
        If there is no such interface, or python-can is not installed.
    DeviceError
        If the bus cannot be opened.

    """

    def __init__(self, interface: str, channel: str, faults: LineFaults) -> None:
        self._interface, self._channel = interface, channel
        self._faults = faults
        self._out: deque[CanPacket] = deque()
        self._bus: BusABC | None = None
        self.come_back()

    @property
    def address(self) -> str:
        """The channel."""
        return self._channel

    def fileno(self) -> int:
        """Return nothing to watch: a bus says nothing to this device."""
        return -1

    def attached(self) -> bool:
        """Whether the device is on the bus; who listens there is not known."""
        return self._bus is not None

    def send(self, block: Block) -> None:
        """Queue samples."""
        if self._bus is not None:
            self._out.extend(self._faults.spoil_frames(frames(block)))

    @property
    def pending(self) -> int:
        """Bytes of the frames that the bus has not taken yet."""
        return len(self._out) * BYTES

    def pump(self) -> None:
        """Send what the bus takes.

        Raises
        ------
        DeviceError
            If the bus is gone.

        """
        import can

        if self._bus is None:
            return
        try:
            for _ in range(min(BURST, len(self._out))):
                identifier, data = self._out[0]
                self._bus.send(
                    can.Message(
                        arbitration_id=identifier, data=data, is_extended_id=False
                    )
                )
                self._out.popleft()
        except (can.CanError, OSError) as error:
            # into a full queue the frame goes the next time
            if (
                not isinstance(error, can.CanTimeoutError)
                and _number(error) not in FULL
            ):
                raise DeviceError(
                    f"{self._interface} channel {self._channel} takes no frame: {error}"
                ) from error

    def linger(self, seconds: float) -> None:
        """Send the rest; what a host does with it is not known."""
        for _ in range(math.ceil(seconds / LINGER_S)):
            self.pump()
            sleep(LINGER_S)
            if not self._out:
                return

    def hang_up(self) -> None:
        """Leave the bus."""
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None
            self._out.clear()

    def come_back(self) -> None:
        """Join the bus."""
        try:
            import can
        except ImportError as error:
            raise InputError(
                "CAN needs python-can and cantools: pip install 'fieldcal[can]'"
            ) from error
        try:
            self._bus = can.Bus(self._channel, interface=self._interface)
        except (can.CanInterfaceNotImplementedError, ValueError, TypeError) as error:
            raise InputError(f"--can {self._interface}: {error}") from error
        except (can.CanError, OSError) as error:
            raise DeviceError(
                f"cannot join {self._interface} channel {self._channel}: {error}"
            ) from error

    def close(self) -> None:
        """Leave the bus; safe to call twice."""
        self.hang_up()


def _number(error: BaseException | None) -> int | None:
    """Number of the operating system's error behind one of python-can."""
    while error is not None and not isinstance(error, OSError):
        error = error.__cause__
    return error.errno if error else None


def open_link(spec: str, faults: LineFaults, port_link: Path | None = None) -> Link:
    """Make the link for ``INTERFACE:CHANNEL``, or ``slcan`` for an adapter on a pty.

    Raises
    ------
    InputError
        If a channel is missing, or there is none for slcan.

    """
    interface, _, channel = spec.partition(":")
    if interface == "slcan":
        if channel:
            raise InputError(
                f"--can {spec}: slcan makes its port itself; name it with --port-link"
            )
        return SlcanLink(faults, port_link)
    if not channel:
        raise InputError(
            f"--can {spec} needs a channel, as in --can udp_multicast:239.74.163.2"
        )
    if port_link:
        raise InputError(f"--can {spec} is no port: leave --port-link out")
    return BusLink(interface, channel, faults)
