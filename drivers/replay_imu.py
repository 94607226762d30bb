"""A recording as a device: ``replay:SESSION_OR_LOG?speed=1``.

What can be replayed: a session folder, a samples file (.csv, .csv.gz, .parquet,
.arrows), the bytes of a serial port kept in a file (also .gz), with their ``format``
and its options as in `serial_imu`, or a log of a CAN bus (.log, .asc, .blf, .trc) or of
MAVLink (.tlog), with the options of `can_imu` and `mavlink_imu`, which play it.
``speed`` is device time against the clock, or ``max``. Units of a samples file are
those of its session, m/s^2 and rad/s without one.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError, RecordingEnded
from fieldcal.core.samples import Block, Grain, concat
from fieldcal.drivers import can_log, mavlink_log
from fieldcal.drivers.codec import open_codec
from fieldcal.drivers.driver import Driver, LinkHealth
from fieldcal.drivers.options import Options, split_address
from fieldcal.drivers.playback import PlaybackClock, playback_speed
from fieldcal.evaluation.usable_windows import reported_grain
from fieldcal.session.folder import Session
from fieldcal.session.sample_files import ENDINGS, read_samples

LONGEST_DELIVERY = 0.5
"""Longest stretch delivered at once, s of device time."""

BYTES_AT_ONCE = 1 << 20
"""Bytes of a log decoded at once."""


class ReplayImu(Driver):
    """A recording that is played as if the device were there."""

    def __init__(self, address: str) -> None:
        place, options = split_address(address, "replay")
        bytes_of_a_port = bool(options.text("format"))
        self._player: Driver
        if can_log.is_can_log(place) and not bytes_of_a_port:
            from fieldcal.drivers import can_imu

            self._player = can_imu.CanImu(address)
        elif mavlink_log.is_mavlink_log(place) and not bytes_of_a_port:
            from fieldcal.drivers import mavlink_imu

            self._player = mavlink_imu.MavlinkImu(address)
        else:
            self._player = _ReplayedSamples(address)
        self.name, self.health = self._player.name, self._player.health

    def receive(self, timeout: float) -> Block | None:
        """Return what is due, or None if nothing is within `timeout` seconds.

        Raises
        ------
        RecordingEnded
            At the end of the recording.

        """
        return self._player.receive(timeout)

    def host_time(self) -> float:
        """Now, in s of the clock that stamped the arrivals."""
        return self._player.host_time()

    @property
    def grain(self) -> Grain:
        """What the device rounded to."""
        return self._player.grain

    @property
    def notes(self) -> Mapping[str, Any]:
        """What a log says of the device beside its samples."""
        return self._player.notes

    def close(self) -> None:
        """Let go of the recording."""
        self._player.close()


class _ReplayedSamples(Driver):
    """Samples of a recording, delivered when they are due."""

    def __init__(self, address: str) -> None:
        place, options = split_address(address, "replay")
        played_at = playback_speed(options)
        self.name = place
        self._grain = Grain()
        self._block = self._load(Path(place), options)
        options.finish()
        if not len(self._block):
            raise InputError(f"{place} holds no sample; check format and options")
        self.health = LinkHealth()
        self._next = 0
        self._pace = PlaybackClock(float(self._block.t[0]), played_at)
        self._now = float(self._block.t_host[0])

    def _load(self, place: Path, options: Options) -> Block:
        if place.is_dir():
            session = Session.open(place)
            self._grain = reported_grain(session)
            return session.block
        if place.is_file() and not place.name.endswith(ENDINGS):
            block, self._grain = decode_file(place, options)
            return block
        return load_samples(place)

    @property
    def grain(self) -> Grain:
        """What the device rounded to, as far as the recording says it."""
        return self._grain

    def host_time(self) -> float:
        """Arrival of the last sample, as far as the recording says it."""
        return self._now if self._now == self._now else super().host_time()

    def receive(self, timeout: float) -> Block | None:
        """Return what is due, or None if nothing is within `timeout` seconds.

        Raises
        ------
        RecordingEnded
            At the end of the recording.

        """
        t, i = self._block.t, self._next
        if i == len(t):
            raise RecordingEnded(self.name, float(t[-1] - t[0]))
        until = min(self._pace.wait(float(t[i]), timeout), t[i] + LONGEST_DELIVERY)
        if until < t[i]:
            return None
        end = int(np.searchsorted(t, until, side="right"))
        self._next = end
        self._now = float(self._block.t_host[end - 1])
        self.health.samples += end - i
        return self._block[i:end]

    def close(self) -> None:
        """Let go of the recording."""
        self._next = len(self._block)


def load_samples(place: Path) -> Block:
    """Read the samples of a file.

    Raises
    ------
    InputError
        If there is none, or it cannot be read.

    """
    if not place.is_file():
        raise InputError(f"{place}: there is no such session or log")
    return read_samples(place)[0]


def decode_file(place: Path, options: Options) -> tuple[Block, Grain]:
    """Decode the bytes of a port; the samples, and what their format rounds to.

    Raises
    ------
    InputError
        If nothing says what bytes they are, they cannot be unpacked, or nothing says
        when they were sampled.

    """
    name = options.text("format")
    if not name:
        raise InputError(
            f"{place}: say what bytes these are, such as replay:{place}?format=mip"
        )
    codec = open_codec(name, options)
    opened = gzip.open if place.suffix == ".gz" else open
    blocks = []
    try:
        with opened(place, "rb") as file:
            while data := file.read(BYTES_AT_ONCE):
                blocks.append(codec.feed(data))
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(
            f"{place}: its compression is damaged or cut off ({error}); unpack what is"
            " whole, as by zcat, and replay that"
        ) from error
    found = concat(block for block in blocks if block is not None)
    health = codec.health
    whole = health.received - health.skipped - codec.waiting_bytes
    if not len(found) and 2 * whole > health.received:
        raise InputError(
            f"{place}: its samples have no time of the device: add rate=, in Hz"
        )
    return found, codec.grain
