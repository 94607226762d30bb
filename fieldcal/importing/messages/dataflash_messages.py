"""Messages of an ArduPilot dataflash log (.bin).

A message is A3 95, a byte for its kind, and fields as the FMT messages say; their
letters are pymavlink's table. Data are gathered message by message and looked at as
rows. Source: ArduPilot's log format.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.importing.words.sensor_words import AXES

MARK = b"\xa3\x95"
FMT = 128
FMT_SIZE = 89

INSTANCES = {"IMU": 0, "IMU2": 1, "IMU3": 2}
"""Messages with samples; IMU says itself of which sensor, in logs since 2020."""

HEAD, BODY = "ISBH", "ISBD"
"""Messages of batches of samples: what they are, and the samples."""

PART_SAMPLES = 32
"""Samples of a part of a batch."""

SIX = {f"{kind}{axis}" for kind in ("Acc", "Gyr") for axis in "XYZ"}

NEEDED = {
    "PARM": {"Name", "Value"},
    **dict.fromkeys(INSTANCES, SIX),
    HEAD: {"N", "type", "instance", "mul", "smp_cnt", "SampleUS", "smp_rate"},
    BODY: {"N", "seqno", *AXES},
}
"""Columns that a message must have, by its name."""


class Format(NamedTuple):
    """A kind of message: its bytes, and its fields as they stand behind the mark."""

    name: str
    size: int
    layout: np.dtype[Any]
    factors: dict[str, float]


Tables = dict[str, NDArray[np.void]]


class DataflashMessages:
    """A log that is walked through from its beginning, as often as is wanted.

    Parameters
    ----------
    damaged : called with a damaged place and its fault; may raise
    pieces : gives its bytes from the beginning, each time anew

    Attributes
    ----------
    cut : where the log ends within a message, byte; None if it does not

    """

    def __init__(
        self,
        damaged: Callable[[str, str], None],
        pieces: Callable[[], Iterator[bytes]],
    ) -> None:
        self._damaged, self._pieces = damaged, pieces
        self._formats: dict[int, Format] = {}
        self._by_name: dict[str, Format] = {}
        self.cut: int | None = None

    def factor(self, name: str, column: str) -> float:
        """SI units, or what stands for them, in one of a column."""
        return self._by_name[name].factors[column]

    def tables(self, wanted: set[str], scan: bool = False) -> Iterator[Tables]:
        """Rows of the wanted messages, a piece of the log at a time.

        Parameters
        ----------
        wanted : names
        scan : whether this is the first time; definitions and damages are noted then

        """
        rest, base = b"", 0
        for piece in self._pieces():
            data = rest + piece
            found, at = self._walk(data, base, scan)
            rest, base = data[at:], base + at
            array = np.frombuffer(data, np.uint8)
            out = {}
            for kind, starts in found.items():
                form = self._formats[kind]
                if form.name in wanted and starts:
                    view = np.lib.stride_tricks.sliding_window_view(array, form.size)
                    out[form.name] = view[np.array(starts)].view(form.layout)[:, 0]
            if out:
                yield out
        if scan and rest:
            self.cut = base

    def _walk(
        self, data: bytes, base: int, scan: bool
    ) -> tuple[dict[int, list[int]], int]:
        """Where messages begin, by kind, and where the next one does."""
        found: dict[int, list[int]] = {}
        sizes = {kind: form.size for kind, form in self._formats.items()}
        at, size = 0, len(data)
        while at + 3 <= size:
            kind = data[at + 2]
            length = FMT_SIZE if kind == FMT else sizes.get(kind, 0)
            if data[at] != 0xA3 or data[at + 1] != 0x95 or not length:
                if data[at] in (0, 0xFF) and data.count(data[at], at) == size - at:
                    # blocks of flash that were never written
                    return found, size
                if scan:
                    self._damaged(f"byte {base + at}", "is no message of a log")
                at = data.find(MARK, at + 1)
                if at < 0:
                    return found, size
                continue
            if at + length > size:
                break
            if kind == FMT:
                if scan:
                    self._define(data[at : at + length], base + at)
                    sizes = {k: form.size for k, form in self._formats.items()}
            elif kind in found:
                found[kind].append(at)
            else:
                found[kind] = [at]
            at += length
        return found, at

    def _define(self, message: bytes, at: int) -> None:
        """Keep what a FMT message says."""
        from pymavlink.DFReader import FORMAT_TO_STRUCT

        kind, size = message[3], message[4]
        texts = (message[5:9], message[9:25], message[25:89])
        name, letters, labels = (
            text.split(b"\0")[0].decode("ascii", "replace") for text in texts
        )
        columns = labels.split(",")
        layout, factors = [("mark", "V3")], {}
        try:
            for column, letter in zip(columns, letters, strict=True):
                code, factor, _ = FORMAT_TO_STRUCT[letter]
                layout.append((column, "32<i2" if letter == "a" else _numpy(code)))
                factors[column] = factor or 1.0
            form = Format(name, size, np.dtype(layout), factors)
        except (KeyError, ValueError, TypeError):
            form = Format("", size, np.dtype("u1"), {})
        there = set(form.layout.names or ())
        needed = NEEDED.get(name, set())
        fits = form.layout.itemsize == size and there >= needed
        fits = fits and all(
            _fits(form.layout[n], name, n) for n in there & {*NUMBERS, *needed}
        )
        if name in INSTANCES:
            fits = fits and bool(there & {"TimeUS", "TimeMS"})
        if needed and not fits:
            self._damaged(f"byte {at}", f"defines {name} in a way that does not fit")
            return
        if size > 3 and self._formats.setdefault(kind, form).size == size:
            self._by_name.setdefault(name, form)


def _fits(kind: np.dtype[Any], message: str, column: str) -> bool:
    """Whether a column of a message holds what its name says."""
    if message == BODY and column in AXES:
        return kind.shape == (PART_SAMPLES,)
    return kind.kind in ("S" if column == "Name" else "iuf")


def _numpy(code: str) -> str:
    """Return numpy's name of a field of `struct`."""
    return f"S{code[:-1]}" if code.endswith("s") else f"<{_CODES[code]}"


NUMBERS = ("TimeUS", "TimeMS", "T", "Temp", "I")
"""Columns that are read besides those that are needed."""

_CODES = {
    "b": "i1", "B": "u1", "h": "i2", "H": "u2", "i": "i4", "I": "u4", "q": "i8",
    "Q": "u8", "e": "f2", "f": "f4", "d": "f8",
}  # fmt: skip
