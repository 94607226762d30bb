"""A TCP connection as a source of bytes."""

from __future__ import annotations

import select
import socket

from fieldcal.core.errors import DeviceError

POLL_TIME = 0.1
"""Longest wait for a byte, s; then the reader checks whether it should end."""

BYTES_AT_ONCE = 1 << 16
CONNECT_TIMEOUT = 5.0
"""Longest time for connecting, s."""


class TcpLink:
    """A TCP connection to a device.

    Raises
    ------
    DeviceError
        If the connection fails.

    """

    def __init__(self, place: tuple[str, int]) -> None:
        self._place = place
        try:
            self._socket = socket.create_connection(place, CONNECT_TIMEOUT)
        except OSError as fault:
            raise DeviceError(socket_error(place, fault)) from fault

    def read(self) -> bytes:
        """Return all that is there, waiting `POLL_TIME` seconds for the first byte.

        Raises
        ------
        OSError
            If the peer has closed.

        """
        ready, _, _ = select.select([self._socket], [], [], POLL_TIME)
        if not ready:
            return b""
        data = self._socket.recv(BYTES_AT_ONCE)
        if not data:
            raise ConnectionResetError(f"{self._place[0]}:{self._place[1]} has closed")
        return data

    def write(self, data: bytes) -> None:
        """Send."""
        self._socket.sendall(data)

    def close(self) -> None:
        """Hang up."""
        self._socket.close()


def socket_error(place: tuple[str, int], fault: OSError) -> str:
    """Say why a socket did not open, and what to do."""
    why = fault.strerror or str(fault)
    return (
        f"cannot open {place[0]}:{place[1]}: {why}; check host and port, and that no "
        "other program (a ground station) has it"
    )
