"""Sockets that a virtual autopilot talks through: datagrams, or one call at a time."""

from __future__ import annotations

import math
import socket
from collections import deque
from contextlib import suppress
from time import monotonic
from typing import Protocol

from fieldcal.core.errors import DeviceError

GONE_S = 5.0
"""Silence after which a host on UDP counts as gone, s: five of its heartbeats."""

BURST = 200
"""Datagrams sent before anything else is looked after."""

HEARD = 1 << 16


class Port(Protocol):
    """Socket for one host."""

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
    """UDP socket that waits for a host's first datagram (`waits`), or sends first."""

    def __init__(self, place: tuple[str, int], waits: bool) -> None:
        self._socket = _opened(socket.SOCK_DGRAM, place if waits else None)
        host, port = self._socket.getsockname() if waits else place
        self.place = (host, port) if waits else place
        self.address = f"{'udpout' if waits else 'udp'}:{host}:{port}"
        self._peer = None if waits else place
        self._last = -math.inf

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
    """TCP socket that accepts one host at a time."""

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
