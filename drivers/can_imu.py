"""An IMU on a CAN bus: ``can:can0?dbc=imu.dbc&map=ax=Frame.Signal,ay=Frame.Other``.

Options: ``interface`` (any of python-can's; socketcan), ``bitrate``, ``data_bitrate``,
``fd=1``, ``port`` (udp_multicast), ``tty_baudrate`` and ``settle`` (slcan: what the
adapter needs after its port is opened, s), ``reconnect`` as for a serial port; ``dbc``,
``map`` and the units as in `can_map`; ``first``, ``within`` and ``rate`` as in
`can_samples`. A log (.log, .asc, .blf) in place of the channel is played, with
``speed`` as device time against the clock, or ``max``, and ``channel`` where the frames
are on several buses of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from time import monotonic

import numpy as np

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Array, Block, Grain, concat
from fieldcal.drivers.can_bus_filter import BusFilter
from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_frames import EXTENDED_FLAG, FRAME_DTYPE, Frames
from fieldcal.drivers.can_log import PlayedCanLog, is_can_log
from fieldcal.drivers.clock_comparison import ClockComparison
from fieldcal.drivers.driver import Driver, LinkHealth
from fieldcal.drivers.options import split_address
from fieldcal.drivers.playback import playback_speed
from fieldcal.drivers.reader import Reader

STRANGE_FRAMES_KEPT = 10_000
"""Strange frames after which no more identifiers are kept."""

MOST_WAITING_BYTES = 1 << 24
"""Most bytes of rows that wait: a minute of a device at 1 kHz."""


class CanImu(Driver):
    """A CAN bus, or a log of one, and the samples that are in its frames."""

    def __init__(self, address: str) -> None:
        _check_installed()
        from fieldcal.drivers.can_bus import bus_settings, open_source
        from fieldcal.drivers.can_map import read_map
        from fieldcal.drivers.can_samples import CanAssembler

        channel, options = split_address(address, "can")
        if not channel:
            raise InputError("can: name a channel, such as can:can0, or a log")
        self.name = channel
        self._counts = CanLinkHealth()
        self.health: LinkHealth = self._counts
        self._parts = read_map(options)
        self._samples = CanAssembler(self._parts, self._counts, options)
        self._heard: set[int] = set()
        self._skew = ClockComparison(self._counts)
        self._log: PlayedCanLog | None = None
        self._reader: Reader | None = None
        if is_can_log(channel):
            wanted = (part.identifier for part in self._parts)
            buses = BusFilter(channel, wanted, options.text("channel"))
            pace = playback_speed(options)
            options.finish()
            self._log = PlayedCanLog(Path(channel), buses, pace)
            return
        told = bus_settings(options)
        patience = options.number("reconnect", 10.0, 0.0, 86400.0)
        options.finish()
        self._reader = Reader(
            channel,
            lambda: open_source(channel, told, self._counts),
            patience,
            MOST_WAITING_BYTES,
        )

    @property
    def reconnecting(self) -> bool:
        """True while the bus is gone and is being tried again."""
        return self._reader is not None and self._reader.reconnecting

    @property
    def grain(self) -> Grain:
        """One count of the signals."""
        return self._samples.grain

    def host_time(self) -> float:
        """Now, in s of the clock that stamps `Block.t_host`: for a log, its own."""
        return self._log.now if self._log else super().host_time()

    def receive(self, timeout: float) -> Block | None:
        """Return what has come, or None if nothing whole came in `timeout` seconds."""
        deadline = monotonic() + timeout
        while True:
            blocks = []
            for frames, arrived, broken in self._take(max(0.0, deadline - monotonic())):
                if broken:
                    self._samples.reset()
                if self._counts.strange < STRANGE_FRAMES_KEPT:
                    self._heard.update(frames["id"].tolist())
                blocks.append(self._samples.feed(frames, arrived))
            block = concat(block for block in blocks if block is not None)
            if len(block):
                self._skew.add(block.t, block.t_host)
                return block
            if monotonic() >= deadline:
                return None

    def close(self) -> None:
        """Leave the bus, or the log; safe to call twice."""
        if self._reader:
            self._reader.close()
        if self._log:
            self._log.close()

    def _take(self, timeout: float) -> Iterator[tuple[Frames, Array, bool]]:
        """Frames, their arrivals, and whether the link was away before them."""
        if self._log:
            frames = self._next(self._log, timeout)
            self.health.received += frames.nbytes
            yield frames, frames["t"], False
        if self._reader:
            chunks = self._reader.take(timeout)
            cuts = [i for i, chunk in enumerate(chunks) if chunk.broken]
            for start, end in pairwise([0, *cuts, len(chunks)]):
                some = chunks[start:end]
                frames = np.frombuffer(
                    b"".join(chunk.data for chunk in some), FRAME_DTYPE
                )
                many = [len(chunk.data) // FRAME_DTYPE.itemsize for chunk in some]
                arrived = np.repeat([chunk.t_host for chunk in some], many)
                self.health.received += frames.nbytes
                yield frames, arrived, bool(some) and some[0].broken

    def _next(self, log: PlayedCanLog, timeout: float) -> Frames:
        """Return frames of the log; what is wrong if it ends without a sample."""
        try:
            return log.take(timeout)
        except DeviceError as end:
            if self._counts.samples:
                raise
            raise DeviceError(f"{end} without a sample: {self._missing()}") from end

    def _silence(self, timeout: float, before: LinkHealth) -> str:
        health = self._counts
        if health.errors and not health.samples and not health.strange:
            cause = "only error frames come; check bit rate, wiring and termination"
        elif health.received == before.received and health.bad > before.bad:
            cause = "lines come that are no frames; check tty_baudrate and the adapter"
        elif health.received == before.received:
            cause = "not a frame came; check wiring, power and bit rate"
        else:
            cause = self._missing()
        sent = "went silent" if health.samples else "has sent no sample"
        return f"{self.name} {sent} for {timeout:g} s: {cause}"

    def _missing(self) -> str:
        """Name the frames that a sample needs and that have never come."""
        missing = [p for p in self._parts if p.identifier not in self._heard]
        if not missing:
            return "frames come, but no whole sample; check map, first and within"
        names = ", ".join(f"{p.name} ({_hex(p.identifier)})" for p in missing)
        others = self._heard - {p.identifier for p in self._parts}
        heard = ", ".join(_hex(i) for i in sorted(others)[:8]) or "nothing else"
        return f"frames come, but no {names}; heard: {heard}; check dbc and map"


def _hex(identifier: int) -> str:
    wide = identifier & EXTENDED_FLAG
    return f"0x{identifier & ~EXTENDED_FLAG:0{8 if wide else 3}X}"


def _check_installed() -> None:
    if not all(find_spec(module) for module in ("can", "cantools")):
        raise InputError(
            "CAN needs python-can and cantools: pip install 'fieldcal[can]'"
        )
