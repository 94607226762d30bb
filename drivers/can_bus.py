"""A CAN bus as a reader wants it: rows of frames, through python-can.

An adapter that speaks the Lawicel protocol (slcan) is set up by python-can, but read
here: python-can reads its port byte by byte, 7000 frames/s, and takes lines that lost
or gained a byte for frames.
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
from fieldcal.drivers.can_frames import Packed
from fieldcal.drivers.can_groups import CanHealth
from fieldcal.drivers.lawicel import Lawicel
from fieldcal.drivers.options import Options
from fieldcal.drivers.reader import LinkDown
from fieldcal.drivers.serial_imu import SerialPort, reason
from fieldcal.drivers.tcp import POLL

if TYPE_CHECKING:
    from can import BusABC, Message

MOST = 2000
"""Frames taken at once."""

LONGEST = 0.02
"""Longest time that frames are collected before they are handed on, s."""

WAITING = 1 << 21
"""Bytes that the kernel is asked to keep for us: its own 200 KB are 0.1 s of a bus."""

_NO_CAN = (
    "the kernel has no CAN; load it with `modprobe can_raw`, or use another interface,"
    " such as interface=slcan"
)
_NO_CHANNEL = "there is no such CAN channel; see `ip link`"
KERNEL = {
    errno.EAFNOSUPPORT: _NO_CAN,
    errno.EPROTONOSUPPORT: _NO_CAN,
    errno.ENODEV: _NO_CHANNEL,
    errno.ENXIO: _NO_CHANNEL,
    errno.ENETDOWN: "it is down; `ip link set` it up with its bitrate",
}
MULTICAST = {
    errno.ENODEV: "no network takes multicast; add a route for 224.0.0.0/4",
    errno.ENETUNREACH: "no network takes multicast; add a route for 224.0.0.0/4",
    errno.EADDRINUSE: "another program has the port; choose another with port=",
}

# what goes wrong is said in one sentence, not by python-can's log besides
logging.getLogger("can").addHandler(logging.NullHandler())

Settings = Mapping[str, Any]


def settings(options: Options) -> dict[str, Any]:
    """Take what python-can is to be told from the options of an address."""
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


def connect(channel: str, told: Settings) -> BusABC:
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
            f"cannot open {at}: {open_error(interface, fault)}"
        ) from fault


ONLY: Mapping[Any, int] = defaultdict(int)
"""A live bus is one of one, whatever its channel is called."""


class BusSource:
    """Frames of any bus that python-can knows."""

    def __init__(self, bus: BusABC, interface: str) -> None:
        self._bus, self._interface = bus, interface
        with suppress(NotImplementedError, OSError):  # a bus that is no socket
            with socket.fromfd(bus.fileno(), socket.AF_INET, socket.SOCK_DGRAM) as own:
                own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, WAITING)

    def read(self) -> bytes:
        """Return rows of the frames that came, waiting `POLL` seconds for the first.

        Raises
        ------
        OSError
            If the bus is gone; LinkDown if it is there and down.

        """
        import can

        packed = Packed(MOST)
        try:
            packed.fill(self._waiting(), ONLY)
        except (can.CanError, OSError) as fault:
            said = open_error(self._interface, fault)
            down = LinkDown if said in KERNEL.values() else OSError
            raise down(said) from fault
        return packed.frames.tobytes()

    def _waiting(self) -> Iterator[Message]:
        message, until = self._bus.recv(POLL), monotonic() + LONGEST
        while message is not None:
            yield message
            message = self._bus.recv(0) if monotonic() < until else None

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


class SlcanSource:
    """Frames of an adapter on a serial port.

    Parameters
    ----------
    bus : python-can's, which has opened the port and the channel
    health : where lines that are no frames are counted

    """

    def __init__(self, bus: Any, health: CanHealth) -> None:
        self._bus, self._port = bus, bus.serialPortOrig
        self._lines = Lawicel(health)
        self._port.timeout = POLL
        if "://" not in self._port.port:
            self._port.exclusive = True

    def read(self) -> bytes:
        """Return rows of the frames that came, waiting `POLL` seconds for the first."""
        return self._lines.feed(self._port.read(max(1, self._port.in_waiting)))

    def close(self) -> None:
        """Close the channel and the port, if it is still there."""
        import can

        try:
            self._bus.shutdown()
        except (can.CanError, OSError):
            self._port.close()


def open_source(
    channel: str, told: Settings, health: CanHealth
) -> BusSource | SlcanSource:
    """Open a bus for a reader; errors as in `connect`."""
    if told["interface"] != "slcan":
        return BusSource(connect(channel, told), told["interface"])
    # first of all: what python-can sends would close another program's channel
    SerialPort(channel, told.get("tty_baudrate", 115200)).close()
    return SlcanSource(connect(channel, told), health)


def open_error(interface: str, fault: BaseException) -> str:
    """Say why a bus did not open, and what to do."""
    if interface == "slcan":
        return reason(fault)
    below: BaseException | None = fault
    while below is not None and not isinstance(below, OSError):
        below = below.__cause__
    known = MULTICAST if interface == "udp_multicast" else KERNEL
    return known.get(below.errno or 0, str(fault)) if below else str(fault)
