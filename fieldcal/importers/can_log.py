"""Logs of a CAN bus: candump (.log), Vector .asc and .blf, PEAK .trc; python-can.

``--options "dbc=imu.dbc&map=ax=Accel.X,…"`` says what is in the frames, as in a
device's address, see `can_map`. Where the frames carry no time, that of the bus counts,
as it was logged. A log of several buses, of which more than one has such frames, is of
several IMUs: ``channel=can1`` says which is meant.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, TextIO, cast

import numpy as np

from fieldcal.drivers.options import Options
from fieldcal.errors import InputError
from fieldcal.recording import Recording, Stream, unpacked
from fieldcal.samples import Block

WHAT = "log of a CAN bus"

PIECE = 8192
"""Frames looked at together."""

FEW = 256
"""Messages held at once: of more, the interpreter looks for garbage among them."""


class Kind(NamedTuple):
    """A kind of log: how it begins, and what python-can calls its reader."""

    name: str
    begins: re.Pattern[bytes]
    reader: str


KINDS = (
    Kind("candump", re.compile(rb"\s*\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#"),
         "CanutilsLogReader"),
    Kind("asc", re.compile(rb"\s*(date |base (hex|dec))", re.IGNORECASE), "ASCReader"),
    Kind("blf", re.compile(rb"LOGG"), "BLFReader"),
    Kind("trc", re.compile(rb"\s*;(\$FILEVERSION|#+)"), "TRCReader"),
)  # fmt: skip

PRINTED = re.compile(rb"\s*(\([\d. :-]+\))?\s*\w+\s+[0-9A-Fa-f]+\s+\[\d+\]\s")
"""A line as candump shows it on a terminal."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like a log."""
    return any(p.match(head) for p in (*(kind.begins for kind in KINDS), PRINTED))


class File(Recording):
    """A log of a bus."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("can", "cantools"), "can"

    def streams(self) -> list[Stream]:
        """Return the one IMU that the map describes."""
        with unpacked(self.path) as file:
            if PRINTED.match(file.read(256)):
                raise InputError(
                    f"{self.path}: is what candump prints; record with candump -l"
                )
        options = Options("options", self.wanted.options)
        names = [part.name for part in self._parts(options)]
        return [Stream("0", f"frames {', '.join(names)}, units of the dbc")]

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
        from fieldcal.drivers.can_frames import EXTENDED, FRAME
        from fieldcal.drivers.can_groups import CanHealth
        from fieldcal.drivers.can_stamped import Stamped

        options, health = Options("options", self.wanted.options), CanHealth()
        parts, channel = self._parts(options), options.text("channel")
        samples = Stamped(parts, health, options)
        options.finish()
        wanted = {part.identifier & ~EXTENDED for part in parts}
        for rows in self._rows(wanted, channel):
            frames = np.frombuffer(b"".join(rows), FRAME)
            block = samples.feed(frames, frames["t"])
            if block is not None:
                yield block
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

    def _rows(self, wanted: set[int], channel: str) -> Iterator[list[bytes]]:
        """Frames of one bus as rows, many at a time.

        Raises
        ------
        InputError
            If those `wanted` come from several buses, and none is chosen.

        """
        from fieldcal.drivers.can_frames import pack_message

        messages, seen = self._messages(), 0
        buses: set[Any] = set()
        rows: list[bytes] = []
        while some := self._some(messages, seen):
            seen += len(some)
            if {m.channel for m in some} - buses:
                buses |= {m.channel for m in some if m.arbitration_id in wanted}
            if channel:
                some = [m for m in some if str(m.channel) == channel]
            elif len(buses) > 1:
                names = sorted(map(str, buses))
                raise InputError(
                    f"{self.path}: frames of the map come from the buses"
                    f" {', '.join(names)}: choose one in --options, such as"
                    f" channel={names[-1]}"
                )
            rows += [pack_message(message) for message in some]
            if len(rows) >= PIECE:
                yield rows
                rows = []
        names = sorted(map(str, buses))
        if channel and channel not in names:
            raise InputError(
                f"{self.path}: no frame of the map comes from {channel}, but from"
                f" {', '.join(names) or 'no bus'}: mend channel in --options"
            )
        if rows:
            yield rows

    def _some(self, messages: Iterator[Any], seen: int) -> list[Any]:
        """The frames that follow those `seen`."""
        try:
            return list(islice(messages, FEW))
        except InputError:
            raise
        except Exception as error:
            # the readers of the several formats raise what they like
            raise InputError(
                f"{self.path}: cannot be read behind frame {seen}: {error}; copy it"
                " again from where it came"
            ) from error

    def _messages(self) -> Iterator[Any]:
        import can

        with unpacked(self.path) as file:
            head = file.read(256)
            kind = next(k for k in KINDS if k.begins.match(head))
            file.seek(0)
            if kind.name == "blf":
                with can.BLFReader(cast(BinaryIO, file)) as reader:
                    yield from reader
                return
            text = io.TextIOWrapper(file, encoding="utf-8", errors="replace")
            if kind.name == "candump":
                yield from _candump(self, text)
                return
            with getattr(can, kind.reader)(text) as reader:
                yield from reader


def _candump(recording: File, text: io.TextIOWrapper) -> Iterator[Any]:
    """Frames of a candump log; a line that is none is named."""
    import can

    lines = _Lines(text)
    while True:
        with can.CanutilsLogReader(cast(TextIO, lines)) as reader:
            try:
                yield from reader
                return
            except (ValueError, IndexError, AttributeError, TypeError) as error:
                recording.damaged(f"line {lines.number}", f"is no frame ({error})")


class _Lines:
    """Lines of a text that are counted."""

    def __init__(self, text: io.TextIOWrapper) -> None:
        self._text, self.number = text, 0

    def __iter__(self) -> Iterator[str]:
        while line := self._text.readline():
            self.number += 1
            yield line

    def read(self, size: int = -1) -> str:
        """Give a part of the text."""
        return self._text.read(size)

    def close(self) -> None:
        """Stay open: reading goes on behind a line that is none."""
