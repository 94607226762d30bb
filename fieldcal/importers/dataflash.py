"""ArduPilot dataflash logs (.bin): messages IMU, IMU2, IMU3.

What is in them is calibrated and turned into the body's frame: INS_ACCOFFS,
INS_ACCSCAL and INS_GYROFFS are taken out, and come along from the PARM messages. A
message is A3 95, a byte for its type, and fields as the FMT messages say; their letters
are pymavlink's table. Source: ArduPilot's log format.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.drivers.mavlink_installed import ARDUPILOT, Installed, names
from fieldcal.errors import InputError
from fieldcal.recording import Recording, Stream, pieces
from fieldcal.samples import Array, Block

WHAT = "ArduPilot dataflash log, .bin"

MARK = b"\xa3\x95"
FMT = 128
FMT_SIZE = 89

INSTANCES = {"IMU": 0, "IMU2": 1, "IMU3": 2}
"""Messages with samples; IMU says itself of which sensor, in logs since 2020."""


SIX = {f"{kind}{axis}" for kind in ("Acc", "Gyr") for axis in "XYZ"}


class Format(NamedTuple):
    """A kind of message: its bytes, and its fields as they stand behind the mark."""

    name: str
    size: int
    layout: np.dtype[Any]
    factors: dict[str, float]


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins with a definition of a message."""
    return head.startswith(MARK + bytes((FMT,)))


class File(Recording):
    """A dataflash log."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("pymavlink",), "mavlink"

    def streams(self) -> list[Stream]:
        """Sensors that have samples in the log."""
        self._scan()
        if not self._sensors:
            raise InputError(
                f"{self.path}: has no IMU message; set LOG_BITMASK to log the IMU, and"
                " record again"
            )
        says = "m/s^2, rad/s, calibrated, body's frame"
        return [Stream(f"IMU.{n}", says) for n in sorted(self._sensors)]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return what the autopilot had installed while it logged."""
        self._scan()
        number = int(stream.rpartition(".")[2])
        wanted = [n for some in names(ARDUPILOT, number).values() for n in some]
        values = {n: self._params[n] for n in wanted if n in self._params}
        installed = Installed(ARDUPILOT, number, values)
        return {
            "message": "IMU",
            "instance": number,
            "acc_unit": "m/s^2",
            "gyr_unit": "rad/s",
            "installed": installed.as_table() if values else None,
        }

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of one sensor, a piece of the log at a time."""
        self._scan()
        number = int(stream.rpartition(".")[2])
        for found in self._messages(set(INSTANCES), scan=False):
            for name, rows in found.items():
                form = self._by_name[name]
                table = rows.view(form.layout)[:, 0]
                mine = table[_sensor(name, table) == number]
                if len(mine):
                    yield _block(mine, form)

    _scanned = False

    def _scan(self) -> None:
        """Walk through the log once: which sensors it has, and the parameters."""
        if self._scanned:
            return
        self._formats: dict[int, Format] = {}
        self._by_name: dict[str, Format] = {}
        self._sensors: set[int] = set()
        self._params: dict[str, float] = {}
        for found in self._messages({*INSTANCES, "PARM"}, scan=True):
            for name, rows in found.items():
                table = rows.view(self._by_name[name].layout)[:, 0]
                if name in INSTANCES:
                    self._sensors.update(_sensor(name, table).tolist())
                    continue
                for row in table:
                    key = bytes(row["Name"]).rstrip(b"\0").decode("ascii", "replace")
                    if np.isfinite(row["Value"]):
                        self._params[key] = float(row["Value"])
        self._scanned = True

    def _messages(
        self, wanted: set[str], scan: bool
    ) -> Iterator[dict[str, NDArray[np.uint8]]]:
        """Bytes of the wanted messages, (n, size), a piece of the log at a time."""
        rest, base = b"", 0
        for piece in pieces(self.path):
            data = rest + piece
            found, at = self._walk(data, base, scan)
            rest, base = data[at:], base + at
            array = np.frombuffer(data, np.uint8)
            out = {}
            for kind, starts in found.items():
                form = self._formats[kind]
                if form.name in wanted and starts:
                    view = np.lib.stride_tricks.sliding_window_view(array, form.size)
                    out[form.name] = view[np.array(starts)]
            if out:
                yield out
        if scan and rest:
            self.says.append(f"the log ends within a message, at byte {base}")

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
                if data.count(0xFF, at) == size - at or not data[at:].strip(b"\0"):
                    # blocks of flash that were never written
                    return found, size
                if scan:
                    self.damaged(f"byte {base + at}", "is no message of a log")
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
                layout.append((column, _numpy(code)))
                factors[column] = factor or 1.0
            form = Format(name, size, np.dtype(layout), factors)
        except (KeyError, ValueError, TypeError):
            form = Format("", size, np.dtype("u1"), {})
        there = set(form.layout.names or ())
        needed = {"PARM": {"Name", "Value"}, **dict.fromkeys(INSTANCES, SIX)}
        fits = form.layout.itemsize == size and there >= needed.get(name, set())
        fits = fits and all(
            form.layout[n].kind in ("S" if n == "Name" else "iuf")
            for n in there & {*NUMBERS, *needed.get(name, ())}
        )
        if name in INSTANCES:
            fits = fits and bool(there & {"TimeUS", "TimeMS"})
        if name in needed and not fits:
            self.damaged(f"byte {at}", f"defines {name} in a way that does not fit")
            return
        if size > 3 and self._formats.setdefault(kind, form).size == size:
            self._by_name.setdefault(name, form)


def _numpy(code: str) -> str:
    """Return numpy's name of a field of `struct`."""
    return f"S{code[:-1]}" if code.endswith("s") else f"<{_CODES[code]}"


NUMBERS = ("TimeUS", "TimeMS", "T", "Temp", "I")
"""Columns that are read besides those that are needed."""

_CODES = {
    "b": "i1", "B": "u1", "h": "i2", "H": "u2", "i": "i4", "I": "u4", "q": "i8",
    "Q": "u8", "e": "f2", "f": "f4", "d": "f8",
}  # fmt: skip


def _sensor(name: str, table: NDArray[np.void]) -> NDArray[np.int64]:
    """Which sensor each message speaks of."""
    if name == "IMU" and "I" in (table.dtype.names or ()):
        return table["I"].astype(np.int64)
    return np.full(len(table), INSTANCES[name])


def _block(table: NDArray[np.void], form: Format) -> Block:
    def column(name: str) -> Array:
        values: Array = table[name].astype(float) * form.factors[name]
        return values

    there = table.dtype.names or ()
    stamp = 1e-6 * column("TimeUS") if "TimeUS" in there else 1e-3 * column("TimeMS")
    degrees = next((column(n) for n in ("T", "Temp") if n in there), None)
    return Block.of(
        stamp,
        np.column_stack([column(f"Acc{axis}") for axis in "XYZ"]),
        np.column_stack([column(f"Gyr{axis}") for axis in "XYZ"]),
        degrees,
    )
