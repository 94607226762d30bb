"""Logs of a CAN bus: candump (.log), Vector .asc and .blf, PEAK .trc; python-can.

Lines of canboat, for a bus of NMEA 2000, hold frames as well.

``--options "dbc=imu.dbc&map=ax=Accel.X,…"`` says what is in the frames, as in a
device's address, see `can_map`. Where the frames carry no time, that of the bus counts,
as it was logged. A log of several buses, of which more than one has such frames, is of
several IMUs: ``channel=can1`` says which is meant.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, TextIO, cast

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.drivers.options import Options
from fieldcal.importing.files.packed_stream import first_bytes, open_unpacked
from fieldcal.importing.recording import ImuStream, Recording
from fieldcal.importing.times.clock_text import ClockText

if TYPE_CHECKING:
    from fieldcal.drivers.can_bus_filter import BusFilter
    from fieldcal.drivers.can_frames import FrameBuffer

WHAT = "log of a CAN bus"

PIECE = 8192
"""Frames looked at together."""


class CanLogKind(NamedTuple):
    """A kind of log: its first bytes, and the name of its reader in python-can."""

    name: str
    begins: re.Pattern[bytes]
    reader: str


KINDS = (
    CanLogKind(
        "candump",
        re.compile(rb"\s*\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#"),
        "CanutilsLogReader",
    ),
    CanLogKind(
        "asc",
        re.compile(rb"\s*(date [^\n]*\d{4}|base (hex|dec))", re.IGNORECASE),
        "ASCReader",
    ),
    CanLogKind(
        "canboat",
        re.compile(
            rb"\s*\d{4}-\d\d-\d\d[T-]\d\d:\d\d:\d\d[.,]\d+Z?,[0-7],\d+,\d+,\d+,\d+,"
            rb"[0-9A-Fa-f]{2}"
        ),
        "",
    ),
    CanLogKind("blf", re.compile(rb"LOGG"), "BLFReader"),
    CanLogKind("trc", re.compile(rb"\s*;(\$FILEVERSION|#+)"), "TRCReader"),
)

BROADCAST = 240
"""First group of SAE J1939 that goes to all."""

MAX_FRAME_BYTES = 8
"""Bytes of a frame; canboat joins those of longer messages, which are no frames."""

PRINTED = re.compile(rb"\s*(\([\d. :-]+\))?\s*\w+\s+[0-9A-Fa-f]+\s+\[\d+\]\s")
"""A line as candump shows it on a terminal."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like a log."""
    return any(p.match(head) for p in (*(kind.begins for kind in KINDS), PRINTED))


class CanLog(Recording):
    """A log of a bus."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("can", "cantools"), "can"

    def streams(self) -> list[ImuStream]:
        """Return the one IMU that the map describes."""
        if PRINTED.match(first_bytes(self.path)):
            raise InputError(
                f"{self.path}: is what candump prints; record with candump -l"
            )
        options = Options("options", self.wanted.options)
        names = [part.name for part in self._parts(options)]
        return [ImuStream("0", f"frames {', '.join(names)}, units of the dbc")]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return how the frames were read."""
        return {"options": self.wanted.options}

    def _parts(self, options: Options) -> list[Any]:
        from fieldcal.drivers.can_map import read_map

        if not options.text("dbc"):
            raise InputError(
                f"{self.path}: say what is in the frames, such as --options "
                '"dbc=imu.dbc&map=ax=Accel.X,ay=Accel.Y,az=Accel.Z"'
            )
        return read_map(options)

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples, some frames at a time."""
        from fieldcal.drivers.can_bus_filter import BusFilter
        from fieldcal.drivers.can_bus_time import BusTimeAssembler
        from fieldcal.drivers.can_frame_groups import CanLinkHealth

        options, health = Options("options", self.wanted.options), CanLinkHealth()
        parts = self._parts(options)
        wanted = (part.identifier for part in parts)
        buses = BusFilter(str(self.path), wanted, options.text("channel"))
        samples = BusTimeAssembler(parts, health, options)
        options.finish()
        for packed in self._packed(buses):
            frames = buses.frames(packed)
            timed = np.isfinite(frames["t"])
            if not timed.all():
                self.damaged(f"{(~timed).sum()} of its frames", "without a time")
                frames = frames[timed]
            block = samples.feed(frames, frames["t"])
            if block is not None:
                yield block
        buses.finish()
        if not health.samples:
            raise InputError(
                f"{self.path}: not one whole sample is in it, of {health.strange} other"
                " frames; check dbc, map and first"
            )
        counts = {
            "samples that lack a frame": health.incomplete,
            "frames that are too short or say that nothing was measured": health.bad,
            "error frames": health.errors,
        }
        if found := [f"{what} ({n})" for what, n in counts.items() if n]:
            self.says.append(f"left out: {', '.join(found)}")

    def _packed(self, buses: BusFilter) -> Iterator[FrameBuffer]:
        """Frames as rows, many at a time."""
        from fieldcal.drivers.can_frames import FrameBuffer

        messages, seen, more = self._messages(), 0, True
        while more:
            packed = FrameBuffer(PIECE)
            try:
                buses.fill(packed, messages)
            except InputError:
                raise
            except Exception as error:
                # the readers of the several formats raise what they like
                where = f"behind frame {seen + packed.messages_seen}"
                self.cut_off(where, f"cannot be read: {error}")
            seen, more = seen + packed.messages_seen, packed.full
            yield packed

    def _messages(self) -> Iterator[Any]:
        import can

        first = first_bytes(self.path)
        kind = next(k for k in KINDS if k.begins.match(first))
        with open_unpacked(self.path, self.cut_off) as file:
            if kind.name == "blf":
                with can.BLFReader(cast(BinaryIO, file)) as reader:
                    yield from reader
                return
            text = io.TextIOWrapper(file, encoding="utf-8", errors="replace")
            if kind.name in ("candump", "canboat"):
                yield from (_candump if kind.name == "candump" else _canboat)(
                    self, text
                )
                return
            with getattr(can, kind.reader)(text) as reader:
                yield from reader


def _candump(recording: CanLog, text: io.TextIOWrapper) -> Iterator[Any]:
    """Frames of a candump log; a line that is none is named."""
    import can

    lines = _Lines(text, recording)
    while True:
        with can.CanutilsLogReader(cast(TextIO, lines)) as reader:
            try:
                yield from reader
                return
            except (ValueError, IndexError, AttributeError, TypeError) as error:
                recording.damaged(f"line {lines.number}", f"is no frame ({error})")


def _canboat(recording: CanLog, text: io.TextIOWrapper) -> Iterator[Any]:
    """Frames of a bus of NMEA 2000 as canboat writes them.

    Time, priority, group (PGN), source, destination, length, and the bytes; the
    identifier is put together as SAE J1939-21 says.
    """
    import can

    lines, clock = _Lines(text, recording), ClockText()
    for line in lines:
        cells = line.strip().split(",")
        try:
            since = clock.seconds(f"{cells[0][:10]} {cells[0][11:]}")
            priority, group, source, destination, many = map(int, cells[1:6])
            data = bytes(int(cell, 16) for cell in cells[6:])
            if since is None or len(data) != many:
                raise ValueError(line[:40])
        except ValueError:
            if line.strip():
                recording.damaged(f"line {lines.number}", "is no frame of canboat")
            continue
        # a group that goes to one device has its address in place of the last byte
        to_one = (group >> 8) & 0xFF < BROADCAST
        last = destination if to_one else 0
        identifier = priority << 26 | (group | last) << 8 | source
        if many <= MAX_FRAME_BYTES:
            yield can.Message(since, identifier, is_extended_id=True, data=data)


class _Lines:
    """Counts the lines of a text and leaves out a truncated last line."""

    def __init__(self, text: io.TextIOWrapper, recording: CanLog) -> None:
        self._text, self._recording, self.number = text, recording, 0

    def __iter__(self) -> Iterator[str]:
        while line := self._text.readline():
            self.number += 1
            if line.endswith("\n") or not self._recording.ends_early:
                yield line

    def read(self, size: int = -1) -> str:
        """Give a part of the text."""
        return self._text.read(size)

    def close(self) -> None:
        """Stay open: reading goes on behind a line that is none."""
