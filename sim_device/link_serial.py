"""A serial port that is none: a pseudo-terminal in raw mode.

The side that the host opens is not held open here, so that the kernel tells whether a
host is there. While none is, what the device sends is lost, as on a real line.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import sys
import termios
from pathlib import Path
from time import monotonic, sleep

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Block
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.link import Link
from fieldcal.sim_device.pty_port import forget, open_pty
from fieldcal.sim_device.uart import received_bytes, terminal_bit_rate
from fieldcal.sim_device.wire import Wire

HEARD = 4096

LOOK_S = 0.01
EMPTY_LOOKS = 3
"""The kernel moves bytes on in pieces: a port is read out if it stays empty."""


class SerialLink(Link):
    """A device at the end of a pty.

    Parameters
    ----------
    wire : encoder of the samples
    faults : corrupt the bytes
    port_link : symbolic link that names the port for as long as it is there
    baud : bit rate of the device; a host at another hears something else. A pty carries
        any, which is what None leaves it at

    Raises
    ------
    InputError
        If something else has the name of the symbolic link.
    DeviceError
        If no pty can be opened.

    """

    def __init__(
        self,
        wire: Wire,
        faults: LineFaults,
        port_link: Path | None = None,
        baud: int | None = None,
    ) -> None:
        self._wire, self._baud = wire, baud
        self._faults = faults
        self._port_link = port_link
        self._ours = -1
        self._out = bytearray()
        self._heard = False
        self.port = ""
        self.come_back()

    @property
    def address(self) -> str:
        """Path to open: the symbolic link, if there is one."""
        return str(self._port_link or self.port)

    def fileno(self) -> int:
        """Return our side of the pty."""
        return self._ours

    def attached(self) -> bool:
        """Whether a host has the port open."""
        return self._ours >= 0 and not self._events() & select.POLLHUP

    def _events(self) -> int:
        poll = select.poll()
        poll.register(self._ours, select.POLLIN | select.POLLOUT)
        return sum(event for _, event in poll.poll(0))

    def send(self, block: Block) -> None:
        """Queue samples; they are lost while no host is there."""
        if self.attached():
            data = self._faults.spoil(self._wire.encode(block))
            listens = terminal_bit_rate(self._ours) if self._baud else None
            if self._baud and listens and listens != self._baud:
                data = received_bytes(data, self._baud, listens)
            self._out += data

    @property
    def pending(self) -> int:
        """Bytes that the host has not taken yet."""
        return len(self._out)

    def pump(self) -> None:
        """Write what the pty takes; hand what the host says to the wire format."""
        if self._ours < 0:
            return
        events = self._events()
        if events & select.POLLHUP:
            self._forget()
            return
        self._heard = True
        try:
            if events & select.POLLIN:
                self._out += self._wire.answer(os.read(self._ours, HEARD))
            if self._out:
                del self._out[: os.write(self._ours, self._out)]
        except BlockingIOError:
            return
        except OSError as error:
            if not self.attached():
                return
            raise DeviceError(f"the pty {self.port} failed: {error}") from error

    def linger(self, seconds: float) -> None:
        """Wait, at most so long, until the host has read everything."""
        end = monotonic() + seconds
        empty = 0
        while empty < EMPTY_LOOKS and monotonic() < end and self.attached():
            self.pump()
            empty = empty + 1 if not (self._out or self._unread()) else 0
            sleep(LOOK_S)

    def _unread(self) -> int:
        """Bytes that lie in the port."""
        theirs = os.open(self.port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            count = fcntl.ioctl(theirs, termios.FIONREAD, bytes(4))
        finally:
            os.close(theirs)
        return int.from_bytes(count, sys.byteorder)

    def _forget(self) -> None:
        """Drop what the host left unread when it went: a port is opened empty."""
        self._out.clear()
        if self._heard:
            self._heard = False
            forget(self.port)

    def hang_up(self) -> None:
        """Close the pty: the host reads an end of file or an error.

        Its name goes first. The system gives the number of a pty that is gone to the
        next one, and a host that tries the old name again would read a stranger.
        """
        if self._port_link is not None:
            with contextlib.suppress(OSError):
                if os.readlink(self._port_link) == self.port:
                    self._port_link.unlink()
        if self._ours >= 0:
            os.close(self._ours)
            self._ours = -1
            self._out.clear()

    def come_back(self) -> None:
        """Open a pty in raw mode, and point the symbolic link to it."""
        self._ours, self.port = open_pty()
        if self._port_link is not None:
            try:
                _point(self._port_link, self.port)
            except InputError:
                self.hang_up()
                raise

    def close(self) -> None:
        """Close the pty and take the symbolic link away."""
        self.hang_up()


def _point(link: Path, port: str) -> None:
    """Make `link` point to `port`; another symbolic link of that name is replaced."""
    try:
        if link.is_symlink():
            link.unlink()
        link.symlink_to(port)
    except FileExistsError as error:
        raise InputError(
            f"{link} is there already and is no symbolic link: name another"
        ) from error
    except OSError as error:
        raise InputError(f"{link} cannot be made: {error.strerror}") from error
