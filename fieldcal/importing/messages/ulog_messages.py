"""Messages of a PX4 log (.ulg): its definitions by pyulog, its data by numpy.

A message is its length, its kind and a body; that of data begins with the number it was
subscribed under. Definitions are as good as nothing and go through pyulog; data are
nearly all of a log, so their bytes are gathered message by message and looked at as
rows. A damaged log goes on at its next sync message. Source: PX4 user guide, ULog File
Format.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array

HEADER = 16

MESSAGE_KINDS = frozenset(b"BFIMPQALDOSRCGE")
"""Kinds of messages."""

SYNC = bytes((8, 0, ord("S"), 0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12))

DATA = ord("D")

FRONT = 5
"""Bytes of a data message before its fields: length, kind, number."""

NEVER = 1 << 62
"""Where nothing was appended."""

NESTED = 8
"""Most definitions within each other: one that holds itself would never end."""

TYPES = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "<i2", "uint16_t": "<u2",
    "int32_t": "<i4", "uint32_t": "<u4", "int64_t": "<i8", "uint64_t": "<u8",
    "float": "<f4", "double": "<f8", "bool": "i1", "char": "i1",
}  # fmt: skip

Table = dict[str, Array]
Topic = tuple[str, int]


class UlogMessages:
    """A log, walked through once when it is opened.

    Parameters
    ----------
    path : for errors
    damaged : called with a damaged place and its fault; may raise
    bytes_of : gives its bytes from the beginning, each time anew

    Attributes
    ----------
    topics : name and instance that have data
    formats : names of the fields of each topic
    info : what the log says of itself
    parameters : as the log began
    cut : where the log ends within a message, byte; None if it does not

    Raises
    ------
    InputError
        If its definitions cannot be read.

    """

    def __init__(
        self,
        path: Path,
        damaged: Callable[[str, str], None],
        bytes_of: Callable[[], Iterator[bytes]],
    ) -> None:
        self._path, self._damaged, self._bytes = path, damaged, bytes_of
        self._head = b""
        self._ids: dict[int, Topic] = {}
        self._seen = [0] * 65536
        self._appended: list[int] = []
        self.cut: int | None = None
        for _ in self._pieces(set(), scan=True):
            pass
        read = self._definitions()
        self.topics = {topic for n, topic in self._ids.items() if self._seen[n]}
        self.info: dict[str, Any] = read.msg_info_dict
        self.parameters = {
            k: float(v)
            for k, v in read.initial_parameters.items()
            if isinstance(v, int | float)
        }
        self._fields = {n: form.fields for n, form in read.message_formats.items()}
        self.formats = {
            name: tuple(str(field) for *_, field in fields)
            for name, fields in self._fields.items()
        }

    def _definitions(self) -> Any:
        from pyulog import ULog

        with contextlib.redirect_stdout(io.StringIO()):
            try:
                return ULog(io.BytesIO(self._head))
            except Exception as error:
                # a spoilt definition makes pyulog raise what it likes
                raise InputError(
                    f"{self._path}: its definitions cannot be read: {error}; copy it"
                    " again from where it came"
                ) from error

    def tables(self, wanted: set[Topic]) -> Iterator[dict[Topic, Table]]:
        """Fields of the wanted topics, a piece of the log at a time.

        Raises
        ------
        KeyError, ValueError, TypeError
            If a topic is not defined, or not in a way that can be.

        """
        layouts = {topic: self._layout(topic[0]) for topic in wanted}
        for data, base, found in self._pieces(wanted, scan=False):
            out = {}
            for number, starts in found.items():
                topic = self._ids[number]
                rows = self._rows(data, base, np.array(starts), layouts[topic])
                if len(rows):
                    out[topic] = {name: rows[name] for name in rows.dtype.names or ()}
            yield out

    def _layout(self, name: str) -> np.dtype[Any]:
        flat = _flat(self._fields, name, NESTED)
        while flat and flat[-1][0].startswith("_padding"):
            # bytes at the end that align it are not written
            flat.pop()
        return np.dtype(flat)

    def _rows(
        self,
        data: bytes,
        base: int,
        starts: NDArray[np.int64],
        layout: np.dtype[Any],
    ) -> NDArray[np.void]:
        """Messages that begin at `starts`, as rows."""
        array = np.frombuffer(data, np.uint8)
        lengths = array[starts] + 256 * array[starts + 1].astype(int) - (FRONT - 3)
        if (lengths < layout.itemsize).any():
            short = starts[lengths < layout.itemsize]
            what = "is a message that is shorter than it is defined"
            self._damaged(f"byte {base + short[0]}", what)
            starts = starts[lengths >= layout.itemsize]
        if not len(starts):
            return np.empty(0, layout)
        view = np.lib.stride_tricks.sliding_window_view(array, layout.itemsize)
        return view[starts + FRONT].view(layout)[:, 0]

    def _pieces(
        self, wanted: set[Topic], scan: bool
    ) -> Iterator[tuple[bytes, int, dict[int, list[int]]]]:
        """Pieces of the log: bytes, their place, where messages begin by number."""
        rest, base, begun = b"", 0, False
        for piece in self._bytes():
            data = rest + piece
            at = 0
            if not begun:
                if len(data) < HEADER:
                    rest = data
                    continue
                at, begun = HEADER, True
                if scan:
                    self._head = data[:HEADER]
            found, at = self._walk(data, at, base, wanted, scan)
            if found:
                yield data, base, found
            rest, base = data[at:], base + at
        if scan and (rest or not begun):
            self.cut = base

    def _walk(
        self, data: bytes, at: int, base: int, wanted: set[Topic], scan: bool
    ) -> tuple[dict[int, list[int]], int]:
        """Where wanted messages begin, by number, and where the next message does."""
        ids = {n: list[int]() for n, topic in self._ids.items() if topic in wanted}
        size = len(data)
        jumps = [offset - base for offset in self._appended if offset >= base]
        jump = jumps[0] if jumps else NEVER
        counts = self._seen
        while at + 3 <= size:
            end = at + 3 + (data[at] | data[at + 1] << 8)
            kind = data[at + 2]
            # nearly all messages are data, so these come first and go fast
            if kind == DATA and at + FRONT <= end <= size and not at < jump < end:
                number = data[at + 3] | data[at + 4] << 8
                if scan:
                    counts[number] += 1
                elif number in ids:
                    ids[number].append(at)
                at = end
                continue
            if end > jump > at:
                # what follows was appended after a crash had cut a message
                at, jumps = jump, jumps[1:]
                jump = jumps[0] if jumps else NEVER
                continue
            if kind not in MESSAGE_KINDS or end == at + 3:
                back = data.find(SYNC, at)
                if scan:
                    self._damaged(f"byte {base + at}", "is no message of a log")
                if back < 0:
                    at = max(at + 1, size - len(SYNC) + 1)
                    break
                at = back
                continue
            if end > size:
                break
            if scan:
                self._define(kind, data[at:end])
            at = end
        return {n: starts for n, starts in ids.items() if starts}, at

    def _define(self, kind: int, message: bytes) -> None:
        """Keep what defines the messages that follow."""
        if kind in b"FIPQM" and not self._ids:
            self._head += message
        elif kind == ord("B"):
            # a damaged message may end within an offset
            whole = message[19:43]
            offsets = np.frombuffer(whole[: len(whole) // 8 * 8], "<u8")
            self._appended = sorted(int(o) for o in offsets if o)
        elif kind == ord("A") and len(message) > 6:
            number = message[4] | message[5] << 8
            name = message[6:].decode("ascii", errors="replace")
            self._ids[number] = (name, message[3])


def _flat(
    fields: dict[str, list[tuple[str, int, str]]], name: str, depth: int
) -> list[tuple[str, str]]:
    """Names and numpy's types of all fields, ``name[i]`` of an array."""
    if not depth:
        raise ValueError(f"{name} is defined by itself")
    out: list[tuple[str, str]] = []
    for kind, size, field in fields[name]:
        for i in range(max(1, size)):
            label = f"{field}[{i}]" if size else field
            if kind in TYPES:
                out.append((label, TYPES[kind]))
            else:
                inner = _flat(fields, kind, depth - 1)
                out += [(f"{label}.{part}", code) for part, code in inner]
    return out
