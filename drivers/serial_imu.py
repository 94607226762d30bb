"""An IMU on a serial port: ``serial:/dev/ttyUSB0?format=witmotion&baud=115200``.

Options: ``format`` (a file of protocols/), ``baud``, ``reconnect`` (how long to try
again after a hang-up, s; 0 for not at all), and those of the format. The port may also
be a pty, ``socket://192.168.1.5:4001``, or any other URL that pyserial knows.
"""

from __future__ import annotations

import errno
from collections.abc import Sequence
from time import monotonic
from typing import ClassVar

import serial

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Block, Grain
from fieldcal.drivers.clock_comparison import ClockComparison
from fieldcal.drivers.codec import open_codec, recognise_format
from fieldcal.drivers.column_guess import describe_lines
from fieldcal.drivers.driver import Driver
from fieldcal.drivers.mavlink_detection import detect_autopilot
from fieldcal.drivers.options import split_address
from fieldcal.drivers.reader import Chunk, Reader
from fieldcal.drivers.tcp import POLL_TIME, TcpLink

SOCKET_PREFIX = "socket://"

RECENT_BYTES = 1 << 14
"""Bytes kept to tell what it is that comes, if it is not the format."""

PORT_ERRORS = {
    errno.ENOENT: "there is no such port; plug it in, or see `fieldcal ports`",
    errno.ENXIO: "nothing is plugged in there; see `fieldcal ports`",
    errno.ENODEV: "nothing is plugged in there; see `fieldcal ports`",
    errno.EIO: "the other end has hung up; start the device first",
    errno.EACCES: "no permission; add yourself to the group that owns it (dialout)",
    errno.EPERM: "no permission; add yourself to the group that owns it (dialout)",
    errno.EBUSY: "another program has it open; close that first",
    errno.EAGAIN: "another program has it open; close that first",
    errno.ENOTTY: "this is no serial port; see `fieldcal ports`",
    errno.EISDIR: "this is no serial port; see `fieldcal ports`",
}


class _UnflushedPort(serial.Serial):  # type: ignore[misc]
    """A port that keeps what came while it was being opened."""

    def _reset_input_buffer(self) -> None:
        """A device that speaks at once would lose its first words."""


class SerialPort:
    """Bytes of a port, as a reader wants them.

    Raises
    ------
    DeviceError
        If the port cannot be opened.

    """

    def __init__(self, port: str, baud: int) -> None:
        try:
            if "://" in port:
                self._serial = serial.serial_for_url(port, baud, timeout=POLL_TIME)
            else:
                self._serial = _UnflushedPort(
                    port, baud, timeout=POLL_TIME, exclusive=True
                )
        except ValueError as fault:
            raise InputError(f"cannot open {port} at {baud} baud: {fault}") from fault
        except Exception as fault:
            # not only OSError: pyserial lets termios.error through
            raise DeviceError(
                f"cannot open {port}: {port_error_text(fault)}"
            ) from fault

    def read(self) -> bytes:
        """Return all that is there, waiting `POLL_TIME` seconds for the first byte."""
        data: bytes = self._serial.read(max(1, self._serial.in_waiting))
        return data

    def write(self, data: bytes) -> None:
        """Send."""
        self._serial.write(data)

    def close(self) -> None:
        """Release the port."""
        self._serial.close()


def open_port(port: str, baud: int) -> SerialPort | TcpLink:
    """Open a port, or ``socket://HOST:PORT``; errors as of these.

    pyserial reads a socket byte by byte, and forgets the last ones when it closes.
    """
    if not port.startswith(SOCKET_PREFIX):
        return SerialPort(port, baud)
    host, _, number = port.removeprefix(SOCKET_PREFIX).rstrip("/").rpartition(":")
    if not host or not number.isdecimal() or not 0 < int(number) < 65536:
        raise InputError(f"{port} needs host and port, as in socket://192.168.1.5:4001")
    return TcpLink((host, int(number)))


class SerialImu(Driver):
    """A serial port and the codec of what comes from it."""

    faults: ClassVar[tuple[type[Exception], ...]] = (OSError,)

    def __init__(self, address: str) -> None:
        port, options = split_address(address, "serial")
        if not port:
            raise InputError("serial: name a port, such as serial:/dev/ttyUSB0")
        self.name = port
        self._format = options.text("format", "witmotion")
        self._codec = open_codec(self._format, options)
        self._heard: list[Chunk] = []
        self.health = self._codec.health
        self._skew = ClockComparison(self.health)
        baud = int(options.number("baud", self._codec.bauds[0], 50, 1e8))
        self._baud = baud
        patience = options.number("reconnect", 10.0, 0.0, 86400.0)
        options.finish()
        self._reader = Reader(port, lambda: open_port(port, baud), patience)

    @property
    def reconnecting(self) -> bool:
        """True while the port is gone and is being tried again."""
        return self._reader.reconnecting

    @property
    def grain(self) -> Grain:
        """What the wire format rounds to."""
        return self._codec.grain

    def receive(self, timeout: float) -> Block | None:
        """Return what has come, or None if nothing whole came in `timeout` seconds."""
        deadline = monotonic() + timeout
        while True:
            chunks = self._reader.take(max(0.0, deadline - monotonic()))
            block = self._codec.feed_all(chunks)
            if block is not None:
                self._heard = []
                self._skew.add(block.t, block.t_host)
                return block
            self._heard = last_chunks([*self._heard, *chunks])
            if monotonic() >= deadline:
                return None

    def close(self) -> None:
        """Release the port; safe to call twice."""
        self._reader.close()

    def _incomplete(self) -> str:
        data = b"".join(chunk.data for chunk in self._heard)
        lines = describe_lines(data) if self._format == "text" else ""
        return lines or super()._incomplete()

    def _garbage(self) -> str:
        data = b"".join(chunk.data for chunk in self._heard)
        known = recognise_format(data, self._heard[-1].t_host - self._heard[0].t_host)
        if known is None and (heard := detect_autopilot(data)):
            query = f"&{heard.query}" if heard.query else ""
            return (
                f"these are no {self._format} bytes but an autopilot's; try "
                f"mavlink:{self.name}?baud={self._baud}{query}"
            )
        if known is None:
            return describe_lines(data) or (
                "bytes come, but no format that is known; check the baud rate and"
                f" the port, or ask `fieldcal ports --probe {self.name}`"
            )
        name, like = known
        query = f"&{like.query}" if like.query else ""
        same = name == self._format
        said = (
            f"this is {name} with other options"
            if same
            else (f"these are no {self._format} bytes")
        )
        return f"{said}; try format={name}{query}"


def last_chunks(chunks: Sequence[Chunk]) -> list[Chunk]:
    """Return the last chunks: as few as hold `RECENT_BYTES` bytes, or all.

    What comes is judged by how many bytes came in which time, and a link that floods
    with noise must not fill the memory.
    """
    kept: list[Chunk] = []
    size = 0
    for chunk in reversed(chunks):
        if size >= RECENT_BYTES:
            break
        kept.append(chunk)
        size += len(chunk.data)
    return kept[::-1]


def port_error_text(fault: BaseException) -> str:
    """Say why a port did not open, and what to do."""
    link: BaseException | None = fault
    while link is not None:
        number = link.args[0] if link.args else None
        if isinstance(number, int) and number in PORT_ERRORS:
            return PORT_ERRORS[number]
        link = link.__context__
    return str(fault)
