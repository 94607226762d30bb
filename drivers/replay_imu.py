"""A recording as a device: ``replay:SESSION_OR_LOG?speed=1``.

What can be replayed: a session folder, a samples file (.csv, .csv.gz, .parquet,
.arrows), or the bytes of a serial port kept in a file (also .gz), with their ``format``
and its options as in `serial_imu`. ``speed`` is device time against the clock, or
``max``. Units of a samples file are those of its session, m/s^2 and rad/s without one.
"""

from __future__ import annotations

import gzip
from math import inf
from pathlib import Path
from time import monotonic, sleep

import numpy as np

from fieldcal.driver import Driver, Health
from fieldcal.drivers.codec import open_codec
from fieldcal.drivers.options import Options, split
from fieldcal.errors import DeviceError, InputError
from fieldcal.sample_files import ENDINGS, read
from fieldcal.samples import Block, concat
from fieldcal.session import Session

PIECE = 0.5
"""Longest stretch delivered at once, s of device time."""

CUT = 1 << 20
"""Bytes of a log decoded at once."""


class Imu(Driver):
    """Samples of a recording, delivered when they are due."""

    def __init__(self, address: str) -> None:
        place, options = split(address, "replay")
        speed = options.text("speed", "1")
        if speed != "max":
            speed = str(options.number("speed", 1.0, 1e-3, 1e6))
        self._speed = inf if speed == "max" else float(speed)
        self.name = place
        self._block = load(Path(place), options)
        options.finish()
        if not len(self._block):
            raise InputError(f"{place} holds no sample; check format and options")
        self.health = Health()
        self._next, self._began = 0, -1.0

    def receive(self, timeout: float) -> Block | None:
        """Return what is due, or None if nothing is within `timeout` seconds.

        Raises
        ------
        DeviceError
            At the end of the recording.

        """
        t, i = self._block.t, self._next
        if i == len(t):
            raise DeviceError(f"{self.name} has ended after {t[-1] - t[0]:.3f} s")
        if self._began < 0:
            self._began = monotonic()
        wait = self._began + (t[i] - t[0]) / self._speed - monotonic()
        if wait > timeout:
            sleep(timeout)
            return None
        sleep(max(0.0, wait))
        now = t[0] + (monotonic() - self._began) * self._speed
        until = min(now, t[i] + PIECE)
        end = max(i + 1, int(np.searchsorted(t, until, side="right")))
        self._next = end
        self.health.samples += end - i
        return self._block[i:end]

    def close(self) -> None:
        """Let go of the recording."""
        self._next = len(self._block)


def load(place: Path, options: Options) -> Block:
    """Read all samples of a recording.

    Raises
    ------
    InputError
        If there is none, or nothing says what it is.

    """
    if place.is_dir():
        return Session.open(place).block
    if not place.is_file():
        raise InputError(f"{place}: there is no such session or log")
    if place.name.endswith(ENDINGS):
        return read(place)[0]
    name = options.text("format")
    if not name:
        raise InputError(
            f"{place}: say what bytes these are, such as replay:{place}?format=mip"
        )
    codec = open_codec(name, options)
    opened = gzip.open if place.suffix == ".gz" else open
    blocks = []
    with opened(place, "rb") as file:
        while data := file.read(CUT):
            blocks.append(codec.feed(data))
    return concat(block for block in blocks if block is not None)
