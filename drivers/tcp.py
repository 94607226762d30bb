"""A stream of bytes from a network socket, as a reader wants it."""

from __future__ import annotations

import select
import socket

from fieldcal.core.errors import DeviceError

POLL = 0.1
"""Longest wait for a byte before the reader looks whether it should end, s."""

SIZE = 1 << 16
CALL = 5.0
"""How long a call may take to be answered, s."""


class Tcp:
    """A call to a device that waits for one.

    Raises
    ------
    DeviceError
        If nobody answers.

    """

    def __init__(self, place: tuple[str, int]) -> None:
        self._place = place
        try:
            self._socket = socket.create_connection(place, CALL)
        except OSError as fault:
            raise DeviceError(socket_error(place, fault)) from fault

    def read(self) -> bytes:
        """Return all that is there, waiting `POLL` seconds for the first byte.

        Raises
        ------
        OSError
            If the peer has closed.

        """
        ready, _, _ = select.select([self._socket], [], [], POLL)
        if not ready:
            return b""
        data = self._socket.recv(SIZE)
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
