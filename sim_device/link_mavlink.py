"""A virtual autopilot on MAVLink, at udpin:, udpout:, tcpin:HOST:PORT or a pty.

Over TCP and a pty a slow host is waited for as on a serial line; over UDP nobody tells,
so at a speed that a host does not follow it loses packets. Port 0 is any free one.
Samples flow once a host has asked for some, see `autopilot`.
"""

from __future__ import annotations

import math
from collections import deque
from time import monotonic, sleep

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.sim_device.autopilot import Autopilot
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.link import Link
from fieldcal.sim_device.mavlink_ports import Port, TcpPort, UdpPort
from fieldcal.sim_device.pty_port import PtyPort

BEAT_S = 1.0
DATAGRAMS = ("udpin", "udpout")

TOGETHER = 10
"""Packets in a datagram."""

LOOK_S = 0.01


class MavlinkLink(Link):
    """A device inside an autopilot.

    Parameters
    ----------
    scheme, place : kind of the port, host and port
    autopilot : at the end of the link
    faults : corrupt the bytes
    rate : of the sensor, Hz

    Raises
    ------
    DeviceError
        If the port cannot be opened.

    """

    def __init__(
        self,
        scheme: str,
        place: tuple[str, int],
        autopilot: Autopilot,
        faults: LineFaults,
        rate: float,
    ) -> None:
        self._scheme, self._place = scheme, place
        self._autopilot, self._faults, self._rate = autopilot, faults, rate
        self._out: deque[bytes] = deque()
        self._beat = -math.inf
        self._port: Port | None = None
        self.come_back()

    @property
    def address(self) -> str:
        """What a host has to open, behind ``mavlink:``."""
        return self._port.address if self._port else ""

    def fileno(self) -> int:
        """Return the socket that a host talks through."""
        return self._port.fileno() if self._port else -1

    def attached(self) -> bool:
        """Whether a host is there, and has asked for samples."""
        return bool(self._port and self._port.listens() and self._autopilot.sends)

    def send(self, block: Block) -> None:
        """Queue samples; they are lost while no host is there."""
        if not self.attached():
            return
        packets = self._autopilot.samples(block, self._rate)
        together = TOGETHER if self._scheme in DATAGRAMS else len(packets)
        for first in range(0, len(packets), max(1, together)):
            part = b"".join(packets[first : first + together])
            self._out.append(self._faults.spoil(part))

    @property
    def pending(self) -> int:
        """Bytes that the host has not taken yet."""
        return sum(map(len, self._out))

    def pump(self) -> None:
        """Send what is taken, hear what the host says, and answer it."""
        if self._port is None:
            return
        there = self._port.listens()
        if said := self._port.read():
            self._out.append(self._autopilot.hear(said))
        calls = there or self._scheme == "udpout"
        if calls and monotonic() - self._beat >= BEAT_S:
            self._beat = monotonic()
            self._out.append(self._autopilot.heartbeat())
        self._port.write(self._out)

    def linger(self, seconds: float) -> None:
        """Wait, at most so long, until the host has taken everything."""
        end, ended = monotonic() + seconds, False
        while self._port and monotonic() < end and self._port.listens():
            self.pump()
            if not self._out and not ended:
                ended = True
                self._port.finish()
                if self._scheme in DATAGRAMS:
                    return
            sleep(LOOK_S)

    def reboot(self) -> None:
        """Forget the rates that were asked for."""
        self._autopilot.reboot()

    def hang_up(self) -> None:
        """Close the port."""
        if self._port is not None:
            self._place = self._port.place
            self._port.close()
            self._port = None
            self._out.clear()

    def come_back(self) -> None:
        """Open the port, the same as before."""
        if self._port is not None:
            return
        if self._scheme == "tcpin":
            self._port = TcpPort(self._place)
        elif self._scheme == "pty":
            self._port = PtyPort()
        else:
            self._port = UdpPort(self._place, self._scheme == "udpin")

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self.hang_up()


def open_link(spec: str, faults: LineFaults, rate: float) -> MavlinkLink:
    """Make the link for ``SCHEME:HOST:PORT?option=value&…``.

    Raises
    ------
    InputError
        If it is no such place, or pymavlink is not installed.

    """
    where, _, query = spec.partition("?")
    scheme, _, rest = where.partition(":")
    host, _, port = rest.rpartition(":")
    known = (*DATAGRAMS, "tcpin")
    placed = scheme in known and host and port.isdecimal() and int(port) < 65536
    if where != "pty" and not placed:
        raise InputError(
            f"--mavlink {spec}: write {', '.join(known)} with host and port, as in "
            "udpin:127.0.0.1:14550, or pty"
        )
    try:
        autopilot = Autopilot(query)
    except ImportError as error:
        raise InputError(
            "MAVLink needs pymavlink and fastcrc: pip install 'fieldcal[mavlink]'"
        ) from error
    except InputError as error:
        raise InputError(f"--mavlink: {error}") from error
    return MavlinkLink(scheme, (host, int(port or 0)), autopilot, faults, rate)
