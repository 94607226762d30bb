"""Ways to an autopilot that bytes take: a serial port, UDP, TCP.

``udp:HOST:PORT`` (or ``udpin:``) waits there for an autopilot that sends, and answers
where that came from; ``udpout:HOST:PORT`` speaks first; ``tcp:HOST:PORT`` calls; all
else is a serial port. A peer that closes is an OSError, once, so that whoever reads can
call again.
"""

from __future__ import annotations

import select
import socket
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.drivers.reader import ByteSource
from fieldcal.drivers.serial_imu import SerialPort
from fieldcal.drivers.tcp import POLL_TIME, TcpLink, socket_error

RECEIVE_BUFFER = 1 << 20
"""Bytes that the kernel is asked to keep for us."""

MOST_DATAGRAMS = 512
"""Datagrams taken at once."""

LARGEST_DATAGRAM = 1 << 16


class TwoWaySource(ByteSource, Protocol):
    """A source that can also be spoken to."""

    def write(self, data: bytes) -> None:
        """Send; OSError if the other end is gone."""


class UdpLink:
    """Datagrams, from a peer that speaks first, or to one that waits.

    Parameters
    ----------
    place : host and port
    waits : whether the place is ours, and the peer speaks first

    """

    def __init__(self, place: tuple[str, int], waits: bool) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._peer = None if waits else place
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            if waits:
                self._socket.bind(place)
            self._socket.setblocking(False)
        except OSError as fault:
            self._socket.close()
            raise DeviceError(socket_error(place, fault)) from fault

    def read(self) -> bytes:
        """Return all datagrams that are there, waiting `POLL_TIME` s for the first."""
        parts: list[bytes] = []
        select.select([self._socket], [], [], POLL_TIME)
        # a refused datagram is told on the next read: nobody is there yet
        with suppress(BlockingIOError, ConnectionRefusedError):
            while len(parts) < MOST_DATAGRAMS:
                data, peer = self._socket.recvfrom(LARGEST_DATAGRAM)
                self._peer = peer
                parts.append(data)
        return b"".join(parts)

    def write(self, data: bytes) -> None:
        """Send to the peer, once one is known."""
        if self._peer is not None:
            with suppress(BlockingIOError, ConnectionRefusedError):
                self._socket.sendto(data, self._peer)

    def close(self) -> None:
        """Release the socket."""
        self._socket.close()


def endpoint_opener(endpoint: str, baud: int) -> Callable[[], TwoWaySource]:
    """Return what opens an endpoint, and opens it again.

    Raises
    ------
    InputError
        If a host or a port is missing.

    """
    scheme, _, rest = endpoint.partition(":")
    if scheme in ("udp", "udpin"):
        place = _host_and_port(endpoint, rest)
        return lambda: UdpLink(place, waits=True)
    if scheme == "udpout":
        place = _host_and_port(endpoint, rest)
        return lambda: UdpLink(place, waits=False)
    if scheme == "tcp":
        place = _host_and_port(endpoint, rest)
        return lambda: TcpLink(place)
    return lambda: SerialPort(endpoint, baud)


def _host_and_port(endpoint: str, rest: str) -> tuple[str, int]:
    host, _, port = rest.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise InputError(
            f"mavlink: {endpoint} needs host and port, as in udp:0.0.0.0:14550"
        )
    return host, int(port)
