"""A CAN bus as a source of rows of frames, through python-can.

An adapter with the Lawicel protocol (slcan) is set up by python-can, but read here:
python-can reads its port byte by byte, at most 7000 frames/s, and accepts lines that
lost or gained a byte as frames.
"""

from __future__ import annotations

import errno
import logging
import socket
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_frames import FrameBuffer
from fieldcal.drivers.lawicel import LawicelDecoder
from fieldcal.drivers.options import Options
from fieldcal.drivers.reader import LinkDown
from fieldcal.drivers.serial_imu import SerialPort, port_error_text
from fieldcal.drivers.tcp import POLL_TIME

if TYPE_CHECKING:
    from can import BusABC, Message

MOST_FRAMES = 2000
"""Most frames read at once."""

LONGEST_COLLECTION = 0.02
"""Longest time for which frames are collected before they are returned, s."""

RECEIVE_BUFFER = 1 << 21
"""Size of the receive buffer, bytes; the default of 200 KB holds 0.1 s of a bus."""

_NO_CAN = (
    "the kernel has no CAN; load it with `modprobe can_raw`, or use another interface,"
    " such as interface=slcan"
)
_NO_CHANNEL = "there is no such CAN channel; see `ip link`"
KERNEL_ERRORS = {
    errno.EAFNOSUPPORT: _NO_CAN,
    errno.EPROTONOSUPPORT: _NO_CAN,
    errno.ENODEV: _NO_CHANNEL,
    errno.ENXIO: _NO_CHANNEL,
    errno.ENETDOWN: "it is down; `ip link set` it up with its bitrate",
}
MULTICAST_ERRORS = {
    errno.ENODEV: "no network takes multicast; add a route for 224.0.0.0/4",
    errno.ENETUNREACH: "no network takes multicast; add a route for 224.0.0.0/4",
    errno.EADDRINUSE: "another program has the port; choose another with port=",
}

# errors are reported in one sentence; python-can's own log is suppressed
logging.getLogger("can").addHandler(logging.NullHandler())

BusSettings = Mapping[str, Any]


def bus_settings(options: Options) -> dict[str, Any]:
    """Settings for python-can from the options of an address."""
    told: dict[str, Any] = {"interface": options.text("interface", "socketcan")}
    for name, low, high in (
        ("bitrate", 1e3, 1e6),
        ("data_bitrate", 1e3, 1e7),
        ("tty_baudrate", 50, 1e8),
        ("port", 1, 65535),
    ):
        if number := options.number(name, 0.0, low, high):
            told[name] = int(number)
    if options.choice("fd", ("0", "1"), "0") == "1":
        told["fd"] = True
    settle = options.number("settle", 0.0, 0.0, 10.0)
    if told["interface"] == "slcan":
        told["sleep_after_open"] = settle
    return told


def open_bus(channel: str, told: BusSettings) -> BusABC:
    """Open a bus.

    Raises
    ------
    InputError
        If python-can knows no such interface, or refuses a setting.
    DeviceError
        If the bus cannot be opened.

    """
    import can

    interface, at = told["interface"], f"{told['interface']} channel {channel}"
    if interface not in can.VALID_INTERFACES:
        known = ", ".join(sorted(can.VALID_INTERFACES))
        raise InputError(f"can: there is no interface {interface!r}; there are {known}")
    try:
        return can.Bus(channel, **told)
    except can.CanInterfaceNotImplementedError as fault:
        raise InputError(f"can: {interface} cannot be used here: {fault}") from fault
    except (ValueError, TypeError) as fault:
        raise InputError(f"can: cannot open {at}: {fault}") from fault
    except (OSError, can.CanError) as fault:
        if isinstance(fault.__cause__, ValueError):
            raise InputError(f"can: cannot open {at}: {fault}") from fault
        raise DeviceError(
            f"cannot open {at}: {bus_error_text(interface, fault)}"
        ) from fault


SINGLE_BUS: Mapping[Any, int] = defaultdict(int)
"""Numbers of buses for a live bus: always 0, whatever its channel."""


class BusSource:
    """Source of frames from any bus that python-can supports."""

    def __init__(self, bus: BusABC, interface: str) -> None:
        self._bus, self._interface = bus, interface
        with suppress(NotImplementedError, OSError):  # a bus without a socket
            with socket.fromfd(bus.fileno(), socket.AF_INET, socket.SOCK_DGRAM) as own:
                own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)

    def read(self) -> bytes:
        """Return rows of the received frames; waits `POLL_TIME` s for the first.

        Raises
        ------
        OSError
            If the bus is gone; LinkDown if it exists and is down.

        """
        import can

        packed = FrameBuffer(MOST_FRAMES)
        try:
            packed.fill(self._waiting(), SINGLE_BUS)
        except (can.CanError, OSError) as fault:
            said = bus_error_text(self._interface, fault)
            down = LinkDown if said in KERNEL_ERRORS.values() else OSError
            raise down(said) from fault
        return packed.frames.tobytes()

    def _waiting(self) -> Iterator[Message]:
        message, until = self._bus.recv(POLL_TIME), monotonic() + LONGEST_COLLECTION
        while message is not None:
            yield message
            message = self._bus.recv(0) if monotonic() < until else None

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


class SlcanSource:
    """Source of frames from a Lawicel adapter on a serial port.

    Parameters
    ----------
    bus : python-can's bus, which has opened the port and the channel
    health : counts lines that are no frames

    """

    def __init__(self, bus: Any, health: CanLinkHealth) -> None:
        self._bus, self._port = bus, bus.serialPortOrig
        self._lines = LawicelDecoder(health)
        self._port.timeout = POLL_TIME
        if "://" not in self._port.port:
            self._port.exclusive = True

    def read(self) -> bytes:
        """Return rows of the received frames; waits `POLL_TIME` s for the first."""
        return self._lines.feed(self._port.read(max(1, self._port.in_waiting)))

    def close(self) -> None:
        """Close the channel and the port, if it is still there."""
        import can

        try:
            self._bus.shutdown()
        except (can.CanError, OSError):
            self._port.close()


def open_source(
    channel: str, told: BusSettings, health: CanLinkHealth
) -> BusSource | SlcanSource:
    """Open a bus for a reader; errors as in `open_bus`."""
    if told["interface"] != "slcan":
        return BusSource(open_bus(channel, told), told["interface"])
    # checks that no other program has the port: python-can would close its channel
    SerialPort(channel, told.get("tty_baudrate", 115200)).close()
    return SlcanSource(open_bus(channel, told), health)


def bus_error_text(interface: str, fault: BaseException) -> str:
    """Text about why a bus did not open, and what to do."""
    if interface == "slcan":
        return port_error_text(fault)
    below: BaseException | None = fault
    while below is not None and not isinstance(below, OSError):
        below = below.__cause__
    known = MULTICAST_ERRORS if interface == "udp_multicast" else KERNEL_ERRORS
    return known.get(below.errno or 0, str(fault)) if below else str(fault)
