"""A pseudo-terminal that packets go through, for a link that does its own packing."""

from __future__ import annotations

import os
import pty
import select
import termios
import tty
from collections import deque
from contextlib import suppress

from fieldcal.core.errors import DeviceError

HEARD = 1 << 16


def open_pty() -> tuple[int, str]:
    """Open a pty in raw mode: our side, which does not block, and the path of theirs.

    Theirs is not held open, so the kernel tells whether a host is there.

    Raises
    ------
    DeviceError
        If no pty can be opened.

    """
    try:
        ours, theirs = pty.openpty()
    except OSError as error:
        raise DeviceError(f"no pty to be had: {error.strerror}") from error
    tty.setraw(theirs)
    path = os.ttyname(theirs)
    os.close(theirs)
    os.set_blocking(ours, False)
    return ours, path


def forget(path: str) -> None:
    """Drop what a host left unread when it went: the next one would hear its end."""
    theirs = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    termios.tcflush(theirs, termios.TCIFLUSH)
    os.close(theirs)


class PtyPort:
    """The device's side of a pty.

    Raises
    ------
    DeviceError
        If there is no pty to be had.

    """

    def __init__(self) -> None:
        self._ours, self.address = open_pty()
        self._heard = False
        self.place = (self.address, 0)

    def fileno(self) -> int:
        """Return our side."""
        return self._ours

    def listens(self) -> bool:
        """Whether a host has the port open."""
        poll = select.poll()
        poll.register(self._ours, select.POLLIN)
        return not any(event & select.POLLHUP for _, event in poll.poll(0))

    def read(self) -> bytes:
        """Return what the host said."""
        with suppress(OSError):  # nothing, or nobody
            return os.read(self._ours, HEARD)
        return b""

    def write(self, parts: deque[bytes]) -> None:
        """Send what the pty takes; what nobody is there for is lost."""
        if not self.listens():
            parts.clear()
            if self._heard:
                self._heard = False
                forget(self.address)
            return
        self._heard = True
        with suppress(BlockingIOError):
            while parts:
                sent = os.write(self._ours, parts[0])
                rest = parts.popleft()[sent:]
                if rest:
                    parts.appendleft(rest)

    def finish(self) -> None:
        """Do nothing: a line has no end but a hang-up."""

    def close(self) -> None:
        """Hang up."""
        os.close(self._ours)
