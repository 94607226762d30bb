"""A virtual autopilot on MAVLink, at udpin:, udpout:, tcpin:HOST:PORT or a pty.

Over TCP and a pty a slow host is waited for as on a serial line; over UDP nobody tells,
so at a speed that a host does not follow it loses packets. Port 0 is any free one.
Samples flow once a host has asked for some, see `autopilot`.
"""

from __future__ import annotations

import math
import socket
from collections import deque
from contextlib import suppress
from time import monotonic, sleep
from typing import Protocol

from fieldcal.errors import DeviceError, InputError
from fieldcal.samples import Block
from fieldcal.sim_device.autopilot import Autopilot
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.link import Link
from fieldcal.sim_device.pty_port import PtyPort

BEAT_S = 1.0
GONE_S = 5.0
"""Silence after which a host on UDP counts as gone, s: five of its heartbeats."""

DATAGRAMS = ("udpin", "udpout")

TOGETHER = 10
"""Packets in a datagram."""

BURST = 200
"""Datagrams sent before anything else is looked after."""

HEARD = 1 << 16
LOOK_S = 0.01


class Port(Protocol):
    """A socket that one host talks through."""

    address: str
    place: tuple[str, int]

    def fileno(self) -> int:
        """File to watch; -1 while there is none."""

    def listens(self) -> bool:
        """Whether a host is there."""

    def read(self) -> bytes:
        """What the host said."""

    def write(self, parts: deque[bytes]) -> None:
        """Send what is taken now."""

    def finish(self) -> None:
        """Say that nothing more comes."""

    def close(self) -> None:
        """Release it."""


class UdpPort:
    """A socket that a host speaks to first (`waits`), or that speaks to a host."""

    def __init__(self, place: tuple[str, int], waits: bool) -> None:
        self._socket = _opened(socket.SOCK_DGRAM, place if waits else None)
        host, port = self._socket.getsockname() if waits else place
        self.place = (host, port) if waits else place
        self.address = f"{'udpout' if waits else 'udp'}:{host}:{port}"
        self._peer = None if waits else place
        self._waits, self._last = waits, -math.inf

    def fileno(self) -> int:
        """Return the socket."""
        return self._socket.fileno()

    def listens(self) -> bool:
        """Whether a host has spoken lately."""
        return monotonic() - self._last < GONE_S

    def read(self) -> bytes:
        """Return what hosts said; the last of them is answered."""
        parts = []
        with suppress(BlockingIOError, ConnectionRefusedError):
            while True:
                data, self._peer = self._socket.recvfrom(HEARD)
                parts.append(data)
        if parts:
            self._last = monotonic()
        return b"".join(parts)

    def write(self, parts: deque[bytes]) -> None:
        """Send each part as a datagram."""
        with suppress(BlockingIOError, ConnectionRefusedError):
            for _ in range(min(BURST, len(parts))):
                if self._peer is not None:
                    self._socket.sendto(parts[0], self._peer)
                parts.popleft()

    def finish(self) -> None:
        """Do nothing: datagrams have no end."""

    def close(self) -> None:
        """Release the socket."""
        self._socket.close()


class TcpPort:
    """A socket that waits for a host to call, one at a time."""

    def __init__(self, place: tuple[str, int]) -> None:
        self._listener = _opened(socket.SOCK_STREAM, place)
        self._listener.listen(1)
        host, port = self._listener.getsockname()
        self.place = (host, port)
        self.address = f"tcp:{host}:{port}"
        self._peer: socket.socket | None = None

    def fileno(self) -> int:
        """Return the call."""
        return self._peer.fileno() if self._peer else -1

    def listens(self) -> bool:
        """Whether a host has called."""
        if self._peer is None:
            with suppress(BlockingIOError):
                self._peer, _ = self._listener.accept()
                self._peer.setblocking(False)
        return self._peer is not None

    def read(self) -> bytes:
        """Return what the host said, and notice that it hangs up."""
        if self._peer is None:
            return b""
        try:
            data = self._peer.recv(HEARD)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._drop()
        return data

    def write(self, parts: deque[bytes]) -> None:
        """Send what the host takes."""
        if self._peer is None:
            parts.clear()
            return
        try:
            while parts:
                sent = self._peer.send(parts[0])
                rest = parts.popleft()[sent:]
                if rest:
                    parts.appendleft(rest)
        except BlockingIOError:
            return
        except OSError:
            self._drop()

    def finish(self) -> None:
        """End our side, so that what was sent still arrives."""
        if self._peer is not None:
            with suppress(OSError):
                self._peer.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        """Hang up."""
        self._drop()
        self._listener.close()

    def _drop(self) -> None:
        if self._peer is not None:
            self._peer.close()
            self._peer = None


class MavlinkLink(Link):
    """A device inside an autopilot.

    Parameters
    ----------
    scheme, place : kind of the port, host and port
    autopilot : what answers there
    faults : what spoils the bytes
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


def _opened(kind: int, place: tuple[str, int] | None) -> socket.socket:
    opened = socket.socket(socket.AF_INET, kind)
    opened.setblocking(False)
    try:
        if kind == socket.SOCK_STREAM:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if place is not None:
            opened.bind(place)
    except OSError as error:
        opened.close()
        raise DeviceError(
            f"cannot listen at {place}: {error.strerror}; name a free port"
        ) from error
    return opened
